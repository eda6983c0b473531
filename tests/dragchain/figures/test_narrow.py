"""Figures for a phone."""

from itertools import combinations
from pathlib import Path

import pytest
from PIL import Image

from dragchain.figures.narrow import NARROW, narrow, save
from dragchain.figures.panels import new_panels
from dragchain.figures.style import NARROW_IN


@pytest.mark.parametrize(
    ("ratios", "rows"), [((1.0,), 1), ((1.0, 1.0), 2), ((1.0, 1.0, 2.0, 2.0), 3)]
)
def test_panels_stand_in_rows_that_fit(ratios: tuple[float, ...], rows: int) -> None:
    figure, panels = new_panels(3.0, len(ratios), width_ratios=list(ratios), sharey=True)
    for axes in panels:
        axes.plot([0, 1], [0, 1], label="a line with a name that is longer than a phone is wide")
        axes.twinx()
    figure.legend()
    narrow(figure).canvas.draw()
    assert figure.get_figwidth() == NARROW_IN
    places = [axes.get_position() for axes in panels]
    assert len({round(place.y0, 3) for place in places}) == rows
    assert not any(one.overlaps(other) for one, other in combinations(places, 2))
    (legend,) = figure.legends
    assert legend.get_window_extent().width < figure.bbox.width


def test_a_figure_is_saved_for_both_widths(tmp_path: Path) -> None:
    figure, (axes, *_) = new_panels(3.0, 2)
    axes.set_yticks([0, 1], ["the name of a row, longer than most", "another"])
    file = save(figure, tmp_path / "drag.png")
    with Image.open(file) as wide, Image.open(tmp_path / f"drag{NARROW}.png") as small:
        assert small.width < 0.6 * wide.width and small.height > wide.height

"""What all figures have in common: minus signs and colour scales."""

import numpy as np
import pytest

from dragchain.figures.panels import head, new_panels
from dragchain.figures.style import png, top_of_scale


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("mean -2.55 N (-2.75 to -.5)", "mean \u22122.55 N (\u22122.75 to \u2212.5)"),
        ("tolerance-0.1, 2026-11-23, 1e-05, -- 3", "tolerance-0.1, 2026-11-23, 1e-05, -- 3"),
    ],
)
def test_a_hyphen_before_a_number_becomes_a_minus_sign(written: str, shown: str) -> None:
    figure, (axes,) = new_panels(3.0)
    head(figure, written)
    axes.plot([0, 1], label=written)
    axes.set_title(written)
    legend = axes.legend()
    png(figure)
    texts = [figure.get_suptitle(), axes.get_title("left"), axes.get_title()]
    assert shown in texts and (written == shown or written not in texts)
    assert legend.get_texts()[0].get_text() == shown


def test_small_facets_do_not_set_the_colours_of_a_map() -> None:
    """Needles with 4 % of the loaded area; what is not loaded does not count."""
    loads = np.array([0.0, *range(1, 97), 1e6, 1e7, 1e8, 1e9])
    areas = np.array([1e6, *[1.0] * 96, *[1.0] * 4])
    assert top_of_scale(loads, areas) == 95.0
    areas[-4:] = 0.01
    assert top_of_scale(loads, areas) == 92.0
    areas[-1] = 1e3
    assert top_of_scale(loads, areas) == 1e9
    assert top_of_scale(np.zeros(3), np.ones(3)) == 1.0

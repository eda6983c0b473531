"""Figures for a publication: their sizes and texts."""

import base64
import re
from io import BytesIO

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from dragchain.figures.panels import head, new_panels
from dragchain.report.journal import COLUMN_MM, PAGE_MM, _encoded, as_printed

MM_PER_IN = 25.4


def titled() -> Figure:
    figure, panels = new_panels(3.0, 2)
    for number, axes in enumerate(panels):
        axes.plot([0, 1], [0, number])
        axes.set_title("a heading")
    head(figure, "all of them")
    return figure


@pytest.mark.parametrize("width", [COLUMN_MM, PAGE_MM])
def test_headings_go_and_panels_get_letters(width: float) -> None:
    figure = titled()
    before = figure.get_figheight() / figure.get_figwidth()
    as_printed(figure, width)
    assert figure.get_figwidth() * MM_PER_IN == pytest.approx(width)
    assert figure.get_figheight() / figure.get_figwidth() == pytest.approx(before)
    assert figure.get_suptitle() == ""
    titles = [axes.get_title(loc) for axes in figure.axes for loc in ("left", "center", "right")]
    assert not any(titles)
    assert [axes.texts[0].get_text() for axes in figure.axes] == ["(a)", "(b)"]


def test_pictures_in_a_figure_keep_their_own_pixels() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (120, 100, 3), dtype=np.uint8)
    figure, (axes,) = new_panels(3.0)
    axes.imshow(pixels)
    as_printed(figure, PAGE_MM)
    (embedded,) = re.findall(rb'image/png;base64,([^"]+)', _encoded(figure, "svg"))
    with Image.open(BytesIO(base64.b64decode(embedded))) as picture:
        assert picture.size == (100, 120)

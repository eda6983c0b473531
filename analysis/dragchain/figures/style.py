"""Colours and style of all figures, their panels, legends and headings."""

from __future__ import annotations

from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.typing import RcKeyType
from PIL import Image

from dragchain.arrays import Ints
from dragchain.files import write_bytes

BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#6b7480"
"""After Okabe and Ito (2008): told apart with any kind of colour vision."""

INK, LIGHT, CHAIN = "#1d2733", "#c8ced6", "#1f4fa3"
SERIES = (BLUE, ORANGE, GREEN, RED, "#7a4fa3", "#5b8a99")
"""Colours of series that stand side by side."""

MARKERS = "os^vDPX*<p>d"
"""Their marks."""

STYLE: dict[RcKeyType, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "figure.titlesize": 9.5,
    "legend.frameon": False,
    "legend.fontsize": 8,
}
WIDTH_IN = 7.6
WIDE_IN = 9.5
_DPI = 150


def drawing() -> AbstractContextManager[None]:
    """A block in which figures are drawn and saved in the style of all figures."""
    return matplotlib.rc_context(STYLE)


def new_figure(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """A figure without a window: Agg draws it wherever it is saved."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def new_panels(
    height_in: float, count: int = 1, width_in: float = WIDTH_IN, columns: int = 0, **options: Any
) -> tuple[Figure, list[Axes]]:
    """A figure with so many panels, row by row; all are in one row unless `columns` are given.

    Other options are those of `Figure.subplots`.
    """
    figure, columns = new_figure(height_in, width_in), min(columns or count, count)
    grid = figure.subplots(-(-count // columns), columns, squeeze=False, **options)
    for axes in grid.flat[count:]:
        axes.set_visible(False)
    return figure, list(grid.flat[:count])


def legend_below(figure: Figure) -> Figure:
    """Put the legend of all panels below the figure, each label once; the figure."""
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    columns = _columns(np.array([len(label) for label in named]), figure.get_figwidth())
    figure.legend(named.values(), named.keys(), loc="outside lower left", ncols=columns)
    return figure


def _columns(letters: Ints, width_in: float) -> int:
    """The most columns in which labels of so many letters fit into a width, each with a mark."""
    counts = range(2, len(letters) + 1)
    parts = {count: np.array_split(letters, count) for count in counts}
    widths = {count: sum(0.5 + 0.063 * part.max() for part in parts[count]) for count in counts}
    return max((count for count in counts if widths[count] < width_in), default=1)


def head(figure: Figure, text: str) -> None:
    """Write the heading of a figure with several axes, at its left edge."""
    figure.suptitle(text, x=0.02, ha="left")


def png(figure: Figure) -> bytes:
    """A figure as PNG without transparency."""
    figure.set_dpi(_DPI)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    picture = BytesIO()
    Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").save(picture, format="png")
    return picture.getvalue()


def save(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG; it appears under its name only once it is whole."""
    write_bytes(file, png(figure))
    return file

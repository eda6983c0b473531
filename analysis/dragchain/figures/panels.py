"""Figures, their panels, legends and headings."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Ints
from dragchain.figures.style import WIDTH_IN


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
    widths = {count: sum(0.54 + 0.068 * part.max() for part in parts[count]) for count in counts}
    return max((count for count in counts if widths[count] < width_in), default=1)


def head(figure: Figure, text: str) -> None:
    """Write the heading of a figure with several axes, at its left edge."""
    figure.suptitle(text, x=0.02, ha="left")

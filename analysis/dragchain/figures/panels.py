"""The axes of a figure, and the marks that figures have in common."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike

from dragchain.arrays import Floats, Ints
from dragchain.figures.style import BLUE, COLOURS, GREY, WIDTH_IN
from dragchain.statistics.estimate import Estimate, EstimateColumns


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


# --- marks ---------------------------------------------------------------------------------------


def _with_reach(columns: EstimateColumns, unit: float) -> tuple[Floats, Floats]:
    """Values times a unit, (n,), and how far their intervals reach below and above, (2, n)."""
    value, low, high = (
        np.array(getattr(columns, name)) * unit for name in ("value", "ci95_low", "ci95_high")
    )
    return value, np.clip([value - low, high - value], 0.0, None)


def depth_bars(
    axes: Axes, edges_m: Sequence[float], columns: EstimateColumns, unit: float = 1.0
) -> None:
    """Draw values in bins of depth (mm on the vertical axis, downwards) with their intervals."""
    edges, (value, reach) = np.asarray(edges_m) * 1e3, _with_reach(columns, unit)
    middle = (edges[:-1] + edges[1:]) / 2
    axes.barh(middle, value, height=0.9 * np.diff(edges), color=BLUE, alpha=0.75)
    axes.errorbar(value, middle, xerr=reach, fmt="none", ecolor="black")
    axes.set_ylim(edges[-1], edges[0])


def band(axes: Axes, x: ArrayLike, interval: Estimate | EstimateColumns, colour: str) -> None:
    """Fill the interval about a curve."""
    low, high = interval.ci95_low, interval.ci95_high
    axes.fill_between(x, low, high, color=colour, alpha=0.17, lw=0)


def compass(figure: Figure, *place: int) -> Any:
    """Polar axes, ahead up and left at the left; `place` as for `Figure.add_subplot`."""
    return as_compass(figure.add_subplot(*place, projection="polar"))


def as_compass(axes: Any) -> Any:
    """Turn polar axes so that ahead is up and left at the left."""
    axes.set_theta_zero_location("N")
    axes.set_thetagrids(np.arange(0, 360, 45), ["ahead", "", "left", "", "behind", "", "right", ""])
    axes.set_rlabel_position(157.5)
    return axes


def compass_bars(axes: Any, edges_rad: Sequence[float], columns: EstimateColumns) -> None:
    """Draw mean normal forces by azimuth with intervals; ahead and behind differ in colour."""
    edges, (value, reach) = np.array(edges_rad), _with_reach(columns, 1.0)
    middle = (edges[:-1] + edges[1:]) / 2
    colours = np.where(np.abs(middle) < np.pi / 2, COLOURS["ahead"], COLOURS["behind"])
    axes.bar(middle, value, np.diff(edges), color=colours, edgecolor="white", linewidth=0.6)
    reach[0] = np.minimum(reach[0], value)
    axes.errorbar(middle, value, reach, fmt="none", ecolor="black", elinewidth=0.8)
    axes.set_rmin(0.0)
    axes.set_xlabel(f"mean normal force (N per {np.degrees(edges[1] - edges[0]):.0f}°)")


Row = tuple[str, Estimate, str]
"""Name, value and colour of a row."""


def row_mark(axes: Axes, place: float, estimate: Estimate, colour: str) -> None:
    """Draw a value with its interval in a row."""
    span = [estimate.ci95_low, estimate.ci95_high]
    axes.plot(span, [place, place], color=colour, linewidth=1.8, alpha=0.6)
    axes.plot(estimate.value, place, "o", color=colour)


def row_names(axes: Axes, names: Sequence[str]) -> None:
    """Name rows, the first at the top; they lie at 0, 1, ..."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def interval_rows(
    rows: Sequence[Row], lines: Mapping[str, float], xlabel: str, *, zero: bool = False
) -> Figure:
    """Values with their intervals, one below the other, and reference values as dashed lines.

    The first word of a line's label has the colour of that line; `zero` has a line too.
    """
    figure, (axes,) = new_panels(1.2 + 0.3 * len(rows))
    for place, (_, estimate, colour) in enumerate(rows):
        row_mark(axes, place, estimate, colour)
    for label, value in lines.items():
        axes.axvline(value, color=COLOURS[label.split()[0]], ls="--", label=label)
    if zero:
        axes.axvline(0.0, color="black", lw=0.7)
    row_names(axes, [name for name, *_ in rows])
    axes.set_xlabel(xlabel)
    return legend_below(figure) if lines else figure


def key(axes: Axes, label: str, **style: Any) -> None:
    """An entry of the legend that nothing drawn has: a grey dot, or another style of a line."""
    axes.plot([], [], label=label, **{"color": GREY, "ls": "", "marker": "o", **style})


def log_ticks(axis: Axis, unit: float = 1.0, steps: Sequence[float] = (1.0,)) -> None:
    """Label decades, or these steps of each, in plain numbers times a unit."""
    axis.set_major_locator(LogLocator(10.0, subs=tuple(steps), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{unit * value:g}"))
    axis.set_minor_formatter(NullFormatter())

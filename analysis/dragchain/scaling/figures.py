"""The figures of scalings of the mean drag."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures.panels import legend_below, log_ticks, new_panels
from dragchain.figures.style import BLUE, GREEN, INK, ORANGE, WIDTH_IN
from dragchain.scaling.document import CurvePoint, ScaledRun, ScalingFile

_LEAST_SPAN = 2.5
"""An axis of drag spans at least this factor, so that chance does not look like a trend."""

_PAD = 1.12
_SIDEWAYS = 0.015
"""Runs of a level stand side by side, this part of the level apart."""

_TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


def draw_scaling(found: ScalingFile) -> Figure:
    """One scaling: runs, means of the levels, the law with its band, the expected slope."""
    return draw_scalings([found])


def draw_scalings(scalings: Sequence[ScalingFile]) -> Figure:
    """Draw several scalings, two side by side."""
    width = (0.72 if len(scalings) == 1 else 1.2) * WIDTH_IN
    height = 3.35 * math.ceil(len(scalings) / 2) + 0.55
    figure, panels = new_panels(height, len(scalings), width, 2)
    for axes, found in zip(panels, scalings, strict=True):
        label, unit, factor = found.axis
        axes.set(xscale="log", yscale="log", ylabel="mean drag force magnitude (N)")
        axes.set(xlabel=f"{label} ({unit})" if unit else label, title=_title(found))
        _law(axes, found, factor)
        _points(axes, found, factor)
        _ticks(axes, found, factor)
    return legend_below(figure)


def _title(found: ScalingFile) -> str:
    exponent, expected = found.judged.exponent, found.expected.exponent
    value, low, high = (
        f"{round(number, 2) + 0.0:.2f}"
        for number in (exponent.value, exponent.ci95_low, exponent.ci95_high)
    )
    words = f"exponent {value} ({low} to {high})"
    return words if expected is None else f"{words}, expected {expected:g}: {found.verdict}"


def _law(axes: Axes, found: ScalingFile, factor: float) -> None:
    judged = found.judged
    x, drag = _line(judged.curve, factor)
    low, high = ([getattr(p, end) for p in judged.curve] for end in ("ci95_low", "ci95_high"))
    axes.fill_between(x, low, high, color=BLUE, alpha=0.15, lw=0, label="95 % confidence band")
    axes.plot(x, drag, color=BLUE, lw=1.8, label="fitted power law")
    whole, full_fit = _line(found.fit.curve, factor)
    if found.fit_within:
        axes.plot(whole, full_fit, ":", color=BLUE, label="power law, full range")
    if found.expected.exponent is not None:
        slope = (whole / (factor * judged.centre)) ** found.expected.exponent
        slope *= judged.drag_at_centre_n.value
        axes.plot(whole, slope, "--", color=ORANGE, lw=1.4, label="expected slope")
    if found.shifted:
        label = "expected power law with offset"
        axes.plot(*_line(found.shifted.curve, factor), "-.", color=GREEN, label=label)


def _line(curve: Sequence[CurvePoint], factor: float) -> tuple[Floats, list[float]]:
    """Levels in the unit of the axis, and drag."""
    return factor * np.array([point.x for point in curve]), [point.value for point in curve]


def _points(axes: Axes, found: ScalingFile, factor: float) -> None:
    levels = [level for level in found.levels if level.runs > 1]
    x = [factor * level.x for level in levels]
    means = [level.drag_n.value for level in levels]
    axes.plot(x, means, "_", ms=17, mew=2.0, color=INK, label="mean per level")
    x = [factor * place for place in _beside(found.runs)]
    drag, error = zip(*((run.drag_n, run.standard_error_n) for run in found.runs), strict=True)
    label = "run, ± standard error"
    axes.errorbar(x, drag, error, color=INK, fmt="o", mfc="white", zorder=3, label=label)


def _beside(runs: Sequence[ScaledRun]) -> list[float]:
    """Levels of runs, those of beds side by side."""
    beds = sorted({run.bed for run in runs})
    middle = 0.5 * (len(beds) - 1)
    return [run.level * (1.0 + _SIDEWAYS * (beds.index(run.bed) - middle)) for run in runs]


def _ticks(axes: Axes, found: ScalingFile, factor: float) -> None:
    """Every level on the horizontal axis, round numbers on the vertical."""
    levels = [factor * level.x for level in found.levels]
    axes.set_xlim(levels[0] / _PAD, levels[-1] * _PAD)
    low, high = axes.get_ylim()
    stretch = max(1.0, math.sqrt(_LEAST_SPAN * low / high))
    low, high = low / stretch, high * stretch
    axes.set_ylim(low, high)
    log_ticks(axes.yaxis, steps=(1.0, 2.0, 5.0) if high > 12.0 * low else _TICKS)
    axes.set_xticks(levels, [f"{level:g}" for level in levels])
    axes.minorticks_off()

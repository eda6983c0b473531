"""The figures of scalings of the mean drag."""

from __future__ import annotations

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, StrMethodFormatter

from dragchain.arrays import Floats
from dragchain.figures.style import BLUE, GREEN, ORANGE, STYLE, WIDTH_IN
from dragchain.report.notation import MINUS
from dragchain.scaling.document import CurvePoint, ScaledRun, ScalingFile

_INK = "#1d2733"
_LEAST_SPAN = 2.5
"""An axis of drag spans at least this factor, so that chance does not look like a trend."""

_PAD = 1.12
_SIDEWAYS = 0.015
"""Runs of a level stand side by side, this part of the level apart."""

_TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


def draw_scaling(found: ScalingFile) -> Figure:
    """One scaling: runs, means of the levels, the law with its band, the expected slope."""
    figure = Figure(figsize=(0.72 * WIDTH_IN, 3.9), layout="constrained")
    axes = figure.subplots()
    _panel(axes, found)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def draw_scalings(scalings: Sequence[ScalingFile]) -> Figure:
    """Draw several scalings, two side by side."""
    with matplotlib.rc_context(STYLE):
        columns = min(2, len(scalings))
        rows = math.ceil(len(scalings) / 2)
        figure = Figure(figsize=(1.2 * WIDTH_IN, 3.35 * rows + 0.5), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).flat
        named: dict[str, Artist] = {}
        for axes, found in zip(panels, scalings, strict=False):
            _panel(axes, found)
            handles, labels = axes.get_legend_handles_labels()
            named |= dict(zip(labels, handles, strict=True))
        for axes in panels[len(scalings) :]:
            axes.set_visible(False)
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=4)
        return figure


def _panel(axes: Axes, found: ScalingFile) -> None:
    label, unit, factor = found.axis
    axes.set(xscale="log", yscale="log")
    _law(axes, found, factor)
    _points(axes, found, factor)
    axes.set_xlabel(f"{label} ({unit})" if unit else label)
    axes.set_ylabel("mean drag force magnitude (N)")
    axes.set_title(_title(found))
    _ticks(axes, found, factor)


def _title(found: ScalingFile) -> str:
    exponent, expected = found.judged.exponent, found.expected.exponent
    value, low, high = (
        f"{round(number, 2) + 0.0:.2f}".replace("-", MINUS)
        for number in (exponent.value, exponent.ci95_low, exponent.ci95_high)
    )
    words = f"exponent {value} ({low} to {high})"
    return words if expected is None else f"{words}, expected {expected:g}: {found.verdict}"


def _law(axes: Axes, found: ScalingFile, factor: float) -> None:
    judged = found.judged
    x, values = _line(judged.curve, factor)
    low, high = ([getattr(p, end) for p in judged.curve] for end in ("ci95_low", "ci95_high"))
    axes.fill_between(x, low, high, color=BLUE, alpha=0.15, lw=0, label="95 % confidence band")
    axes.plot(x, values, color=BLUE, lw=1.8, label="fitted power law")
    if found.fit_within:
        whole = _line(found.fit.curve, factor)
        axes.plot(*whole, ":", color=BLUE, lw=1.2, label="power law, full range")
    if found.expected.exponent is not None:
        every, _ = _line(found.fit.curve)
        slope = (every / judged.centre) ** found.expected.exponent
        slope = judged.drag_at_centre_n.value * slope
        axes.plot(factor * every, slope, "--", color=ORANGE, lw=1.4, label="expected slope")
    if found.shifted:
        label = "expected power law with offset"
        axes.plot(*_line(found.shifted.curve, factor), "-.", color=GREEN, lw=1.2, label=label)


def _line(curve: Sequence[CurvePoint], factor: float = 1.0) -> tuple[Floats, list[float]]:
    """Levels in the unit of the axis, and drag."""
    return factor * np.array([point.x for point in curve]), [point.value for point in curve]


def _points(axes: Axes, found: ScalingFile, factor: float) -> None:
    levels = [level for level in found.levels if level.runs > 1]
    axes.plot(
        [factor * level.x for level in levels],
        [level.drag_n.value for level in levels],
        "_",
        ms=17,
        mew=2.0,
        color=_INK,
        label="mean per level",
    )
    runs = found.runs
    axes.errorbar(
        [factor * run.level * beside for run, beside in zip(runs, _beside(runs), strict=True)],
        [run.drag_n for run in runs],
        yerr=[run.standard_error_n for run in runs],
        fmt="o",
        ms=4.0,
        mfc="white",
        color=_INK,
        elinewidth=0.9,
        zorder=3,
        label="run, ± standard error",
    )


def _beside(runs: Sequence[ScaledRun]) -> list[float]:
    """Factors on the levels of runs that put beds side by side."""
    beds = sorted({run.bed for run in runs})
    middle = 0.5 * (len(beds) - 1)
    return [1.0 + _SIDEWAYS * (beds.index(run.bed) - middle) for run in runs]


def _ticks(axes: Axes, found: ScalingFile, factor: float) -> None:
    """Every level on the horizontal axis, round numbers on the vertical."""
    levels = [factor * level.x for level in found.levels]
    axes.set_xlim(levels[0] / _PAD, levels[-1] * _PAD)
    axes.xaxis.set_major_locator(FixedLocator(levels))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    low, high = axes.get_ylim()
    stretch = max(1.0, math.sqrt(_LEAST_SPAN * low / high))
    low, high = low / stretch, high * stretch
    axes.set_ylim(low, high)
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    wide = high > 12.0 * low
    steps = (1.0, 2.0, 5.0) if wide else _TICKS
    axes.yaxis.set_major_locator(FixedLocator([s * 10.0**d for d in decades for s in steps]))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_locator(NullLocator())

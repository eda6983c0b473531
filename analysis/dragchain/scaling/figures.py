"""The figures of scalings of the mean drag."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from dragchain.figures.style import BLUE, GREEN, ORANGE, STYLE, WIDTH_IN

INK = "#1d2733"
LEAST_SPAN = 2.5
"""An axis of drag spans at least this factor, so that chance does not look like a trend."""

PAD = 1.12
SIDEWAYS = 0.015
"""Runs of a level stand side by side, this part of the level apart."""

TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)

NAMES: Mapping[str, tuple[str, str, float]] = {
    "motion.immersion_depth_m": ("depth of the tip", "mm", 1e3),
    "workpiece.shape.radius_m": ("radius of the workpiece", "mm", 1e3),
    "motion.speed_m_s": ("speed of the workpiece", "mm/s", 1e3),
}
"""Label, unit and factor to that unit of fields that have a plain name."""


def axis_name(field: str) -> tuple[str, str, float]:
    """Label, unit and factor of a field: its own name if it has no plainer one."""
    if field in NAMES:
        return NAMES[field]
    if field.startswith("pairs.") and field.endswith(".friction"):
        return f"friction coefficient, {field.split('.')[1].replace('-', ' on ')}", "", 1.0
    return field, "", 1.0


def draw_scaling(found: Mapping[str, Any]) -> Figure:
    """One scaling: runs, means of the levels, the law with its band, the expected slope.

    Parameters
    ----------
    found : mapping
        Content of ``scaling.json``.
    """
    figure = Figure(figsize=(0.72 * WIDTH_IN, 3.9), layout="constrained")
    axes = figure.subplots()
    _panel(axes, found)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def draw_scalings(scalings: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw several scalings, two side by side.

    Parameters
    ----------
    scalings : sequence of mapping
        Content of each ``scaling.json``.
    """
    with matplotlib.rc_context(STYLE):
        columns = min(2, len(scalings))
        rows = math.ceil(len(scalings) / 2)
        figure = Figure(figsize=(1.2 * WIDTH_IN, 3.35 * rows + 0.5), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False)
        for axes, found in zip(panels.flat, scalings, strict=False):
            _panel(axes, found)
        for axes in panels.flat[len(scalings) :]:
            axes.set_visible(False)
        named: dict[str, Any] = {}
        for axes in panels.flat[: len(scalings)]:
            named |= {
                label: handle
                for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
            }
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=4)
        return figure


def _panel(axes: Axes, found: Mapping[str, Any]) -> None:
    label, unit, factor = axis_name(found["field"])
    axes.set(xscale="log", yscale="log")
    _law(axes, found, factor)
    _points(axes, found, factor)
    axes.set_xlabel(f"{label} in {unit}" if unit else label)
    axes.set_ylabel("size of the mean drag in N")
    axes.set_title(_title(found))
    _ticks(axes, found, factor)


def _title(found: Mapping[str, Any]) -> str:
    judged = found["fit_within"] or found["fit"]
    exponent = judged["exponent"]
    words = f"exponent {_signed(exponent['value'])}"
    words += f" ({_signed(exponent['ci95_low'])} to {_signed(exponent['ci95_high'])})"
    expected = found["expected"]["exponent"]
    return words if expected is None else f"{words}, expected {expected:g}: {found['verdict']}"


def _signed(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _law(axes: Axes, found: Mapping[str, Any], factor: float) -> None:
    judged = found["fit_within"] or found["fit"]
    curve = judged["curve"]
    x = factor * np.array([point["x"] for point in curve])
    low, value, high = (
        np.array([point[name] for point in curve]) for name in ("ci95_low", "value", "ci95_high")
    )
    axes.fill_between(x, low, high, color=BLUE, alpha=0.15, lw=0, label="95 % band of the law")
    axes.plot(x, value, color=BLUE, lw=1.8, label="fitted power law")
    if found["fit_within"]:
        _whole(axes, found["fit"]["curve"], factor)
    expected = found["expected"]["exponent"]
    if expected is not None:
        centre = judged["centre"]
        middle = judged["drag_at_centre_n"]["value"]
        every = np.array([point["x"] for point in found["fit"]["curve"]])
        slope = middle * (every / centre) ** expected
        axes.plot(factor * every, slope, "--", color=ORANGE, lw=1.4, label="expected slope")

    if found["shifted"]:
        _shifted(axes, found["shifted"]["curve"], factor)


def _shifted(axes: Axes, curve: Sequence[Mapping[str, float]], factor: float) -> None:
    x = factor * np.array([point["x"] for point in curve])
    values = [point["value"] for point in curve]
    axes.plot(x, values, "-.", color=GREEN, lw=1.2, label="expected power of level + offset")


def _whole(axes: Axes, curve: Sequence[Mapping[str, float]], factor: float) -> None:
    x = factor * np.array([point["x"] for point in curve])
    values = [point["value"] for point in curve]
    axes.plot(x, values, ":", color=BLUE, lw=1.2, label="power law over all levels")


def _points(axes: Axes, found: Mapping[str, Any], factor: float) -> None:
    levels = [level for level in found["levels"] if level["runs"] > 1]
    axes.plot(
        [factor * level["x"] for level in levels],
        [level["drag_n"]["value"] for level in levels],
        "_",
        ms=17,
        mew=2.0,
        color=INK,
        label="mean of a level",
    )
    runs = found["runs"]
    axes.errorbar(
        [factor * run["level"] * beside for run, beside in zip(runs, _beside(runs), strict=True)],
        [run["drag_n"] for run in runs],
        yerr=[run["standard_error_n"] for run in runs],
        fmt="o",
        ms=4.0,
        mfc="white",
        color=INK,
        elinewidth=0.9,
        zorder=3,
        label="a run and its standard error",
    )


def _beside(runs: Sequence[Mapping[str, Any]]) -> list[float]:
    """Factors on the levels of runs that put beds side by side."""
    beds = sorted({run["bed"] for run in runs})
    middle = 0.5 * (len(beds) - 1)
    return [1.0 + SIDEWAYS * (beds.index(run["bed"]) - middle) for run in runs]


def _ticks(axes: Axes, found: Mapping[str, Any], factor: float) -> None:
    """Every level on the horizontal axis, round numbers on the vertical."""
    levels = [factor * level["x"] for level in found["levels"]]
    axes.set_xlim(levels[0] / PAD, levels[-1] * PAD)
    axes.xaxis.set_major_locator(FixedLocator(levels))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    low, high = axes.get_ylim()
    stretch = max(1.0, math.sqrt(LEAST_SPAN * low / high))
    low, high = low / stretch, high * stretch
    axes.set_ylim(low, high)
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    wide = high > 12.0 * low
    steps = (1.0, 2.0, 5.0) if wide else TICKS
    axes.yaxis.set_major_locator(FixedLocator([s * 10.0**d for d in decades for s in steps]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_locator(NullLocator())

"""Figures of peaks and chains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dragchain.arrays import Floats
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, legend_below, new_figure
from dragchain.validation.peaks.averages import Lifetimes
from dragchain.validation.peaks.findings import Study
from dragchain.validation.peaks.lags import LagCurves
from dragchain.validation.peaks.run_series import RunSeries
from dragchain.validation.peaks.settings import DEFAULTS, DEFINITIONS, SETTINGS, Definition
from dragchain.validation.peaks.tests import DESCRIPTORS, PeakTest
from dragchain.validation.peaks.verdicts import LEVEL

_COLOURS: dict[Definition, str] = {
    "widest_path": BLUE, "free_path": GREEN, "peters": RED, "peters_workpiece": ORANGE
}  # fmt: skip
_FAMILIES: dict[str, tuple[Definition, ...]] = {
    "paths": ("free_path", "widest_path"),
    "Peters' chains": ("peters", "peters_workpiece"),
}
_LAGGED = {
    "bottleneck_over_mean": "bottleneck force /\nmean contact force",
    "stands_out": "bottleneck behind the workpiece\n/ RMS of the shell",
}
_FOREST = tuple(one for one in DESCRIPTORS if one.statement in ("presence", "dominance"))


def draw(study: Study) -> dict[str, Figure]:
    """The figures by the name of their file."""
    found = study.findings
    return {
        "chains_around_peaks": _around_peaks(found.lags),
        "chain_effects": _effects(found.tests),
        "chain_geometry": _geometry(study.runs, found.lifetimes),
    }


def _around_peaks(lags: LagCurves) -> Figure:
    """Event-triggered averages with the band that chance keeps."""
    figure = new_figure(5.0)
    grid = figure.subplots(len(_LAGGED), len(_FAMILIES), sharex=True, sharey=True)
    for row, (name, label) in zip(grid, _LAGGED.items(), strict=True):
        for axes, (family, definitions) in zip(row, _FAMILIES.items(), strict=True):
            _lag_panel(axes, lags, name, definitions)
            axes.set_title(family)
        row[0].set_ylabel(f"{label}\n(standard deviations)", fontsize=8.5)
    for axes in grid[-1]:
        axes.set_xlabel("time after the peak (s)")
    handles = {
        label: handle
        for axes in grid[-1]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside lower left", ncols=3)
    return figure


def _lag_panel(axes: Axes, lags: LagCurves, name: str, definitions: tuple[Definition, ...]) -> None:
    axes.axvline(0.0, color=GREY, linewidth=0.7, linestyle=":")
    axes.plot(lags.lag_s, lags.drag, color=GREY, linewidth=0.9, label="drag force magnitude")
    for definition in definitions:
        mean, colour = lags.curves[definition][name].mean, _COLOURS[definition]
        axes.plot(lags.lag_s, mean, color=colour, label=DEFINITIONS[definition])
    band = lags.curves[definitions[0]][name].band
    if np.isfinite(band):
        words = "simultaneous 95 % null band"
        axes.axhspan(-band, band, color="#d9dde2", alpha=0.5, linewidth=0, label=words)


# --- effects over thresholds -----------------------------------------------------------------


def _effects(tests: Sequence[PeakTest]) -> Figure:
    """The effects of all settings, one panel per descriptor."""
    of_setting = {
        (test.descriptor, test.definition, test.thresholds): test
        for test in tests
        if test.peaks == "all"
    }
    figure = new_figure(6.4)
    grid = figure.subplots(1, len(_FOREST), sharey=True)
    for axes, descriptor in zip(grid, _FOREST, strict=True):
        for place, setting in enumerate(SETTINGS):
            test = of_setting[descriptor.name, setting.definition, setting.label]
            _effect(axes, -place - _gap(place), test)
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_title(fill(descriptor.label, 16), fontsize=7.5)
        axes.tick_params(axis="x", labelsize=7.5)
        axes.grid(axis="y", visible=False)
    places = [-place - _gap(place) for place in range(len(SETTINGS))]
    names = [setting.label + ("  *" if setting.default else "") for setting in SETTINGS]
    grid[0].set_yticks(places, names, fontsize=7.5)
    for tick, setting in zip(grid[0].get_yticklabels(), SETTINGS, strict=True):
        tick.set_color(_COLOURS[setting.definition])
    for definition, colour in _COLOURS.items():
        grid[0].plot([], [], "o", color=colour, label=DEFINITIONS[definition])
    grid[0].plot([], [], "o", color=GREY, mfc="white", label="unadjusted p ≥ 0.05")
    figure.suptitle(
        "peaks minus all times (standard deviations); "
        "bars: 95 % CI over the packings; *: default thresholds",
        fontsize=8.5, x=0.02, ha="left",
    )  # fmt: skip
    legend_below(figure, grid[0], columns=3)
    return figure


def _gap(place: int) -> float:
    """Leave room between definitions."""
    names = list(DEFINITIONS)
    return 0.8 * names.index(SETTINGS[place].definition)


def _effect(axes: Axes, height: float, test: PeakTest) -> None:
    colour = _COLOURS[test.definition]
    axes.plot([test.ci95_low, test.ci95_high], [height, height], color=colour, linewidth=1.0)
    inside = colour if test.p_claimed < LEVEL else "white"
    axes.plot([test.effect], [height], "o", color=colour, markersize=4.5, markerfacecolor=inside)


# --- orientation, altitude, lifetime ---------------------------------------------------------


def _geometry(runs: Sequence[RunSeries], lifetimes: Mapping[Definition, Lifetimes]) -> Figure:
    """Azimuth, altitude and lifetime of the dominant chains, at peaks and at all times."""
    figure = new_figure(6.0)
    shown: tuple[Definition, ...] = ("widest_path", "peters")
    for row, name in enumerate(shown):
        rose: Any = figure.add_subplot(2, 3, 3 * row + 1, projection="polar")
        _rose(rose, runs, DEFAULTS[name])
        rose.set_title(f"{DEFINITIONS[name]}:\nazimuth, ahead up", fontsize=8.5, pad=14)
        heights, lives = (figure.add_subplot(2, 3, 3 * row + place) for place in (2, 3))
        _altitude(heights, runs, DEFAULTS[name])
        _survival(lives, lifetimes[name])
    legend_below(figure, heights)
    return figure


_OUTLINE: dict[str, Any] = {"color": RED, "linewidth": 1.4}
_FILLED: dict[str, Any] = {"color": GREY, "linewidth": 1.4, "fill": True, "alpha": 0.45}


def _at_all_and_peaks(
    runs: Sequence[RunSeries], at: int, column: str
) -> list[tuple[str, Floats, dict[str, Any]]]:
    """The known values at all times and at peaks, each with its name and its style."""
    values = [run.chain(at, column) for run in runs]
    peaks = [one[run.events("all")] for one, run in zip(values, runs, strict=True)]
    groups = (("all times", values, _FILLED), ("at peaks", peaks, _OUTLINE))
    joined = ((name, np.concatenate(parts), style) for name, parts, style in groups)
    return [(name, one[np.isfinite(one)], style) for name, one, style in joined]


def _percentages(values: Floats, edges: Floats) -> Floats:
    return np.asarray(100.0 * np.histogram(values, edges)[0] / max(len(values), 1))


def _rose(axes: Any, runs: Sequence[RunSeries], at: int) -> None:
    axes.set_theta_zero_location("N")
    edges = np.linspace(-np.pi, np.pi, 25)
    for _, azimuth, style in _at_all_and_peaks(runs, at, "azimuth_rad"):
        axes.stairs(_percentages(azimuth, edges), edges, **style)
    axes.set_thetagrids(np.arange(0, 360, 90), ["ahead", "left", "behind", "right"], fontsize=7.5)
    axes.set_rlabel_position(157.5)
    axes.tick_params(axis="y", labelsize=7)
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_formatter("{x:.0f} %")


def _altitude(axes: Axes, runs: Sequence[RunSeries], at: int) -> None:
    groups = _at_all_and_peaks(runs, at, "altitude_m")
    top = 1e3 * max(height.max(initial=0.01) for _, height, _ in groups)
    edges = np.arange(0.0, top + 5.0, 5.0)
    for name, height, style in groups:
        label = f"{name} ({len(height)} frames)"
        fractions = _percentages(height * 1e3, edges)
        axes.stairs(fractions, edges, orientation="horizontal", label=label, **style)
    axes.set(xlabel="frames (%)", ylabel="mean height of the chain\nabove the floor (mm)")
    axes.set_title("height", fontsize=8.5)


def _survival(axes: Axes, lifetime: Lifetimes) -> None:
    survival, median_s = lifetime.survival, lifetime.median_s
    axes.step([0.0, *survival.time_s], [1.0, *survival.fraction], where="post", color=BLUE)
    axes.set(xlabel="lifetime (s)", ylabel="fraction surviving", yscale="log")
    median = f"{median_s * 1e3:.0f} ms" if np.isfinite(median_s) else "unknown"
    axes.set_title(
        f"lifetime: median {median},\n{lifetime.lives} chains, {lifetime.truncated} censored",
        fontsize=8.5,
    )

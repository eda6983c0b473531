"""Figures of peaks and chains."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dragchain.arrays import Floats
from dragchain.figures.marks import compass, key, row, row_names
from dragchain.figures.panels import head, legend_below, new_figure, new_panels
from dragchain.figures.style import BLUE, COLOURS, GREY, INK, RED, SERIES
from evidence.validation.peaks.averages import Lifetimes
from evidence.validation.peaks.findings import Study
from evidence.validation.peaks.lags import LagCurves
from evidence.validation.peaks.run_series import RunSeries
from evidence.validation.peaks.settings import DEFAULTS, DEFINITIONS, SETTINGS, Definition
from evidence.validation.peaks.tests import DESCRIPTORS, PeakTest
from evidence.validation.peaks.verdicts import LEVEL

_COLOURS: dict[Definition, str] = {
    "widest_path": COLOURS["dominant_path"], "free_path": INK,
    "peters": COLOURS["chain"], "peters_workpiece": SERIES[-1],
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
    grid = [(label, family) for label in _LAGGED for family in _FAMILIES]
    figure, panels = new_panels(5.0, len(grid), columns=2, sharex=True, sharey=True)
    for axes, (name, family) in zip(panels, grid, strict=True):
        _lag_panel(axes, lags, name, _FAMILIES[family])
        axes.set_title(family)
    for axes, label in zip(panels[::2], _LAGGED.values(), strict=True):
        axes.set_ylabel(f"{label}\n(standard deviations)", fontsize=8.5)
    for axes in panels[-2:]:
        axes.set_xlabel("time after the peak (s)")
    return legend_below(figure)


def _lag_panel(axes: Axes, lags: LagCurves, name: str, definitions: tuple[Definition, ...]) -> None:
    axes.axvline(0.0, color=GREY, linewidth=0.7, linestyle=":")
    axes.plot(
        lags.lag_s, lags.drag, color=COLOURS["drag"], linewidth=0.9, label="drag force magnitude"
    )
    for definition in definitions:
        mean, colour = lags.curves[definition][name].mean, _COLOURS[definition]
        axes.plot(lags.lag_s, mean, color=colour, label=DEFINITIONS[definition])
    band = lags.curves[definitions[0]][name].band
    if np.isfinite(band):
        words = "simultaneous 95 % null band"
        axes.axhspan(-band, band, color=COLOURS["transient"], alpha=0.5, linewidth=0, label=words)


# --- effects over thresholds -----------------------------------------------------------------


def _effects(tests: Sequence[PeakTest]) -> Figure:
    """The effects of all settings, one panel per descriptor."""
    of_setting = {
        (test.descriptor, test.definition, test.thresholds): test
        for test in tests
        if test.peaks == "all"
    }
    figure, panels = new_panels(6.4, len(_FOREST), sharey=True)
    gaps = {name: 0.8 * number for number, name in enumerate(DEFINITIONS)}
    places = [place + gaps[one.definition] for place, one in enumerate(SETTINGS)]
    for axes, descriptor in zip(panels, _FOREST, strict=True):
        for place, setting in zip(places, SETTINGS, strict=True):
            test = of_setting[descriptor.name, setting.definition, setting.label]
            colour, filled = _COLOURS[test.definition], test.p_claimed < LEVEL
            row(axes, place, test.effect, test, colour, filled)
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_title(fill(descriptor.label, 16), fontsize=7.5)
        axes.tick_params(labelsize=7.5)
        axes.grid(axis="y", visible=False)
    names = [setting.label + ("  *" if setting.default else "") for setting in SETTINGS]
    row_names(panels[0], names, places)
    for tick, setting in zip(panels[0].get_yticklabels(), SETTINGS, strict=True):
        tick.set_color(_COLOURS[setting.definition])
    for name, colour in _COLOURS.items():
        key(panels[0], DEFINITIONS[name], color=colour)
    key(panels[0], "unadjusted p ≥ 0.05", mfc="white")
    head(
        figure,
        "peaks minus all times (standard deviations); "
        "bars: 95 % CI over the packings; *: default thresholds",
    )
    return legend_below(figure)


# --- orientation, altitude, lifetime ---------------------------------------------------------


def _geometry(runs: Sequence[RunSeries], lifetimes: Mapping[Definition, Lifetimes]) -> Figure:
    """Azimuth, altitude and lifetime of the dominant chains, at peaks and at all times."""
    figure = new_figure(6.0)
    shown: tuple[Definition, ...] = ("widest_path", "peters")
    for first, name in zip((1, 4), shown, strict=True):
        rose = compass(figure, 2, 3, first)
        _rose(rose, runs, DEFAULTS[name])
        rose.set_title(f"{DEFINITIONS[name]}:\nazimuth", pad=14)
        _altitude(figure.add_subplot(2, 3, first + 1), runs, DEFAULTS[name])
        _survival(figure.add_subplot(2, 3, first + 2), lifetimes[name])
    return legend_below(figure)


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
    edges = np.linspace(-np.pi, np.pi, 25)
    for _, azimuth, style in _at_all_and_peaks(runs, at, "azimuth_rad"):
        axes.stairs(_percentages(azimuth, edges), edges, **style)
    axes.tick_params(labelsize=7)
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_formatter("{x:.0f} %")


def _altitude(axes: Axes, runs: Sequence[RunSeries], at: int) -> None:
    groups = _at_all_and_peaks(runs, at, "altitude_m")
    top = 1e3 * max(height.max(initial=0.01) for _, height, _ in groups)
    edges = np.arange(0.0, top + 5.0, 5.0)
    for name, height, style in groups:
        fractions = _percentages(height * 1e3, edges)
        axes.stairs(fractions, edges, orientation="horizontal", label=name, **style)
    axes.set(xlabel="frames (%)", ylabel="mean height of the chain\nabove the floor (mm)")
    all_times, at_peaks = (len(height) for _, height, _ in groups)
    axes.set_title(f"height: {all_times} frames,\n{at_peaks} at peaks")


def _survival(axes: Axes, lifetime: Lifetimes) -> None:
    survival, median_s = lifetime.survival, lifetime.median_s
    axes.step([0.0, *survival.time_s], [1.0, *survival.fraction], where="post", color=BLUE)
    axes.set(xlabel="lifetime (s)", ylabel="fraction surviving", yscale="log")
    median = f"{median_s * 1e3:.0f} ms" if np.isfinite(median_s) else "unknown"
    counts = f"{lifetime.lives} chains, {lifetime.truncated} censored"
    axes.set_title(f"lifetime: median {median},\n{counts}")

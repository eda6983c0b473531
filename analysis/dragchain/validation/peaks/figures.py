"""Figures of peaks and chains."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dragchain.arrays import Floats
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED
from dragchain.validation.peaks.dominant_chain import DEFINITIONS, SETTINGS
from dragchain.validation.peaks.tests import DESCRIPTORS, Found, RunSeries, Study

COLOURS = {"widest_path": BLUE, "free_path": GREEN, "peters": RED, "peters_workpiece": ORANGE}
FAMILIES = {"paths": ("free_path", "widest_path"), "Peters' chains": ("peters", "peters_workpiece")}
LAGGED = {
    "bottleneck_over_mean": "weakest contact over\nthe mean contact",
    "stands_out": "weakest behind the workpiece\nover the shell's rms",
}
FOREST = tuple(one for one in DESCRIPTORS if one.statement in ("presence", "dominance"))


def draw(study: Study) -> dict[str, Callable[[], Figure]]:
    """The figures by the name of their file."""
    return {
        "chains_around_peaks": lambda: _around_peaks(study.found["lags"]),
        "chain_effects": lambda: _effects(study.tests),
        "chain_geometry": lambda: _geometry(study),
    }


def _around_peaks(lags: Found) -> Figure:
    """Event-triggered averages with the band that chance keeps."""
    figure = Figure(figsize=(7.6, 5.0), layout="constrained")
    grid = figure.subplots(len(LAGGED), len(FAMILIES), sharex=True, sharey=True)
    lag = np.asarray(lags["lag_s"])
    for row, (name, label) in zip(grid, LAGGED.items(), strict=True):
        for axes, (family, definitions) in zip(row, FAMILIES.items(), strict=True):
            _lag_panel(axes, lag, lags, name, definitions)
            axes.set_title(family)
        row[0].set_ylabel(f"{label},\nin standard deviations", fontsize=8.5)
    for axes in grid[-1]:
        axes.set_xlabel("time after the peak in s")
    handles = {
        label: handle
        for axes in grid[-1]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside lower left", ncols=3)
    return figure


def _lag_panel(
    axes: Axes, lag: Floats, lags: Found, name: str, definitions: tuple[str, ...]
) -> None:
    axes.axvline(0.0, color=GREY, linewidth=0.7, linestyle=":")
    axes.plot(lag, _numbers(lags["drag"]), color=GREY, linewidth=0.9, label="resistance")
    for definition in definitions:
        curve = lags[definition][name]
        colour = COLOURS[definition]
        axes.plot(lag, _numbers(curve["mean"]), color=colour, label=DEFINITIONS[definition])
    band = lags[definitions[0]][name]["band"]
    if band is not None:
        words = "95 % of shifted data sets stay inside"
        axes.axhspan(-band, band, color="#d9dde2", alpha=0.5, linewidth=0, label=words)


def _numbers(values: list[float | None]) -> Floats:
    return np.array(values, dtype=np.float64)


# --- effects over thresholds -----------------------------------------------------------------


def _effects(tests: pd.DataFrame) -> Figure:
    """Draw the effect of every claimed descriptor for every definition and threshold."""
    figure = Figure(figsize=(7.6, 6.4), layout="constrained")
    grid = figure.subplots(1, len(FOREST), sharey=True)
    for axes, descriptor in zip(grid, FOREST, strict=True):
        rows = tests[(tests["peaks"] == "all") & (tests["descriptor"] == descriptor.name)]
        for place, setting in enumerate(SETTINGS):
            row = rows[
                (rows["definition"] == setting.definition) & (rows["thresholds"] == setting.label)
            ].iloc[0]
            _effect(axes, -place - _gap(place), row)
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_title(fill(descriptor.label, 16), fontsize=7.5)
        axes.tick_params(axis="x", labelsize=7.5)
        axes.grid(axis="y", visible=False)
    places = [-place - _gap(place) for place in range(len(SETTINGS))]
    names = [setting.label + ("  *" if setting.default else "") for setting in SETTINGS]
    grid[0].set_yticks(places, names, fontsize=7.5)
    for tick, setting in zip(grid[0].get_yticklabels(), SETTINGS, strict=True):
        tick.set_color(COLOURS[setting.definition])
    for definition, colour in COLOURS.items():
        grid[0].plot([], [], "o", color=colour, label=DEFINITIONS[definition])
    grid[0].plot([], [], "o", color=GREY, mfc="white", label="unadjusted p 0.05 or more")
    figure.suptitle(
        "at peaks less all times, in standard deviations of the run; "
        "bars: 95 % interval over the fills; *: default thresholds",
        fontsize=8.5, x=0.02, ha="left",
    )  # fmt: skip
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=3)
    return figure


def _gap(place: int) -> float:
    """Leave room between definitions."""
    names = list(DEFINITIONS)
    return 0.8 * names.index(SETTINGS[place].definition)


def _effect(axes: Axes, height: float, row: pd.Series[Any]) -> None:
    colour = COLOURS[row["definition"]]
    axes.plot([row["ci95_low"], row["ci95_high"]], [height, height], color=colour, linewidth=1.0)
    sure = row["p_claimed"] < 0.05
    axes.plot([row["effect"]], [height], "o", color=colour, markersize=4.5,
              markerfacecolor=colour if sure else "white")  # fmt: skip


# --- orientation, altitude, lifetime ---------------------------------------------------------


def _geometry(study: Study) -> Figure:
    """Azimuth, altitude and lifetime of the dominant chains, at peaks and at all times."""
    figure = Figure(figsize=(7.6, 6.0), layout="constrained")
    defaults = {setting.definition: at for at, setting in enumerate(SETTINGS) if setting.default}
    for row, name in enumerate(("widest_path", "peters")):
        rose: Any = figure.add_subplot(2, 3, 3 * row + 1, projection="polar")
        _rose(rose, study.runs, defaults[name])
        rose.set_title(f"{DEFINITIONS[name]}:\nazimuth, ahead up", fontsize=8.5, pad=14)
        heights, lives = (figure.add_subplot(2, 3, 3 * row + place) for place in (2, 3))
        _altitude(heights, study.runs, defaults[name])
        _survival(lives, study.found["lifetimes"][name])
    handles, labels = heights.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2)
    return figure


def _at_all_and_peaks(
    runs: tuple[RunSeries, ...], at: int, column: str
) -> Mapping[str, tuple[Floats, str]]:
    values = [run.columns[at][column].astype(np.float64) for run in runs]
    peaks = [one[run.events("all")] for one, run in zip(values, runs, strict=True)]
    found = {"all times": (np.concatenate(values), GREY), "at peaks": (np.concatenate(peaks), RED)}
    return {name: (one[np.isfinite(one)], colour) for name, (one, colour) in found.items()}


def _rose(axes: Any, runs: tuple[RunSeries, ...], at: int) -> None:
    axes.set_theta_zero_location("N")
    edges = np.linspace(-np.pi, np.pi, 25)
    for name, (azimuth, colour) in _at_all_and_peaks(runs, at, "azimuth_rad").items():
        fraction = 100.0 * np.histogram(azimuth, edges)[0] / max(len(azimuth), 1)
        axes.stairs(fraction, edges, color=colour, fill=name == "all times",
                    alpha=0.45 if name == "all times" else 1.0, linewidth=1.4)  # fmt: skip
    axes.set_thetagrids(np.arange(0, 360, 90), ["ahead", "left", "behind", "right"], fontsize=7.5)
    axes.set_rlabel_position(157.5)
    axes.tick_params(axis="y", labelsize=7)
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_formatter("{x:.0f} %")


def _altitude(axes: Axes, runs: tuple[RunSeries, ...], at: int) -> None:
    found = _at_all_and_peaks(runs, at, "altitude_m")
    top = max((one.max(initial=0.01) for one, _ in found.values()), default=0.01) * 1e3
    edges = np.arange(0.0, top + 5.0, 5.0)
    for name, (height, colour) in found.items():
        fraction = 100.0 * np.histogram(height * 1e3, edges)[0] / max(len(height), 1)
        axes.stairs(fraction, edges, orientation="horizontal", color=colour,
                    fill=name == "all times", alpha=0.45 if name == "all times" else 1.0,
                    linewidth=1.4, label=f"{name} ({len(height)} frames)")  # fmt: skip
    axes.set(
        xlabel="share of frames in %", ylabel="mean height of the chain\nabove the floor in mm"
    )
    axes.set_title("altitude", fontsize=8.5)


def _survival(axes: Axes, lifetime: Found) -> None:
    survival = lifetime["survival"]
    axes.step([0.0, *survival["time_s"]], [1.0, *survival["fraction"]], where="post", color=BLUE)
    axes.set(xlabel="age in s", ylabel="share that lasts longer", yscale="log")
    median = lifetime["median_s"]
    words = "unknown" if median is None else f"{median * 1e3:.0f} ms"
    axes.set_title(
        f"life of a chain: median {words},\n{lifetime['lives']} lives, {lifetime['cut']} cut off",
        fontsize=8.5,
    )

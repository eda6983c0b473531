"""The figures of a calibration."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.calibration.fit import Calibration
from dragchain.calibration.force_record import Record
from dragchain.calibration.results import PURPOSES, CalibrationFile
from dragchain.calibration.simulated_drops import DropRun, Drops
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH_IN


def draw_impacts(record: Record, found: Calibration, confirm: Drops) -> Figure:
    """The record, and each impact measured and simulated."""
    measured, time = found.measured, record.time_s
    force = record.force_n - measured.baseline(time, float(time[0]))
    figure = Figure(figsize=(WIDTH_IN, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, len(measured.impacts), height_ratios=(1, 1.35))
    _whole(figure.add_subplot(grid[0, :]), time, force, found)
    drops = confirm.select("reference")[0], confirm.select("confirm")[0]
    first: Axes | None = None
    for place, (impact, sampling) in enumerate(zip(measured.impacts, found.samplings, strict=True)):
        axes = figure.add_subplot(grid[1, place], sharey=first)
        first = first or axes
        centre = impact.centroid_s - sampling.time_bias_s
        _one_impact(axes, time - centre, force, place, drops)
        axes.set_title(f"impact {impact.impact}: {impact.samples} samples", fontsize=8.5)
        axes.tick_params(labelleft=place == 0)
    assert first is not None
    first.set_ylabel("force (N)")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return figure


def _whole(axes: Axes, time: Floats, force: Floats, found: Calibration) -> None:
    axes.plot((time - time[0]) * 1e3, force, color=BLUE, linewidth=0.7)
    for impact in found.measured.impacts:
        at = (impact.peak_time_s - time[0]) * 1e3
        label = f"{impact.impact}"
        axes.annotate(label, (at, impact.peak_n), (5, -3), textcoords="offset points", color=RED)
        axes.plot(at, impact.peak_n, "v", color=RED, markersize=4)
    axes.set(xlabel="time (ms)", ylabel="force (N)")
    axes.set_title(
        f"{1e-3 / found.measured.interval_s:.0f} kHz, noise {found.measured.noise_n:.3g} N, "
        f"offset {found.measured.offset_n:.3g} N and drift {found.measured.drift_n_per_s:.2g} N/s "
        "removed"
    )


def _one_impact(
    axes: Axes, since: Floats, force: Floats, impact: int, drops: tuple[DropRun, DropRun]
) -> None:
    widest = 0.0
    names = ("simulated, physical modulus", "simulated, production settings")
    for drop, style, colour, name in zip(drops, "-:", (RED, GREY), names, strict=True):
        shape = drop.impacts[impact]
        time = shape.time_s - shape.centroid_s
        axes.plot(time * 1e6, shape.force_n, style, color=colour, label=name, zorder=1)
        widest = max(widest, float(np.abs(time).max()))
    near = np.abs(since) < widest
    axes.plot(since[near] * 1e6, force[near], "o", color=BLUE, ms=3, label="measured", zorder=2)
    axes.set(xlabel="time (µs)")


def draw_fit(found: Calibration) -> Figure:
    """Misfit over the deck's restitution, and the residuals."""
    figure = Figure(figsize=(WIDTH_IN, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    _misfit(left, found)
    _residuals(right, found)
    return figure


def _misfit(axes: Axes, found: Calibration) -> None:
    fit, model = found.fit, found.sweep.production
    best, low, high = fit.restitution, fit.ci95_low, fit.ci95_high
    half = max(high - best, best - low)
    ends = max(best - 2.2 * half, model.low), min(best + 2.2 * half, model.high)
    values = np.linspace(*ends, 201)
    axes.plot(values, [found.misfit(value) - fit.chi2 for value in values], color=BLUE)
    axes.axhline(fit.rise, color=GREY, linestyle="--", linewidth=0.9)
    axes.axvspan(low, high, color=BLUE, alpha=0.12, linewidth=0)
    axes.axvline(best, color=RED)
    axes.set(xlabel="input restitution", ylabel="misfit minus its minimum")
    axes.set(ylim=(0, 3 * fit.rise), title=f"{best:.4f} (95 % CI {low:.4f} to {high:.4f})")


def _residuals(axes: Axes, found: Calibration) -> None:
    fit = found.fit
    names = [f"time of impact {k + 2}" for k in range(len(found.observed.times_s))]
    names += [f"peak {k + 2} / peak 1" for k in range(len(found.observed.log_peaks))]
    place = np.arange(len(names))
    axes.barh(place, fit.residuals, color=GREEN, height=0.5)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(place, names)
    limit = max(2.5, 1.1 * float(np.abs(fit.residuals).max()))
    axes.set(xlabel="measured minus simulated\n(standard uncertainties)", xlim=(-limit, limit))
    axes.invert_yaxis()
    p_value = "no test possible" if fit.p_value is None else f"p = {fit.p_value:.2g}"
    axes.set_title(f"chi² {fit.chi2:.2g}, {fit.degrees} degrees of freedom, {p_value}")


def draw_bias(bias: pd.DataFrame, result: CalibrationFile) -> Figure:
    """Effective against deck restitution, and their difference."""
    figure = Figure(figsize=(WIDTH_IN, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    for purpose, colour in zip(PURPOSES, (BLUE, ORANGE), strict=True):
        settings = result.settings[purpose]
        made = f"modulus x {settings.youngs_modulus_scale:g}"
        made += f", time step {settings.timestep_fraction:.0%}"
        for option, mark in ((True, "o-"), (False, "s--")):
            rows = bias[(bias["purpose"] == purpose) & (bias["limit_force"] == option)]
            deck, out = rows["restitution_deck"], rows["restitution_effective"]
            label = f"{made}, limitForce {'on' if option else 'off'}"
            left.plot(deck, out, mark, ms=3, color=colour, label=label)
            bars = np.clip([out - rows["lowest"], rows["highest"] - out], 0.0, None)
            right.errorbar(deck, out - deck, bars, fmt=mark, ms=3, color=colour, elinewidth=0.7)
    _measured_lines(left, result.measured.value, result.fit.restitution)
    right.axhline(0.0, color="black", linewidth=0.8)
    left.set(xlabel="input restitution", ylabel="effective restitution")
    right.set(xlabel="input restitution", ylabel="effective minus input restitution")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return figure


def _measured_lines(axes: Axes, rebound: float, deck: float) -> None:
    ends = axes.get_xlim()
    axes.plot(ends, ends, color="black", linewidth=0.6, zorder=0)
    axes.plot([ends[0], deck, deck], [rebound, rebound, ends[0]], ":", color=RED)
    for label, place in (
        (f"measured {rebound:.3f}", (ends[0], rebound)),
        (f"set {deck:.3f}", (deck, ends[0])),
    ):
        axes.annotate(label, place, (3, 3), textcoords="offset points", color=RED)
    axes.set(xlim=ends, ylim=ends)


def draw_trials(trials: pd.DataFrame) -> Figure:
    """Recovered less known value with its interval, trial by trial."""
    shown = trials[trials["refused"].isna()].reset_index(drop=True)
    figure = Figure(figsize=(WIDTH_IN, 3.0), layout="constrained")
    panels = (("deck", "input value"), ("effective", "rebound, production settings"))
    for axes, (name, title) in zip(figure.subplots(1, 2), panels, strict=True):
        error, low, high = (
            (shown[f"{name}{end}"] - shown[f"{name}_known"]).to_numpy(np.float64)
            for end in ("", "_ci95_low", "_ci95_high")
        )
        held = shown[f"{name}_held"].to_numpy(bool)
        place = np.arange(1, len(shown) + 1)
        for mask, colour in ((held, BLUE), (~held, RED)):
            axes.errorbar(
                place[mask],
                error[mask],
                [(error - low)[mask], (high - error)[mask]],
                fmt="o",
                ms=3,
                color=colour,
                capsize=2,
            )
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set(xlabel="trial", ylabel="recovered minus true")
        axes.set_title(f"{title}: {int(held.sum())} of {len(trials)} within CI")
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2))
    return figure

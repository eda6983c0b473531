"""The report on a calibration: figures and one self-contained page."""

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.calibration.fit import RecordFit, calibrate_file
from dragchain.calibration.force_record import Record, read_record
from dragchain.calibration.results import PURPOSES, CalibrationFile, confirmed
from dragchain.calibration.simulated_drops import DropRun, Drops, read_drops
from dragchain.errors import TableError
from dragchain.figures.panels import legend_below, new_figure, new_panels, row_names
from dragchain.figures.style import BLUE, COLOURS, GREEN, GREY, ORANGE, RED
from dragchain.report.campaign import write_report

# --- figures -------------------------------------------------------------------------------------


def draw_impacts(record: Record, found: RecordFit, confirm: Drops) -> Figure:
    """The record, and each impact measured and simulated."""
    measured, time = found.measured, record.time_s
    force = record.force_n - measured.baseline(time, float(time[0]))
    figure = new_figure(5.2)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1, 1.35))
    _whole(parts[0].subplots(), time, force, found)
    drops = confirm.select("reference")[0], confirm.select("confirm")[0]
    panels = parts[1].subplots(1, len(measured.impacts), sharey=True, squeeze=False)[0]
    for place, axes in enumerate(panels):
        impact, sampling = measured.impacts[place], found.samplings[place]
        centre = impact.centroid_s - sampling.time_bias_s
        _one_impact(axes, time - centre, force, place, drops)
        axes.set_title(f"impact {impact.impact}: {impact.samples} samples")
    panels[0].set_ylabel("force (N)")
    return legend_below(figure)


def _whole(axes: Axes, time: Floats, force: Floats, found: RecordFit) -> None:
    measured = found.measured
    axes.plot((time - time[0]) * 1e3, force, color=COLOURS["experiment"], linewidth=0.7)
    for impact in measured.impacts:
        place = (impact.peak_time_s - time[0]) * 1e3, impact.peak_n
        axes.annotate(
            str(impact.impact), place, (5, -3), textcoords="offset points", color=COLOURS["peak"]
        )
        axes.plot(*place, "v", color=COLOURS["peak"])
    axes.set(xlabel="time (ms)", ylabel="force (N)")
    axes.set_title(
        f"{1e-3 / measured.interval_s:.0f} kHz, noise {measured.noise_n:.3g} N, offset "
        f"{measured.offset_n:.3g} N and drift {measured.drift_n_per_s:.2g} N/s removed"
    )


def _one_impact(
    axes: Axes, since: Floats, force: Floats, impact: int, drops: tuple[DropRun, DropRun]
) -> None:
    widest = 0.0
    names = ("simulated, physical modulus", "simulated, production settings")
    for drop, style, colour, name in zip(drops, "-:", (BLUE, GREY), names, strict=True):
        shape = drop.impacts[impact]
        time = shape.time_s - shape.centroid_s
        axes.plot(time * 1e6, shape.force_n, style, color=colour, label=name, zorder=1)
        widest = max(widest, float(np.abs(time).max()))
    near = np.abs(since) < widest
    axes.plot(
        since[near] * 1e6,
        force[near],
        "o",
        color=COLOURS["experiment"],
        ms=3,
        label="measured",
        zorder=2,
    )
    axes.set(xlabel="time (µs)")


def draw_fit(found: RecordFit) -> Figure:
    """Misfit over the deck's restitution, and the residuals."""
    figure, (left, right) = new_panels(3.0, 2, width_ratios=(1.4, 1))
    _misfit(left, found)
    _residuals(right, found)
    return figure


def _misfit(axes: Axes, found: RecordFit) -> None:
    fit, model = found.fit, found.sweep.production
    best, low, high = fit.restitution, fit.ci95_low, fit.ci95_high
    half = 2.2 * max(high - best, best - low)
    values = np.linspace(max(best - half, model.low), min(best + half, model.high), 201)
    axes.plot(values, [found.misfit(value) - fit.chi2 for value in values], color=BLUE)
    axes.axhline(found.rise, color=GREY, linestyle="--", linewidth=0.9)
    axes.axvspan(low, high, color=BLUE, alpha=0.12, linewidth=0)
    axes.axvline(best, color=RED)
    axes.set(xlabel="input restitution", ylabel="misfit minus its minimum")
    axes.set(ylim=(0, 3 * found.rise), title=f"{best:.4f} (95 % CI {low:.4f} to {high:.4f})")


def _residuals(axes: Axes, found: RecordFit) -> None:
    fit = found.fit
    names = [f"time of impact {k + 2}" for k in range(len(found.observed.times_s))]
    names += [f"peak {k + 2} / peak 1" for k in range(len(found.observed.log_peaks))]
    axes.barh(range(len(names)), fit.residuals, color=GREEN, height=0.5)
    axes.axvline(0.0, color="black", linewidth=0.8)
    row_names(axes, names)
    limit = max(2.5, 1.1 * float(np.abs(fit.residuals).max()))
    axes.set(xlabel="measured minus simulated\n(standard uncertainties)", xlim=(-limit, limit))
    p_value = "no test possible" if fit.p_value is None else f"p = {fit.p_value:.2g}"
    axes.set_title(f"chi² {fit.chi2:.2g}, {fit.degrees} degrees of freedom, {p_value}")


def draw_bias(bias: pd.DataFrame, result: CalibrationFile) -> Figure:
    """Effective against deck restitution, and their difference."""
    figure, (left, right) = new_panels(3.9, 2)
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
    return legend_below(figure)


def _measured_lines(axes: Axes, rebound: float, deck: float) -> None:
    ends = axes.get_xlim()
    axes.plot(ends, ends, color="black", linewidth=0.6, zorder=0)
    axes.plot([ends[0], deck, deck], [rebound, rebound, ends[0]], ":", color=COLOURS["experiment"])
    labels = {f"measured {rebound:.3f}": (ends[0], rebound), f"set {deck:.3f}": (deck, ends[0])}
    for label, place in labels.items():
        axes.annotate(label, place, (3, 3), textcoords="offset points", color=COLOURS["experiment"])
    axes.set(xlim=ends, ylim=ends)


# --- report --------------------------------------------------------------------------------------


def write_calibration_report(record: Path, folder: Path) -> None:
    """Draw the figures and write ``report.html`` of a calibration.

    Parameters
    ----------
    record : Path
        The CSV.
    folder : Path
        With ``result.json``, ``impacts.csv``, ``bias.csv``, ``sweep/drops.json`` and
        ``confirm/drops.json``.

    Raises
    ------
    DragdeckError
        A file is missing, or the record cannot be used.
    """
    result = CalibrationFile.read(folder / "result.json")
    sweep, confirm = (read_drops(folder / name / "drops.json") for name in ("sweep", "confirm"))
    found = calibrate_file(record, sweep)
    impacts, bias = (_csv(folder / f"{name}.csv") for name in ("impacts", "bias"))
    write_report(
        folder,
        "calibration/calibration.html.j2",
        draw=lambda: {
            "impacts": draw_impacts(read_record(record), found, confirm),
            "fit": draw_fit(found),
            "bias": draw_bias(bias, result),
        },
        result=result,
        impacts=impacts.to_dict("records"),
        bias=_by_deck_value(bias),
        confirm=confirmed(confirm),
    )


def _csv(file: Path) -> pd.DataFrame:
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `snakemake calibrate`")
    return pd.read_csv(file)


def _by_deck_value(bias: pd.DataFrame) -> Sequence[Mapping[Hashable, object]]:
    """Effective restitution, one row per deck value, one key per purpose and contact option."""
    setting = bias["purpose"] + bias["limit_force"].map({True: "_on", False: "_off"})
    wide = bias.assign(setting=setting).pivot(
        index="restitution_deck", columns="setting", values="restitution_effective"
    )
    return wide.astype(object).where(wide.notna(), None).reset_index().to_dict("records")

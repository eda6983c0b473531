"""The report on a calibration: figures and one self-contained page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import chi2

from dragchain.arrays import Floats
from dragchain.calibration.fit import CONFIDENCE, Calibration
from dragchain.calibration.force_record import read_record
from dragchain.calibration.results import calibrate_file, confirmed, full_drop
from dragchain.calibration.simulated_drops import DropRun, Drops, read_drops
from dragchain.errors import TableError
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, STYLE, png
from dragchain.report.page import data_uri, render_page

WIDTH_IN = 7.6

CAPTIONS = {
    "impacts": "Above: the record, its offset and drift taken away, with the impacts found. "
    "Below: each impact, measured samples against the simulated force. Solid: a drop at full "
    "modulus that rebounds as the measured particle. Dotted: the production drop, whose "
    "soft particle "
    "stays longer and pushes less; its rebound is what is fitted, not its peak. The simulated "
    "impacts are laid on the measured ones by their mean time.",
    "fit": "Misfit by the deck's restitution, with the best drop height for each; the interval is "
    "where it has risen by the marked amount. Right: what is left of each compared quantity.",
    "bias": "Effective restitution (speed after over speed before) by the deck's. The distance "
    "from the diagonal is the bias of modulus, step and limitForce. A bar runs from the lowest "
    "to the highest single impact; it shows what the phase of the contact within a time step does.",
    "trials": "Records of simulated drops with a known answer: recovered less known value, with "
    "the stated interval. Left: the deck value, by the drops at full modulus. Right: the rebound "
    "of the production drop at the recovered deck value.",
}


def write_report(record: Path, folder: Path) -> Path:
    """Draw the figures and write ``report.html`` of a calibration.

    Parameters
    ----------
    record : Path
        The CSV.
    folder : Path
        With ``result.json``, ``impacts.csv``, ``bias.csv``, ``trials.json``,
        ``trials.csv``, ``sweep/drops.json`` and ``confirm/drops.json``.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    DragchainError
        A file is missing, or the record cannot be used.
    """
    result = _json(folder / "result.json")
    sweep, confirm = (read_drops(folder / name / "drops.json") for name in ("sweep", "confirm"))
    found = calibrate_file(record, sweep)
    tables = {name: _csv(folder / f"{name}.csv") for name in ("impacts", "bias", "trials")}
    with matplotlib.rc_context(STYLE):
        figures = {
            "impacts": draw_impacts(record, found, confirm),
            "fit": draw_fit(found),
            "bias": draw_bias(tables["bias"], result),
            "trials": draw_trials(tables["trials"]),
        }
        pictures = {name: png(figure) for name, figure in figures.items()}
    (folder / "figures").mkdir(exist_ok=True)
    for name, picture in pictures.items():
        (folder / "figures" / f"{name}.png").write_bytes(picture)
    page = folder / "report.html"
    draft = page.with_name(page.name + ".part")
    text = render(
        result,
        {name: table.to_dict("records") for name, table in tables.items()},
        confirmed(confirm),
        _json(folder / "trials.json"),
        {name: data_uri(picture) for name, picture in pictures.items()},
    )
    draft.write_text(text, encoding="utf-8")
    draft.replace(page)
    return page


def _json(file: Path) -> dict[str, Any]:
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `snakemake calibrate`")
    content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return content


def _csv(file: Path) -> pd.DataFrame:
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `snakemake calibrate`")
    return pd.read_csv(file)


def render(
    result: Mapping[str, Any],
    tables: Mapping[str, Any],
    confirm: Mapping[str, Any],
    trials: Mapping[str, Any],
    pictures: Mapping[str, str],
) -> str:
    """The page: HTML that needs no other file and no network."""
    return render_page(
        "calibration/calibration.html.j2",
        result=result,
        tables=tables,
        bias=_bias_table(tables["bias"]),
        confirm=confirm,
        trials=trials,
        pictures=pictures,
        captions=CAPTIONS,
    )


def _bias_table(rows: list[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row a deck value, one column a purpose and contact option."""
    found: dict[float, dict[str, Any]] = {}
    for row in rows:
        key = f"{row['purpose']}_{'limited' if row['limit_force'] else 'free'}"
        at = found.setdefault(row["restitution_deck"], {"deck": row["restitution_deck"]})
        at[key] = row["restitution_effective"]
    return [found[value] for value in sorted(found)]


# --- figures ---------------------------------------------------------------------------------


def draw_impacts(record: Path, found: Calibration, confirm: Drops) -> Figure:
    """The record, and each impact measured and simulated."""
    raw = read_record(record)
    force = raw.force_n - found.measured.baseline(raw.time_s, float(raw.time_s[0]))
    figure = Figure(figsize=(WIDTH_IN, 5.2), layout="constrained")
    count = len(found.measured.impacts)
    grid = figure.add_gridspec(2, count, height_ratios=(1, 1.35))
    whole = figure.add_subplot(grid[0, :])
    _whole(whole, raw.time_s, force, found)
    production = confirm.select("confirm")[0]
    first: Axes | None = None
    for number_, impact in enumerate(found.measured.impacts):
        axes = figure.add_subplot(grid[1, number_], sharey=first)
        first = first or axes
        centre = impact.centroid_s - found.samplings[number_].time_bias_s
        _one_impact(axes, raw.time_s - centre, force, number_, (full_drop(confirm), production))
        axes.set_title(f"impact {number_ + 1}: {impact.samples} samples", fontsize=8.5)
        if number_:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("force in N")
    assert first is not None
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=3)
    return figure


def _whole(axes: Axes, time: Floats, force: Floats, found: Calibration) -> None:
    axes.plot((time - time[0]) * 1e3, force, color=BLUE, linewidth=0.7)
    for number_, impact in enumerate(found.measured.impacts, start=1):
        at = (impact.peak_time_s - time[0]) * 1e3
        axes.annotate(
            f"{number_}", (at, impact.peak_n), (5, -3), textcoords="offset points", color=RED
        )
        axes.plot(at, impact.peak_n, "v", color=RED, markersize=4)
    axes.set(xlabel="time in ms", ylabel="force in N")
    axes.set_title(
        f"{1e-3 / found.measured.interval_s:.0f} kHz, noise {found.measured.noise_n:.3g} N, "
        f"offset {found.measured.offset_n:.3g} N and drift {found.measured.drift_n_per_s:.2g} N/s "
        "taken away"
    )


def _one_impact(
    axes: Axes, since: Floats, force: Floats, impact: int, drops: tuple[DropRun, DropRun]
) -> None:
    widest = 0.0
    names = ("simulated, full modulus", "simulated, production")
    for drop, style, colour, name in zip(drops, "-:", (RED, GREY), names, strict=True):
        shape = drop.impacts[impact]
        time = shape.time_s - shape.centroid_s
        axes.plot(time * 1e6, shape.force_n, style, color=colour, label=name, zorder=1)
        widest = max(widest, float(np.abs(time).max()))
    near = np.abs(since) < widest
    axes.plot(since[near] * 1e6, force[near], "o", color=BLUE, ms=3, label="measured", zorder=2)
    axes.set(xlabel="time in µs")


def draw_fit(found: Calibration) -> Figure:
    """Misfit over the deck's restitution, and the residuals."""
    fit = found.fit
    figure = Figure(figsize=(WIDTH_IN, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    half = max(fit.high - fit.restitution, fit.restitution - fit.low)
    values = np.linspace(
        max(fit.restitution - 2.2 * half, found.production.low),
        min(fit.restitution + 2.2 * half, found.production.high),
        201,
    )
    rise = float(chi2.ppf(CONFIDENCE, 1)) * fit.inflation**2
    left.plot(values, [found.misfit(value) - fit.chi2 for value in values], color=BLUE)
    left.axhline(rise, color=GREY, linestyle="--", linewidth=0.9)
    left.axvspan(fit.low, fit.high, color=BLUE, alpha=0.12, linewidth=0)
    left.axvline(fit.restitution, color=RED)
    left.set(xlabel="restitution in the deck", ylabel="misfit above its least", ylim=(0, 3 * rise))
    left.set_title(f"{fit.restitution:.4f} (95 %: {fit.low:.4f} to {fit.high:.4f})")
    names = [f"time of impact {k + 2}" for k in range(len(found.observed.times_s))]
    names += [f"peak {k + 2} over peak 1" for k in range(len(found.observed.log_peaks))]
    place = np.arange(len(names))
    right.barh(place, fit.residuals, color=GREEN, height=0.5)
    right.axvline(0.0, color="black", linewidth=0.8)
    right.set_yticks(place, names)
    limit = max(2.5, 1.1 * float(np.abs(fit.residuals).max()))
    right.set(xlabel="measured less simulated,\nin standard uncertainties", xlim=(-limit, limit))
    right.invert_yaxis()
    p_value = "no test possible" if fit.p_value is None else f"p = {fit.p_value:.2g}"
    right.set_title(f"chi² {fit.chi2:.2g}, {fit.degrees} degrees, {p_value}")
    return figure


def draw_bias(bias: pd.DataFrame, result: Mapping[str, Any]) -> Figure:
    """Effective against deck restitution, and their difference."""
    figure = Figure(figsize=(WIDTH_IN, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    settings = result["settings"]
    for purpose, colour in (("production", BLUE), ("reference", ORANGE)):
        step = settings[purpose]["timestep_fraction"]
        scale = settings[purpose]["youngs_modulus_scale"]
        for option, mark in ((True, "o-"), (False, "s--")):
            rows = bias[(bias["purpose"] == purpose) & (bias["limit_force"] == option)]
            deck, out = (
                rows[name].to_numpy() for name in ("restitution_deck", "restitution_effective")
            )
            label = (
                f"modulus times {scale:g}, step {step:.0%}, limitForce {'on' if option else 'off'}"
            )
            left.plot(deck, out, mark, ms=3, color=colour, label=label)
            low, high = (rows[name].to_numpy() for name in ("lowest", "highest"))
            bars = np.clip([out - low, high - out], 0.0, None)
            right.errorbar(deck, out - deck, bars, fmt=mark, ms=3, color=colour, elinewidth=0.7)
    _measured_lines(left, result)
    right.axhline(0.0, color="black", linewidth=0.8)
    left.set(xlabel="restitution in the deck", ylabel="effective restitution")
    right.set(xlabel="restitution in the deck", ylabel="effective less deck")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2)
    return figure


def _measured_lines(axes: Axes, result: Mapping[str, Any]) -> None:
    ends = axes.get_xlim()
    axes.plot(ends, ends, color="black", linewidth=0.6, zorder=0)
    rebound, deck = result["measured"]["value"], result["fit"]["restitution"]
    axes.plot([ends[0], deck, deck], [rebound, rebound, ends[0]], ":", color=RED)
    axes.annotate(
        f"measured {rebound:.3f}", (ends[0], rebound), (3, 3), textcoords="offset points", color=RED
    )
    axes.annotate(f"put {deck:.3f}", (deck, ends[0]), (3, 3), textcoords="offset points", color=RED)
    axes.set(xlim=ends, ylim=ends)


def draw_trials(trials: pd.DataFrame) -> Figure:
    """Recovered less known value with its interval, trial by trial."""
    shown = trials[trials["refused"].isna()].reset_index(drop=True)
    figure = Figure(figsize=(WIDTH_IN, 3.0), layout="constrained")
    panels = (("deck", "deck value, full modulus"), ("effective", "rebound, production"))
    for axes, (name, title) in zip(figure.subplots(1, 2), panels, strict=True):
        error, low, high = (
            (shown[f"{name}{end}"] - shown[f"{name}_known"]).to_numpy(np.float64)
            for end in ("", "_low", "_high")
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
        axes.set(xlabel="trial", ylabel="recovered less known")
        axes.set_title(f"{title}: {int(held.sum())} of {len(trials)} held")
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2))
    return figure

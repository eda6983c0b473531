"""The report on a calibration: a figure and one self-contained page."""

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.calibration.fit import RecordFit, calibrate_file
from dragchain.calibration.results import bias_table, confirmed, impact_table, result
from dragchain.calibration.simulated_drops import DropRun, Drops, read_drops
from dragchain.figures.panels import legend_below, new_figure
from dragchain.figures.style import BLUE, COLOURS, GREY
from dragchain.report.campaign import write_report
from dragdeck.study.force_record import Record, read_record

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
        impact = measured.impacts[place]
        centre = impact.centroid_s - found.sampling.time_bias_s[place]
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


# --- report --------------------------------------------------------------------------------------


def write_calibration_report(record: Path, folder: Path) -> None:
    """Draw the figure and write ``report.html`` of a calibration.

    Parameters
    ----------
    record : Path
        The CSV.
    folder : Path
        With ``sweep/drops.json`` and ``confirm/drops.json``.

    Raises
    ------
    DragdeckError
        A file is missing, or the record cannot be used.
    """
    sweep, confirm = (read_drops(folder / name / "drops.json") for name in ("sweep", "confirm"))
    found = calibrate_file(record, sweep)
    observed = found.observed
    names = [f"time of impact {k + 2}" for k in range(len(observed.times_s))]
    names += [f"peak {k + 2} / peak 1" for k in range(len(observed.log_peaks))]
    write_report(
        folder,
        "calibration/calibration.html.j2",
        draw=lambda: {"impacts": draw_impacts(read_record(record), found, confirm)},
        result=result(found),
        impacts=impact_table(found).to_dict("records"),
        residuals=list(zip(names, found.fit.residuals, strict=True)),
        bias=_by_deck_value(bias_table(sweep)),
        confirm=confirmed(confirm),
    )


def _by_deck_value(bias: pd.DataFrame) -> Sequence[Mapping[Hashable, object]]:
    """Effective restitution, one row per deck value, one key per purpose and contact option."""
    setting = bias["purpose"] + bias["limit_force"].map({True: "_on", False: "_off"})
    wide = bias.assign(setting=setting).pivot(
        index="restitution_deck", columns="setting", values="restitution_effective"
    )
    return wide.astype(object).where(wide.notna(), None).reset_index().to_dict("records")

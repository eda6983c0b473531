"""The command that calibrates a study: runs, fits, figures and one self-contained page."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.calibration.angle_runs import run_angles
from dragchain.calibration.angles import read_angle
from dragchain.calibration.drops import Drop, confirmation, sweep
from dragchain.calibration.fit import RecordFit, calibrate
from dragchain.calibration.friction import FrictionFile, Posterior, angle_models, find_friction
from dragchain.calibration.measured_impacts import measure_impacts
from dragchain.calibration.results import (
    CalibrationFile,
    bias_table,
    confirmed,
    impact_table,
    result,
)
from dragchain.calibration.simulated_drops import DropRun, Drops, run_drops
from dragchain.figures.panels import key, legend_below, new_figure, new_panels
from dragchain.figures.style import BLUE, COLOURS, GREY, LIGHT, ORANGE
from dragchain.report.campaign import write_report
from dragchain.report.page import remove_earlier
from dragdeck.cases.case import Case
from dragdeck.documents import Document
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.physics.contact_mechanics import fall_time
from dragdeck.project import find_project
from dragdeck.study.calibration import measurements
from dragdeck.study.force_record import Record, read_record
from dragdeck.study.recorded import recorded_file

# --- figures -------------------------------------------------------------------------------------


def draw_impacts(record: Record, fit: RecordFit, confirm: Drops) -> Figure:
    """The record, and each impact measured and simulated."""
    measured, time = fit.measured, record.time_s
    force = record.force_n - measured.baseline(time, float(time[0]))
    figure = new_figure(5.2)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1, 1.35))
    _whole(parts[0].subplots(), time, force, fit)
    drops = confirm.select("reference")[0], confirm.select("confirm")[0]
    panels = parts[1].subplots(1, len(measured.impacts), sharey=True, squeeze=False)[0]
    for place, axes in enumerate(panels):
        impact = measured.impacts[place]
        centre = impact.centroid_s - fit.sampling.time_bias_s[place]
        _one_impact(axes, time - centre, force, place, drops)
        axes.set_title(f"impact {impact.impact}: {impact.samples} samples")
    panels[0].set_ylabel("force (N)")
    return legend_below(figure)


def _whole(axes: Axes, time: Floats, force: Floats, fit: RecordFit) -> None:
    measured = fit.measured
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


_RIGS: Mapping[str, tuple[str, str]] = {
    "repose": ("angle of repose", BLUE),
    "drum": ("angle in the drum", ORANGE),
}


def draw_angles(friction: FrictionFile, runs: pd.DataFrame) -> Figure:
    """The joint probability of both coefficients, and the angles that were simulated."""
    models = angle_models(friction, runs)
    posterior = Posterior.of(models, friction.measured)
    figure, (joint, *others) = new_panels(3.2, 1 + len(models))
    x, y = posterior.axes
    weights = [*posterior.weights.values()][-1].T
    levels = np.sort(weights, axis=None)
    inside = np.interp([0.05, 0.5], np.cumsum(levels), levels)
    joint.contourf(x, y, weights, [*inside, np.inf], colors=[LIGHT, GREY])
    for axes, name in zip(others, models, strict=True):
        label, colour = _RIGS[name]
        joint.contour(x, y, posterior.misfit[name].T, [-1.0, 1.0], colors=colour, linestyles="-")
        key(joint, f"{label}, within one standard uncertainty", color=colour, ls="-", marker="")
        of_rig = runs[runs["rig"] == name]
        dots = axes.scatter(
            of_rig["friction"], of_rig["angle_deg"], c=of_rig["rolling_friction"], s=14
        )
        axes.axhline(friction.measured[name][0], color=colour)
        axes.set(xlabel="friction", ylabel=f"{label} (degrees)")
    figure.colorbar(dots, ax=others[-1], label="rolling friction")
    joint.plot(*friction.best, "k+")
    joint.set(
        xlabel="friction", ylabel="rolling friction", title="95 % and 50 % of the probability"
    )
    return legend_below(figure)


# --- report --------------------------------------------------------------------------------------


def calibrate_study(study: str, fidelity: str | None, out_dir: Path, cores: int) -> str:
    """Run what a study's measurements are compared with, fit them and write the report.

    Runs of the same inputs are not repeated; one that was interrupted is gone on with. A record
    that cannot be used is refused before any run.

    Returns
    -------
    str
        What to put into the study.

    Raises
    ------
    DragdeckError
        A measurement or a run cannot be used.
    """
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]
    templates = project.templates_of(case)
    measured = measurements(case.study.calibration, case.file)
    drops, angles, words = None, None, []
    if measured.record is not None:
        drops = calibrate_restitution(case, out_dir, templates)
        words.append(_put_restitution(result(drops.fit)))
    if measured.angles is not None:
        batch = Batch(out_dir / "angles", templates)
        known = run_angles(case, batch, say, cores)
        runs = pd.DataFrame([read_angle(batch.folder / name) for name in known.runs])
        angles = find_friction(known, runs), runs
        words.append(_put_friction(angles[0]))
    write_calibration_report(out_dir, drops, angles)
    return "\n".join(words)


@dataclass(frozen=True)
class FittedRecord:
    """The record of a drop test, its fit, and drops at the fitted value."""

    record: Record
    fit: RecordFit
    confirm: Drops


def calibrate_restitution(case: Case, folder: Path, templates: jinja2.Environment) -> FittedRecord:
    """Run the drops that a record is compared with, in ``sweep/`` and ``confirm/``, and fit it."""

    def simulated(name: str, drops: Iterable[Drop]) -> Drops:
        return run_drops(case, list(drops), Batch(folder / name, templates), say)

    study, name = case.study, measurements(case.study.calibration, case.file).record or ""
    record = read_record(recorded_file(name, case.file, "calibration.record"))
    fall_s = fall_time(study.drop_test.height_m, study.gravity_m_s2)
    measured = measure_impacts(record, fall_time_s=fall_s)
    fit = calibrate(measured, simulated("sweep", sweep(study)))
    values = fit.fit.restitution, fit.fit_reference.restitution
    return FittedRecord(record, fit, simulated("confirm", confirmation(study, *values)))


def _put_restitution(result: CalibrationFile) -> str:
    return (
        f"set pairs.{result.known.pair}.restitution: {result.put:g}\n"
        f"  95 % CI {result.fit.ci95_low:.4f} to {result.fit.ci95_high:.4f}\n"
        f"  effective restitution {result.effective:.4f}; measured {result.measured.value:.4f}"
    )


def _put_friction(result: FrictionFile) -> str:
    last, (friction, rolling) = [*result.found.values()][-1], result.best
    ends = [
        f"{coefficient.ci95_low:.3g} to {coefficient.ci95_high:.3g}"
        for coefficient in (last.friction, last.rolling_friction)
    ]
    return (
        f"set pairs.{result.pair}.friction: {friction:.3g}, rolling_friction: {rolling:.3g}\n"
        f"  95 % CI {ends[0]} and {ends[1]}, correlation {last.correlation:.2f}"
    )


def write_calibration_report(
    folder: Path, drops: FittedRecord | None, angles: tuple[FrictionFile, pd.DataFrame] | None
) -> None:
    """Write the documents, tables, figures and page of a calibration.

    Parameters
    ----------
    folder : Path
    drops : FittedRecord, optional
        Of a measured drop test.
    angles : (FrictionFile, DataFrame), optional
        What measured angles say, and the simulated ones.
    """
    documents, tables = dict[str, Document](), dict[str, pd.DataFrame]()
    if drops:
        documents["result"] = result(drops.fit)
        tables |= {"impacts": impact_table(drops.fit), "bias": bias_table(drops.fit.drops)}
    if angles:
        documents["angles"], tables["angles"] = angles

    def draw() -> Iterator[tuple[str, Figure]]:
        if drops:
            yield "impacts", draw_impacts(drops.record, drops.fit, drops.confirm)
        if angles:
            yield "angles", draw_angles(*angles)

    remove_earlier(folder, "result.json", "impacts.*", "bias.*", "angles.*")
    write_report(
        folder,
        "calibration/calibration.html.j2",
        draw=lambda: dict(draw()),
        tables=tables,
        documents=documents,
        friction=documents.get("angles"),
        result=documents.get("result"),
        drops=_of_drops(drops, tables) if drops else None,
    )


def _of_drops(drops: FittedRecord, tables: Mapping[str, pd.DataFrame]) -> Mapping[str, object]:
    """What the page shows of a drop test, beside its result."""
    observed = drops.fit.observed
    names = [f"time of impact {k + 2}" for k in range(len(observed.times_s))]
    names += [f"peak {k + 2} / peak 1" for k in range(len(observed.log_peaks))]
    bias = tables["bias"].pivot(
        index="restitution_deck", columns="purpose", values="restitution_effective"
    )
    return {
        "impacts": tables["impacts"].to_dict("records"),
        "residuals": list(zip(names, drops.fit.fit.residuals, strict=True)),
        "bias": bias.reset_index().to_dict("records"),
        "confirm": confirmed(drops.confirm),
    }

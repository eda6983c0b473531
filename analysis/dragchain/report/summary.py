"""The summary of a study's runs, one row per process run, and its main numbers in a few lines."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dragchain.errors import TableError
from dragchain.quantities.basis import Standing
from dragchain.report.cases import StudyRuns, cases_of
from dragchain.report.findings import ProcessFindings
from dragchain.report.values import Against
from dragchain.statistics.estimate import Estimate
from dragchain.tables.columns import quantity_column

Cell = str | int | float | bool | None
Row = dict[str, Cell]
"""Cells by column. Inputs and references make the columns, so they differ between studies."""


def summary(studies: Sequence[StudyRuns]) -> pd.DataFrame:
    """The summary table; a number that there is none of is NaN."""
    said = {
        study.process.case.run: f"{case.name}: {case.values.headline()}"
        for case in cases_of(studies)
        for study in case.studies
    }
    return pd.DataFrame([_summary_row(study, said[study.process.case.run]) for study in studies])


def _summary_row(study: StudyRuns, headline: str) -> Row:
    """The row of a process run."""
    values = study.values
    case, findings, record = study.process.case, study.process.findings, study.process.record
    return {
        "study": case.study_name,
        "case": case.case,
        "run": case.run,
        "headline": headline,
        "settings": " ".join(values.notes),
        "changed_scripts": "; ".join(case.changed_scripts),
        **{
            input_column(name): _cell(value) for name, value in study.process.study.inputs().items()
        },
        **{f"fidelity_{name}": value for name, value in vars(case.fidelity).items()},
        "timestep_s": case.timestep_s,
        "ranks": record.ranks,
        "steps_per_s": record.steps_per_s,
        "wall_time_s": record.wall_time_s,
        "engine_version": record.engine_version,
        **_comparisons(values.against),
        **_of_run(values.standings),
        **_asked(study),
        "peak_max_n": findings.peaks.largest_n,
        **_wake(findings),
        **_network(findings),
        **dict(findings.chains),
        **_upstream(study),
        **_corrected(values.standings),
    }


def input_column(name: str) -> str:
    """The summary's column of a dotted input name."""
    return "input_" + name.replace(".", "_")


def _cell(value: object) -> Cell:
    return value if isinstance(value, str | int | float | None) else json.dumps(value)


def _comparisons(comparisons: Sequence[Against]) -> Row:
    row: Row = {}
    for against in comparisons:
        row |= _interval(
            f"drag_against_{against.reference.label}", "percent", against.difference.over(0.01)
        )
    return row


def _interval(name: str, unit: str, estimate: Estimate) -> Row:
    """A value with the ends of its interval; `unit` ends the names of the columns."""
    ends = (estimate.value, estimate.ci95_low, estimate.ci95_high)
    names = (name, f"{name}_ci95_low", f"{name}_ci95_high")
    return {quantity_column(of, unit): end for of, end in zip(names, ends, strict=True)}


def _of_run(standings: Sequence[Standing]) -> Row:
    """The values of the run, in process time, and whether an interval is reliable."""
    row: Row = {}
    for standing in standings:
        name = standing.quantity.name
        row |= _interval(name, standing.quantity.unit, standing.run)
        row |= {f"{name}_reliable": standing.run.reliable}
    return row


def _corrected(standings: Sequence[Standing]) -> Row:
    """The values at the physical Young's modulus, from windows or from other scenes."""
    row: Row = {}
    for standing in standings:
        name, unit = standing.quantity.name, standing.quantity.unit
        if standing.corrected:
            row |= _interval(f"extrapolated_{name}", unit, standing.shown)
        if standing.estimated:
            row |= _interval(f"estimated_{name}", unit, standing.estimated)
    return row


def _asked(study: StudyRuns) -> Row:
    """What the settings were chosen for, their forecast cost, and what windows reached."""
    asked = study.process.case.asked
    reached = study.extrapolated.tolerance if study.extrapolated else None
    row: Row = {}
    if asked is not None:
        row |= {
            "asked_quantities": ", ".join(asked.quantities),
            "asked_tolerance": asked.tolerance,
            "forecast_cost": asked.relative_cost,
            "forecast_largest_cost": asked.largest_cost,
        }
    if reached is not None:
        row |= {"windows": len(reached.runs), "tolerance_reached": reached.reached}
    return row


def _wake(findings: ProcessFindings) -> Row:
    if findings.wake is None:
        return {}
    return {
        "drag_fresh_mean_n": findings.wake.fresh_n.mean,
        "drag_in_wake_mean_n": findings.wake.wake_n.mean,
        **_interval("drag_wake_ratio", "", findings.wake.ratio),
    }


def _network(findings: ProcessFindings) -> Row:
    return {
        "network_frames": findings.network_frames,
        "rattler_fraction": findings.rattler_fraction,
        "ahead_mean_n": findings.ahead_behind.ahead_n.value,
        "behind_mean_n": findings.ahead_behind.behind_n.value,
        **_interval("depth_slope", "N/m", findings.depth.slope_n_per_m),
    }


def _upstream(study: StudyRuns) -> Row:
    bed = study.filling.findings.bed if study.filling else {}
    ratio = study.drop_test.findings.restitution if study.drop_test else None
    return {
        "bed_height_m": bed.get("bed_height_m", math.nan),
        "solid_fraction": bed.get("solid_fraction", math.nan),
        "restitution_effective": ratio.mean if ratio else math.nan,
        "restitution_input": ratio.input if ratio else math.nan,
    }


# --- main numbers --------------------------------------------------------------------------------


_SHOWN = 10
"""Cases that are listed; all are in the summary."""


def main_numbers(report_dir: Path) -> str:
    """Where the report is, and the main numbers of each case as the report states them.

    Raises
    ------
    TableError
        There is no summary.
    """
    file = report_dir / "summary.parquet"
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `./run dragchain report` first")
    lines = pd.read_parquet(file, columns=["headline"])["headline"].drop_duplicates().tolist()
    more = f"  and {len(lines) - _SHOWN} more: {report_dir / 'summary.csv'}"
    shown = [f"  {line}" for line in lines[:_SHOWN]]
    head = f"report: {report_dir / 'report.html'}"
    return "\n".join([head, *shown, *([more] if len(lines) > _SHOWN else [])])

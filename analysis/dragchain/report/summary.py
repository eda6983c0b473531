"""The summary of a study's runs, one row per process run, and its main numbers in a few lines."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from dragchain.drag import FORCES
from dragchain.errors import TableError
from dragchain.quantities.basis import Standing
from dragchain.report.cases import StudyRuns, cases_of
from dragchain.report.findings import ProcessFindings
from dragchain.report.values import Against
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate

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
    case, found, record = study.process.case, study.process.findings, study.process.record
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
        **_forces(found.forces),
        **_comparisons(values.against),
        **_of_runs(values.standings),
        **_asked(study),
        "peak_max_n": found.peaks.largest_n,
        **_wake(found),
        **_network(found),
        **_chains(found),
        **_upstream(study),
        **_corrected(values.standings),
    }


def input_column(name: str) -> str:
    """The summary's column of a dotted input name."""
    return "input_" + name.replace(".", "_")


def _cell(value: object) -> Cell:
    return value if isinstance(value, str | int | float | None) else json.dumps(value)


def _forces(forces: Mapping[str, MeanEstimate]) -> Row:
    row: Row = {}
    for name in FORCES:
        direction, force = name.removesuffix("_n"), forces[name]
        row |= {
            f"{direction}_mean_n": force.mean,
            f"{direction}_std_n": force.std,
            f"{direction}_ci95_low_n": force.ci95_low,
            f"{direction}_ci95_high_n": force.ci95_high,
            f"{direction}_effective_samples": force.effective_samples,
            f"{direction}_reliable": force.reliable,
        }
    return row


def _comparisons(comparisons: Sequence[Against]) -> Row:
    row: Row = {}
    for one in comparisons:
        row |= _interval(
            f"drag_against_{one.reference.label}", "_percent", one.difference.over(0.01)
        )
    return row


def _interval(name: str, unit: str, found: Estimate) -> Row:
    """A value with the ends of its interval; `unit` ends the names of the columns."""
    ends = {"": found.value, "_ci95_low": found.ci95_low, "_ci95_high": found.ci95_high}
    return {f"{name}{end}{unit}": value for end, value in ends.items()}


_NAMED_OTHERWISE = {
    *("drag_mean", "drag_std", "lateral_mean", "vertical_mean", "ahead_behind"),
    *("coordination_number", "mechanical_coordination_number", "chain_count", "chain_length"),
    "path_bottleneck",
}
"""Quantities whose values of the run have columns from the findings."""


def _of_runs(standings: Sequence[Standing]) -> Row:
    """The values of the run, in process time."""
    row: Row = {}
    for one in standings:
        if one.quantity.name not in _NAMED_OTHERWISE:
            row |= _estimate(one.quantity.name, one.quantity.unit, one.run)
    return row


def _corrected(standings: Sequence[Standing]) -> Row:
    """The values at the physical Young's modulus, where windows give them."""
    row: Row = {}
    for one in standings:
        if one.corrected:
            row |= _estimate(f"extrapolated_{one.quantity.name}", one.quantity.unit, one.shown)
    return row


def _estimate(name: str, unit: str, found: Estimate) -> Row:
    """A value, with its interval if it has one."""
    end = "_" + unit.lower().replace("/", "_per_").replace(" ", "_") if unit else ""
    end = end.replace("_1_per", "_per")
    return _interval(name, end, found) if found.known else {f"{name}{end}": found.value}


def _asked(study: StudyRuns) -> Row:
    """What the settings were chosen for, their forecast cost, and what windows reached."""
    asked = study.process.case.asked
    found = study.extrapolated.tolerance if study.extrapolated else None
    row: Row = {}
    if asked is not None:
        row |= {
            "asked_quantities": ", ".join(asked.quantities),
            "asked_tolerance": asked.tolerance,
            "forecast_cost": asked.relative_cost,
            "forecast_largest_cost": asked.largest_cost,
        }
    if found is not None:
        row |= {"windows": len(found.runs), "tolerance_reached": found.reached}
    return row


def _wake(found: ProcessFindings) -> Row:
    if found.wake is None:
        return {}
    return {
        "drag_fresh_mean_n": found.wake.fresh_n.mean,
        "drag_in_wake_mean_n": found.wake.wake_n.mean,
        **_interval("drag_wake_ratio", "", found.wake.ratio),
    }


def _network(found: ProcessFindings) -> Row:
    network, sides, slope = found.network, found.ahead_behind, found.depth.slope_n_per_m
    return {
        "network_frames": network["frames"],
        "coordination_number": network["coordination_number"],
        "mechanical_coordination_number": network["mechanical_coordination_number"],
        "rattler_fraction": network["rattler_fraction"],
        "contact_normal_force_mean_n": network["normal_force_mean_n"],
        "workpiece_contacts_per_frame": network["n_particle_workpiece_contacts"],
        "ahead_mean_n": sides.ahead_n.value,
        "behind_mean_n": sides.behind_n.value,
        **_interval("ahead_behind_ratio", "", sides.ratio),
        **_interval("depth_slope", "_n_per_m", slope),
    }


_OF_CHAINS = (
    *("widest_paths_per_frame", "widest_paths_to_side_fraction", "dominant_bottleneck_mean_n"),
    *("dominant_bottleneck_max_n", "dominant_particles_mean", "dominant_altitude_mean_m"),
    "dominant_azimuth_mean_rad",
)


def _chains(found: ProcessFindings) -> Row:
    chains = found.chains
    return {
        "peters_chains_per_frame": chains.peters_per_frame,
        "peters_chain_particles_mean": chains.peters_particles_mean,
        **{name: getattr(chains, name) for name in _OF_CHAINS},
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

"""The summary of a study's runs, one row per process run, and its main numbers in a few lines."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from dragchain.errors import TableError
from dragchain.report.cases import StudyRuns, cases_of
from dragchain.report.findings import ProcessFindings
from dragchain.report.values import Against
from dragchain.run.basis import Standing
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
        "study": case.study,
        "case": case.case,
        "run": case.run,
        "headline": headline,
        "settings": " ".join(values.notes),
        **{input_column(name): _cell(value) for name, value in case.inputs.items()},
        **{f"fidelity_{name}": value for name, value in vars(case.fidelity).items()},
        "timestep_s": case.timestep_s,
        "ranks": record.ranks,
        "steps_per_s": record.steps_per_s,
        "wall_time_s": record.wall_time_s,
        "engine_version": record.engine_version,
        **_forces(found.forces),
        **_comparisons(values.against),
        **{key: cell for one in values.standings for key, cell in _of_run(one)},
        **_asked(study),
        "peak_max_n": found.peaks.largest_n,
        **_wake(found),
        **_network(found),
        **_chains(found),
        **_upstream(study),
        **{key: cell for one in values.standings if one.corrected for key, cell in _corrected(one)},
    }


def input_column(name: str) -> str:
    """The summary's column of a dotted input name."""
    return "input_" + name.replace(".", "_")


def _cell(value: object) -> Cell:
    return value if isinstance(value, str | int | float | None) else json.dumps(value)


def _forces(forces: Mapping[str, MeanEstimate]) -> Row:
    row: Row = {}
    for name, force in forces.items():
        direction = name.removesuffix("_n")
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
    for against in comparisons:
        name, percent = f"drag_against_{against.label}", against.difference.over(0.01)
        row[f"{name}_percent"] = percent.value
        row[f"{name}_ci95_low_percent"] = percent.ci95_low
        row[f"{name}_ci95_high_percent"] = percent.ci95_high
    return row


_NAMED_OTHERWISE = {
    *("drag_mean", "drag_std", "lateral_mean", "vertical_mean", "ahead_behind"),
    *("coordination_number", "mechanical_coordination_number", "chain_count", "chain_length"),
    "path_bottleneck",
}
"""Quantities whose values of the run have columns from the findings."""


def _of_run(one: Standing) -> Iterator[tuple[str, Cell]]:
    """The value of the run, in process time, with its interval if it has one."""
    if one.quantity.name not in _NAMED_OTHERWISE:
        yield from _estimate(one.quantity.name, one.quantity.unit, one.run)


def _corrected(one: Standing) -> Iterator[tuple[str, Cell]]:
    """The value at the physical Young's modulus."""
    yield from _estimate(f"extrapolated_{one.quantity.name}", one.quantity.unit, one.shown)


def _estimate(name: str, unit: str, found: Estimate) -> Iterator[tuple[str, Cell]]:
    end = "_" + unit.lower().replace("/", "_per_").replace(" ", "_") if unit else ""
    end = end.replace("_1_per", "_per")
    yield f"{name}{end}", found.value
    if found.known:
        yield f"{name}_ci95_low{end}", found.ci95_low
        yield f"{name}_ci95_high{end}", found.ci95_high


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
        "drag_wake_ratio": found.wake.ratio.value,
        "drag_wake_ratio_ci95_low": found.wake.ratio.ci95_low,
        "drag_wake_ratio_ci95_high": found.wake.ratio.ci95_high,
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
        "ahead_behind_ratio": sides.ratio.value,
        "ahead_behind_ratio_ci95_low": sides.ratio.ci95_low,
        "ahead_behind_ratio_ci95_high": sides.ratio.ci95_high,
        "depth_slope_n_per_m": slope.value,
        "depth_slope_ci95_low_n_per_m": slope.ci95_low,
        "depth_slope_ci95_high_n_per_m": slope.ci95_high,
    }


def _chains(found: ProcessFindings) -> Row:
    chains = found.chains
    return {
        "peters_chains_per_frame": chains.peters_per_frame,
        "peters_chain_particles_mean": chains.peters_particles_mean,
        "widest_paths_per_frame": chains.widest_paths_per_frame,
        "widest_paths_to_side_fraction": chains.widest_paths_to_side_fraction,
        "dominant_bottleneck_mean_n": chains.dominant_bottleneck_mean_n,
        "dominant_bottleneck_max_n": chains.dominant_bottleneck_max_n,
        "dominant_particles_mean": chains.dominant_particles_mean,
        "dominant_altitude_mean_m": chains.dominant_altitude_mean_m,
        "dominant_azimuth_mean_rad": chains.dominant_azimuth_mean_rad,
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
        raise TableError(f"{file}: there is no such file; run `dragchain report` first")
    lines = pd.read_parquet(file, columns=["headline"])["headline"].drop_duplicates().tolist()
    more = f"  and {len(lines) - _SHOWN} more: {report_dir / 'summary.csv'}"
    shown = [f"  {line}" for line in lines[:_SHOWN]]
    head = f"report: {report_dir / 'report.html'}"
    return "\n".join([head, *shown, *([more] if len(lines) > _SHOWN else [])])

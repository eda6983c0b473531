"""The summary of a study's runs: one row per process run, with what belongs to it."""

import json
import math
from collections.abc import Mapping, Sequence

import pandas as pd

from dragchain.report.findings import Comparison, ProcessFindings
from dragchain.report.runs import StudyRuns
from dragchain.statistics.correlated import MeanEstimate

Cell = str | int | float | bool | None
Row = dict[str, Cell]
"""Cells by column. Inputs and references make the columns, so they differ between studies."""


def summary(studies: Sequence[StudyRuns]) -> pd.DataFrame:
    """The summary table; a number that there is none of is NaN."""
    return pd.DataFrame([_summary_row(study) for study in studies])


def _summary_row(study: StudyRuns) -> Row:
    """The row of a process run."""
    case, found, record = study.process.case, study.process.findings, study.process.record
    return {
        "study": case.study,
        "case": case.case,
        "run": case.run,
        **{input_column(name): _cell(value) for name, value in case.inputs.items()},
        **{f"fidelity_{name}": value for name, value in vars(case.fidelity).items()},
        "timestep_s": case.timestep_s,
        "ranks": record.ranks,
        "steps_per_s": record.steps_per_s,
        "wall_time_s": record.wall_time_s,
        "engine_version": record.engine_version,
        **_forces(found.forces),
        **_comparisons(found.comparison),
        "peak_count": found.peaks.count,
        "peak_max_n": found.peaks.largest_n,
        **_wake(found),
        **_network(found),
        **_chains(found),
        **_upstream(study),
        **_extrapolated(study),
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


def _comparisons(comparisons: Sequence[Comparison]) -> Row:
    row: Row = {}
    for against in comparisons:
        name = f"drag_against_{against.label}"
        row[f"{name}_percent"] = against.difference_percent
        row[f"{name}_ci95_low_percent"] = against.ci95_low
        row[f"{name}_ci95_high_percent"] = against.ci95_high
    return row


def _extrapolated(study: StudyRuns) -> Row:
    row: Row = {}
    for found in study.extrapolated.quantities if study.extrapolated else ():
        unit = f"_{found.unit.lower().replace('/', '_per_')}" if found.unit else ""
        row[f"extrapolated_{found.name}{unit}"] = found.value
        row[f"extrapolated_{found.name}_ci95_low{unit}"] = found.ci95_low
        row[f"extrapolated_{found.name}_ci95_high{unit}"] = found.ci95_high
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

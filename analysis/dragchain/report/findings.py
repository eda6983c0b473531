"""Collect the findings of one run: what its figures show and what the report says of it.

The numbers are written to ``tables/figures.json``; figures and report read them there.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag.around import ahead_behind, azimuth_profile, depth_profile, depth_slope
from dragchain.drag.force import read_counted, summarise_forces
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.files import write_json
from dragchain.run.case import Case, Reference, load_case, load_outputs
from dragchain.run.kinematics import drag_start_s
from dragchain.run.reference import ReferenceDrag, reference_drags
from dragchain.statistics.association import association, near_any
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import CONFIDENCE, Estimate, estimate_columns, finite
from dragchain.tables.bed import Packing
from dragchain.tables.by_step import read_table
from dragchain.tables.impacts import effective_restitution

SCHEMA = 2
FILE = Path("tables") / "figures.json"

Findings = dict[str, Any]


def write_findings(run_dir: Path) -> Findings:
    """Compute the findings of a run, write them to ``tables/figures.json`` and return them.

    Raises
    ------
    TableError
        If a table that the run's scene has is missing.
    SeriesError
        If the run is too short for its statistics.
    """
    case = load_case(run_dir)
    collect = {"process": _process, "filling": _filling, "drop_test": _drop}[case.scene]
    findings = {"schema": SCHEMA, "scene": case.scene, "run": case.run} | collect(run_dir, case)
    write_json(run_dir / FILE, findings)
    return findings


def read_findings(run_dir: Path) -> Findings:
    """Read what `write_findings` wrote.

    Raises
    ------
    TableError
        If it is not there.
    """
    file = run_dir / FILE
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragchain figures` first")
    findings: Findings = json.loads(file.read_text(encoding="utf-8"))
    return findings


# --- process ---------------------------------------------------------------------------------


_CHAIN_COLUMNS = [
    *("step", "definition", "n_particles", "bottleneck_n", "azimuth_rad", "altitude_m"),
    *("reaches_bowl", "end_kind", "dominant"),
]


def _process(run_dir: Path, case: Case) -> Findings:
    samples = read_counted(run_dir, ("step", "time_s", "drag_n"))
    forces = summarise_forces(run_dir)
    network = read_table(run_dir / "tables" / "network.parquet")
    chains = read_table(run_dir / "tables" / "chains.parquet", _CHAIN_COLUMNS)
    peaks_s, peaks = _peaks(samples, case)
    return {
        "process_time_zero_s": drag_start_s(case),
        "forces": {name: mean_numbers(estimate) for name, estimate in forces.items()},
        "comparison": compare(forces["drag_n"], case.reference),
        "peaks": peaks,
        "network": _network(network),
        "chains": _chains(chains, len(network)),
        "association": _association(samples, network, chains, peaks_s),
        **_around_workpiece(run_dir, samples),
    }


def mean_numbers(estimate: MeanEstimate) -> Findings:
    """All that is known of a mean by name, None where a number is not finite."""
    known = asdict(estimate)
    return {name: finite(value) if name != "reliable" else value for name, value in known.items()}


def compare(ours: MeanEstimate, reference: Reference | None) -> list[Findings]:
    """Set the mean drag beside every reference figure, ``<label>_drag_mean_n``.

    Returns
    -------
    list of dict
        ``label``, ``mean_n``, ``std_n`` (None if not given), ``difference_percent`` (ours over the
        reference, less one) with ``low`` and ``high`` from the interval of our mean alone, and
        ``source``.
    """
    mean = Estimate(ours.mean, ours.ci95_low, ours.ci95_high)
    return [_against(mean, one) for one in reference_drags(reference)]


def _against(mean: Estimate, reference: ReferenceDrag) -> Findings:
    difference = reference.difference(mean)
    return {
        "label": reference.label,
        "mean_n": reference.mean_n,
        "std_n": reference.std_n,
        "difference_percent": 100.0 * difference.value,
        "ci95_low": 100.0 * difference.ci95_low,
        "ci95_high": 100.0 * difference.ci95_high,
        "source": reference.source,
    }


def _peaks(samples: pd.DataFrame, case: Case) -> tuple[Floats, Findings]:
    separation = peak_separation_s(case)
    peaks = find_drag_peaks(
        samples["time_s"].to_numpy(np.float64),
        samples["drag_n"].to_numpy(np.float64),
        min_separation_s=separation,
    )
    process_s = peaks.time_s - drag_start_s(case)
    return peaks.time_s, {
        "count": len(peaks.index),
        "process_time_s": process_s.tolist(),
        "drag_n": peaks.drag_n.tolist(),
        "largest_n": finite(peaks.drag_n.min(initial=np.inf)),
        "separation_s": separation,
    }


def _network(network: pd.DataFrame) -> Findings:
    means = network.drop(columns=["step", "time_s"]).mean()
    return {"frames": len(network)} | {str(key): finite(mean) for key, mean in means.items()}


def _chains(chains: pd.DataFrame, frames: int) -> Findings:
    peters = chains[chains["definition"] == "peters"]
    paths = chains[chains["definition"] == "widest_path"]
    dominant = paths[paths["dominant"]]
    whole = paths[paths["reaches_bowl"]]
    azimuth = np.exp(1j * dominant["azimuth_rad"].to_numpy(np.float64))
    return {
        "peters_per_frame": len(peters) / frames,
        "peters_particles_mean": finite(peters["n_particles"].mean()),
        "widest_paths_per_frame": len(whole) / frames,
        "workpiece_contacts_without_path_per_frame": (len(paths) - len(whole)) / frames,
        "widest_paths_to_side_fraction": finite((whole["end_kind"] == "side").mean()),
        "dominant_frames": len(dominant),
        "dominant_bottleneck_mean_n": finite(dominant["bottleneck_n"].mean()),
        "dominant_bottleneck_max_n": finite(dominant["bottleneck_n"].max()),
        "dominant_particles_mean": finite(dominant["n_particles"].mean()),
        "dominant_altitude_mean_m": finite(dominant["altitude_m"].mean()),
        "dominant_altitude_std_m": finite(dominant["altitude_m"].std()),
        "dominant_azimuth_mean_rad": finite(np.angle(azimuth.mean())) if len(azimuth) else None,
        "dominant_azimuth_resultant": finite(np.abs(azimuth.mean())) if len(azimuth) else None,
    }


def dominant_bottlenecks(network: pd.DataFrame, chains: pd.DataFrame) -> Floats:
    """The dominant workpiece path's bottleneck in each network frame in N, 0 without a path."""
    dominant = chains[chains["dominant"]].set_index("step")["bottleneck_n"]
    return dominant.reindex(network["step"]).fillna(0.0).to_numpy(np.float64)


def _association(
    samples: pd.DataFrame, network: pd.DataFrame, chains: pd.DataFrame, peaks_s: Floats
) -> Findings:
    bottleneck = dominant_bottlenecks(network, chains)
    time_s = network["time_s"].to_numpy(np.float64)
    resistance = -np.interp(
        time_s, samples["time_s"].to_numpy(np.float64), samples["drag_n"].to_numpy(np.float64)
    )
    found = association(resistance, bottleneck)
    reach_s = float(np.median(np.diff(time_s))) / 2.0 if len(time_s) > 1 else 0.0
    near = near_any(time_s, peaks_s, reach_s)
    return {
        "rank_correlation": finite(found.correlation),
        "p_value": finite(found.p_value),
        "frames": found.samples,
        "frames_at_peaks": int(near.sum()),
        "bottleneck_at_peaks_mean_n": finite(bottleneck[near].mean()) if near.any() else None,
        "bottleneck_elsewhere_mean_n": finite(bottleneck[~near].mean()) if any(~near) else None,
    }


def _around_workpiece(run_dir: Path, samples: pd.DataFrame) -> Findings:
    columns = ["step", "azimuth_rad", "depth_m", "normal_force_n", "in_statistics"]
    contacts = read_table(run_dir / "tables" / "workpiece_contacts.parquet", columns)
    contacts = contacts[contacts["in_statistics"]]
    frame, frames = _frame_numbers(run_dir, samples, contacts["step"].to_numpy(np.int64))
    azimuth = contacts["azimuth_rad"].to_numpy(np.float64)
    depth = contacts["depth_m"].to_numpy(np.float64)
    force = contacts["normal_force_n"].to_numpy(np.float64)
    edges, around = azimuth_profile(frame, frames, azimuth, force)
    levels, contact, line = depth_profile(frame, frames, depth, force)
    ratio = ahead_behind(frame, frames, azimuth, force)
    slope = depth_slope(frame, frames, depth, force)
    return {
        "confidence": CONFIDENCE,
        "workpiece_frames": frames,
        "ahead_behind": {name: estimate.as_json() for name, estimate in ratio.items()},
        "azimuth": {"edges_rad": edges.tolist(), "force_n": estimate_columns(around)},
        "depth": {
            "edges_m": levels.tolist(),
            "contact_n": estimate_columns(contact),
            "line_load_n_per_m": estimate_columns(line),
            "slope_n_per_m": slope.as_json(),
        },
    }


def _frame_numbers(run_dir: Path, samples: pd.DataFrame, steps: Ints) -> tuple[Ints, int]:
    """The frame of each step and the number of counted frames, those without contact too."""
    output = load_outputs(run_dir)["workpiece_contacts"]
    counted = samples["step"].to_numpy(np.int64)
    written = np.arange(output.first_step, counted[-1] + 1, output.period_steps)
    written = written[written >= counted[0]]
    return np.searchsorted(written, steps), len(written)


# --- fill and drop ---------------------------------------------------------------------------


def _filling(run_dir: Path, case: Case) -> Findings:
    bed = Packing.read(run_dir / "tables" / "packing.json").model_dump(exclude={"version"})
    settled = case.settled
    return {"bed": bed, "rest_energy_ratio": settled.energy_ratio if settled else None}


def _drop(run_dir: Path, case: Case) -> Findings:
    impacts = read_table(run_dir / "tables" / "impacts.parquet")
    names = ["start_time_s", "duration_s", "peak_force_n", "restitution", "time_since_first_s"]
    return {
        "restitution": asdict(effective_restitution(run_dir)) | {"input": case.restitution},
        "impacts": {name: impacts[name].tolist() for name in names},
    }

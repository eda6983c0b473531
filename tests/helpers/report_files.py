"""Shared by tests of several modules."""

import base64
import json
import math
from pathlib import Path
from typing import Any

from pages import Page
from run_files import OF_EVERY_RUN

from dragchain.report.findings import (
    FILE,
    AheadBehind,
    AzimuthProfile,
    Chains,
    Comparison,
    DepthProfile,
    DropFindings,
    DropImpacts,
    DropRestitution,
    FillingFindings,
    Findings,
    Peaks,
    ProcessFindings,
)
from dragchain.report.values import EXTRAPOLATED, Extrapolated, ExtrapolatedQuantity, Need, Reached
from dragchain.run.basis import QUANTITIES
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate, EstimateColumns

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
PICTURES = [
    "forces",
    "force_around_workpiece",
    "force_depth",
    "chains_peaks",
    "network_xy",
    "network_xz",
]

ASKED = {
    "tolerance": 0.05, "quantities": ["drag_mean"], "error": None, "relative_cost": 0.04,
    "largest_cost": 0.09, "fallback": None,
}  # fmt: skip


def case_json(scene: str, run: str, **more: Any) -> dict[str, Any]:
    return {
        **OF_EVERY_RUN,
        "schema": 2, "study": "small", "scene": scene, "run": run, "case": "10 mm <workpiece>",
        "upstream": {}, "timestep_s": 2.5e-5, "rayleigh_time_s": 3.2e-5, "gravity_m_s2": 9.81,
        "fidelity": {
            "name": "draft", "youngs_modulus_scale": 0.01, "timestep_fraction": 0.77,
            "speed_factor": 1.0, "skin_m": 0.0003, "ranks": 2,
        },
        "inputs": {"media.count": 1422, "motion.speed_m_s": 0.01, "seeds": [1, 2]},
        "media": {"count": 1422, "radius_mean_m": 0.00327, "radius_std_m": 0.0,
                  "density_kg_m3": 2656.0},
        "bowl": {"radius_m": 0.04, "walls": "primitive"},
        "workpiece": {"kind": "cylinder", "radius_m": 0.005, "length_m": 0.08,
        "mesh": "workpiece.stl",
                 "immersion_depth_m": 0.05},
        "surface_m": 0.07,
        "motion": {"kind": "circle", "axis_speed_m_s": 0.01, "radius_m": 0.02, "direction": "ccw",
                   "orientation": "follow_path", "start_direction_rad": 1.57},
        "phases": [{"name": "drag", "start_step": 4000, "end_step": 64000}],
        "statistics": {"transient_s": 0.5}, "restitution": 0.68,
        "assumptions": [{"field": "bowl.radius_m", "value": 0.04, "why": "a plausible fraction"}],
        "reference": {"source": "a paper",
                      "experiment": {"drag_mean_n": -2.59, "drag_std_n": 0.66}},
        "versions": {"dragdeck": "0.1.0"},
    } | more  # fmt: skip


def run_json(**more: Any) -> dict[str, Any]:
    return {
        "schema": 2, "state": "complete", "inputs": "0f",
        "engine_version": "Engine 3.8", "ranks": 2,
        "steps": 160000, "steps_per_s": 2100.0, "wall_time_s": 76.0,
        "started": "2026-01-01T00:00:00", "parts": [{"part": 1, "from": None, "from_step": 0}],
        "checks": [particles_kept(1422)],
    } | more  # fmt: skip


def particles_kept(seen: int) -> dict[str, Any]:
    return {"code": "particles_kept", "name": "no particle lost", "passed": seen == 1422,
            "seen": str(seen), "limit": "1422",
            "remedy": None if seen == 1422 else "choose a smaller timestep_fraction"}  # fmt: skip


def known(value: float) -> Estimate:
    return Estimate(value, value, value)


def force(mean: float) -> MeanEstimate:
    return MeanEstimate(
        mean=mean, std=0.5, samples=1000, autocorrelation_samples=5.0, effective_samples=100.0,
        se=0.05, ci95_low=mean - 0.1, ci95_high=mean + 0.1, confidence=0.95, reliable=True,
    )  # fmt: skip


def process_findings(drag: float = -2.5) -> ProcessFindings:
    network = ("coordination_number", "mechanical_coordination_number", "rattler_fraction",
               "normal_force_mean_n", "n_particle_workpiece_contacts")  # fmt: skip
    numbers = dict.fromkeys(Chains.model_fields, 0.25) | {"dominant_frames": 31}
    no_columns = EstimateColumns.of([])
    return ProcessFindings(
        run="workpiece-1", process_time_zero_s=0.1, confidence=0.95, workpiece_frames=31,
        forces=dict.fromkeys(("drag_n", "lateral_n", "vertical_n"), force(drag)),
        comparison=(Comparison(
            label="experiment", mean_n=-2.59, std_n=0.66, source="a paper"),),
        peaks=Peaks(count=4, process_time_s=(), drag_n=(), largest_n=-3.9, separation_s=0.1),
        network=dict.fromkeys(network, 4.5) | {"frames": 31},
        chains=Chains.model_validate(numbers),
        ahead_behind=AheadBehind(
            ahead_n=known(1.0), behind_n=known(1.0), ratio=known(math.nan),
            fraction_ahead=known(1.0)),
        azimuth=AzimuthProfile(edges_rad=(), force_n=no_columns),
        depth=DepthProfile(
            edges_m=(), contact_n=no_columns, line_load_n_per_m=no_columns,
            slope_n_per_m=known(5.0)),
    )  # fmt: skip


FILLING = FillingFindings(
    run="filling-1", bed={"bed_height_m": 0.0703, "solid_fraction": 0.592}, rest_energy_ratio=None
)
DROP = DropFindings(
    run="drop-1",
    restitution=DropRestitution(mean=0.71, lowest=0.7, highest=0.72, impacts=3, input=0.68),
    impacts=DropImpacts.model_validate(dict.fromkeys(DropImpacts.model_fields, ())),
)


def make_run(results: Path, case: dict[str, Any], findings: Findings, names: list[str]) -> Path:
    folder = results / "small" / case["scene"] / case["run"]
    (folder / "tables").mkdir(parents=True)
    (folder / "figures").mkdir()
    (folder / "case.json").write_text(json.dumps(case))
    (folder / "run.json").write_text(json.dumps(run_json()))
    findings.write(folder / FILE)
    for name in names:
        (folder / "figures" / f"{name}.png").write_bytes(PNG)
    return folder


REACHED = Reached(
    tolerance=0.1, asked=("drag_mean",), reached=True, needed=Need(3, 1),
    runs=("window-1", "window-2", "window-3"),
)  # fmt: skip


def write_quantities(run: Path, corrected: float | None = None, **reached: Any) -> None:
    """Write ``extrapolated.json``: all quantities 2, by windows that many times it."""
    value = None if corrected is None else Estimate.around(2.0 * corrected, abs(0.2 * corrected))
    own = Estimate(2.0, math.nan, math.nan)
    found = tuple(
        ExtrapolatedQuantity(
            name=one.name, label=one.label, unit=one.unit, measured=own, value=value
        )
        for one in QUANTITIES
    )
    made = REACHED.model_copy(update=reached) if corrected else None
    Extrapolated(quantities=found, tolerance=made).write(run / EXTRAPOLATED)


def page_of(out: Path) -> Page:
    return Page((out / "report.html").read_text(encoding="utf-8"))

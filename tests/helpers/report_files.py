"""Shared by tests of several modules."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

from pages import Page

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


def case_json(scene: str, run: str, **more: Any) -> dict[str, Any]:
    return {
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
        "phases": [], "statistics": {"transient_s": 0.5}, "restitution": 0.68,
        "assumptions": [{"field": "bowl.radius_m", "value": 0.04, "why": "a plausible fraction"}],
        "reference": None, "versions": {"dragdeck": "0.1.0"},
    } | more  # fmt: skip


def run_json(**more: Any) -> dict[str, Any]:
    return {
        "schema": 2, "state": "complete", "engine_version": "Engine 3.8", "ranks": 2,
        "steps": 160000, "steps_per_s": 2100.0, "wall_time_s": 76.0,
        "started": "2026-01-01T00:00:00", "parts": [{"part": 1, "from": None, "from_step": 0}],
        "checks": [particles_kept(1422)],
    } | more  # fmt: skip


def particles_kept(seen: int) -> dict[str, Any]:
    return {"code": "particles_kept", "name": "every particle kept", "passed": seen == 1422,
            "seen": str(seen), "limit": "1422"}  # fmt: skip


def estimate(value: float | None) -> dict[str, float | None]:
    return {"value": value, "ci95_low": value, "ci95_high": value}


def process_findings(drag: float = -2.5) -> dict[str, Any]:
    force = {
        "mean": drag,
        "std": 0.5,
        "samples": 1000.0,
        "autocorrelation_samples": 5.0,
        "effective_samples": 100.0,
        "se": 0.05,
        "ci95_low": drag - 0.1,
        "ci95_high": drag + 0.1,
        "confidence": 0.95,
        "reliable": True,
    }
    against = {
        "label": "measured",
        "mean_n": -2.59,
        "std_n": 0.66,
        "difference_percent": -3.47,
        "ci95_low": -7.3,
        "ci95_high": 0.4,
        "source": "a paper",
    }
    network = dict.fromkeys(
        [
            "coordination_number",
            "mechanical_coordination_number",
            "rattler_fraction",
            "normal_force_mean_n",
            "n_particle_workpiece_contacts",
        ],
        4.5,
    )
    chains = dict.fromkeys(
        [
            "peters_per_frame",
            "peters_particles_mean",
            "widest_paths_per_frame",
            "widest_paths_to_side_fraction",
            "dominant_bottleneck_mean_n",
            "dominant_bottleneck_max_n",
            "dominant_particles_mean",
            "dominant_altitude_mean_m",
            "dominant_azimuth_mean_rad",
        ],
        0.25,
    )
    sides = dict.fromkeys(["ahead_n", "behind_n", "fraction_ahead"], estimate(1.0))
    return {
        "schema": 2, "scene": "process",
        "forces": {name: force for name in ("drag_n", "lateral_n", "vertical_n")},
        "comparison": [against], "peaks": {"count": 4, "largest_n": -3.9},
        "network": network | {"frames": 31}, "chains": chains,
        "association": {"rank_correlation": 0.4, "p_value": 0.2},
        "ahead_behind": sides | {"ratio": estimate(None)},
        "depth": {"slope_n_per_m": estimate(5.0)},
    }  # fmt: skip


def make_run(
    results: Path, case: dict[str, Any], findings: dict[str, Any], names: list[str]
) -> Path:
    folder = results / "small" / case["scene"] / case["run"]
    (folder / "tables").mkdir(parents=True)
    (folder / "figures").mkdir()
    (folder / "case.json").write_text(json.dumps(case))
    (folder / "run.json").write_text(json.dumps(run_json()))
    (folder / "tables" / "figures.json").write_text(json.dumps(findings))
    for name in names:
        (folder / "figures" / f"{name}.png").write_bytes(PNG)
    return folder


def page_of(out: Path) -> Page:
    return Page((out / "report.html").read_text(encoding="utf-8"))

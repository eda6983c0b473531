"""Measures of a trade-off that were never run: known effects, chance from a seed."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from made_run import particles_kept, run_json, save, write_documents
from made_study import plain_study
from report_files import case_json

from dragchain.quantities.registry import MEASURED
from dragchain.tradeoff.compare import read_plan_runs
from dragchain.tradeoff.outcome import Tradeoff, compare_settings
from dragdeck.documents import SCHEMA

BLOCK_M = 0.0065
VALUES = {
    "drag_mean": -2.6, "drag_std": 0.4, "lateral_mean": 0.1, "vertical_mean": 0.7,
    "workpiece_contacts": 30.0, "contact_force_mean": 0.12, "contact_force_p90": 0.35,
    "coordination_number": 4.2, "chain_count": 63.0, "chain_length": 4.4,
}  # fmt: skip
"""At the reference; the other quantities are 1."""

Point = tuple[float, float, float]
Effects = Mapping[str, float]
"""Quantity: what it is multiplied with; of a signed one, mean drags that are added."""


def measures(
    point: Point, seed: int, rng: np.random.Generator, *, effects: Effects | None = None,
    beds: Mapping[int, float] | None = None, blocks: int = 8, noise: float = 0.03,
    cpu_time_s: float = 100.0, failure: Sequence[Mapping[str, object]] = (),
    study: Mapping[str, object] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Content of ``quantities.json``; `noise` is the relative scatter of a block."""
    modulus, step, speed = point
    content: dict[str, Any] = {
        "schema": SCHEMA, "study_name": "small", "run": f"{modulus:g}-{step:g}-{speed:g}-{seed}",
        "bed": f"bed-{seed}", "complete": not failure,
        "study": plain_study(
            {"seed": seed, "motion.path.revolutions": blocks / 16, **(study or {})}
        ),
        "fidelity": {
            "name": "tradeoff", "youngs_modulus_scale": modulus, "timestep_fraction": step,
            "speed_factor": speed, "skin_m": 3e-4, "ranks": 1,
        },
        "cost": {
            "steps": 1000, "wall_time_s": cpu_time_s, "cpu_time_s": cpu_time_s, "ranks": 1,
            "timestep_s": 1e-5, "axis_speed_m_s": 0.01, "steps_per_m": 1e5,
        },
        "versions": {"dragdeck": "0.1.0", "engine": "3.8.0"},
        "started": f"2026-01-0{seed}T00:00:00+00:00",
    }  # fmt: skip
    if failure:
        return {**content, "failure": list(failure)}
    bed = (beds or {}).get(seed, 0.0)
    known = effects or {}
    of_blocks = {
        quantity.name: _blocks(quantity, known, rng.normal(bed, noise, blocks))
        for quantity in MEASURED[:-2]
    }
    return {
        **content,
        "arc_m": blocks * BLOCK_M,
        "block_m": BLOCK_M,
        "blocks": of_blocks,
        "single": {name: known.get(name, 1.0) for name in ("bed_height", "solid_fraction")},
        "numbers": {"inertial_number": 0.004, "particles": 1422},
    }


def _blocks(quantity: Any, effects: Effects, scatter: np.ndarray[Any, Any]) -> list[float]:
    value = VALUES.get(quantity.name, 1.0)
    if quantity.signed:
        shift = effects.get(quantity.name, 0.0) + scatter
        return list(map(float, value + abs(VALUES["drag_mean"]) * shift))
    found = value * effects.get(quantity.name, 1.0) * np.exp(scatter)
    return list(map(float, found**2 if quantity.squared else found))


def write(folder: Path, contents: Sequence[Mapping[str, Any]]) -> list[Path]:
    """Write a folder a run; the files, in the order of the contents."""
    files = []
    for number, content in enumerate(contents):
        file = folder / f"{number}-{content['run']}" / "tables" / "quantities.json"
        file.parent.mkdir(parents=True)
        file.write_text(json.dumps(content))
        files.append(file)
    return files


def write_drop(folder: Path, fraction: float, ratios: Sequence[float], cpu_time_s: float) -> Path:
    """A drop test with its table of impacts."""
    case = case_json("drop_test", folder.name, restitution=0.9, timestep_s=fraction * 1e-5,
                     rayleigh_time_s=1e-5, phases=[])  # fmt: skip
    case["inputs"] = {"drop_test": {"timestep_fraction": fraction}}
    record = run_json(cpu_time_s=cpu_time_s, wall_time_s=1.0, ranks=1)
    write_documents(folder, case, record=record)
    save(pd.DataFrame({"restitution": ratios}), folder, "impacts")
    return folder


REFERENCE, SOFT, COARSE, FAST = (1.0, 0.2, 1.0), (0.01, 0.2, 1.0), (1.0, 0.5, 1.0), (1.0, 0.2, 5.0)
BOTH = (0.01, 0.5, 1.0)
SOFTNESS = {"drag_mean": 1.1, "lateral_mean": 0.2, "contact_force_mean": 0.7}
FAILURE = [particles_kept(12)]


def contents(**changes: Any) -> list[dict[str, Any]]:
    """Four seeds at the reference and three at each of the others."""
    rng = np.random.default_rng(1)
    found = [measures(REFERENCE, seed, rng, cpu_time_s=100.0, **changes) for seed in (1, 2, 3, 4)]
    for seed in (1, 2, 3):
        found += [
            measures(SOFT, seed, rng, effects=SOFTNESS, cpu_time_s=10.0, **changes),
            measures(COARSE, seed, rng, cpu_time_s=40.0, **changes),
            measures(BOTH, seed, rng, effects=SOFTNESS, cpu_time_s=5.0, **changes),
        ]
    return found


def made(folder: Path, found: list[dict[str, Any]]) -> Tradeoff:
    """The trade-off of runs with these measures, the first at the reference."""
    files = write(folder, found)
    return compare_settings(*read_plan_runs(files, files[0].parents[1]))


def point_of(content: dict[str, Any]) -> tuple[float, ...]:
    """Levels of the fidelity parameters of a run."""
    fidelity = content["fidelity"]
    return tuple(
        fidelity[name] for name in ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
    )


WITHIN = 0.03
"""Over four standard errors of a difference here, 3 % / sqrt(8 blocks) / sqrt(3 or so pairs)."""

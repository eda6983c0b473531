"""Whether the advisor's promise holds on scenes that it was not measured on.

In each scene the runs that were asked for by a tolerance are compared with
runs at full stiffness. A promise is kept if the whole interval of the error
lies within the tolerance, broken if it lies outside, and open otherwise.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from dragchain.errors import TableError
from dragchain.measures import QUANTITIES
from dragchain.parquet import write_json
from dragchain.trade import (
    KNOBS,
    SILENT,
    Error,
    Run,
    Setting,
    compare_quantity,
    read_measures,
    values_within,
)

Verdict = Literal["kept", "broken", "open"]
Scene = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Check:
    """One promise in one scene.

    Attributes
    ----------
    scene : mapping
        The inputs in which the scene differs from others of the plan.
    numbers : mapping
        Its dimensionless numbers.
    quantity : str
    tolerance : float
    setting : Setting
        What the advisor chose.
    runs, reference_runs : int
    error : Error
    verdict : str
    """

    scene: Mapping[str, str]
    numbers: Mapping[str, float]
    quantity: str
    tolerance: float
    setting: Setting
    runs: int
    reference_runs: int
    error: Error
    verdict: Verdict


def verdict(error: Error, tolerance: float) -> Verdict:
    """Whether an error with its interval keeps a tolerance."""
    if -tolerance <= error.low and error.high <= tolerance:
        return "kept"
    if error.low > tolerance or error.high < -tolerance:
        return "broken"
    return "open"


def check_promises(files: Sequence[Path]) -> list[Check]:
    """Compare every promise among the runs of a plan with the full stiffness of its scene.

    Parameters
    ----------
    files : sequence of Path
        ``measures.json`` of the runs: of the reference, which asks nothing, and
        of those that ask for a tolerance.

    Raises
    ------
    TableError
        If a scene has no complete run at its reference.
    SeriesError
        If it has too few runs for an interval.
    """
    scenes: dict[Scene, list[Mapping[str, Any]]] = {}
    for file in files:
        measures = read_measures(file)
        scenes.setdefault(_scene(measures), []).append(measures)
    common = set.intersection(*(set(scene) for scene in scenes))
    return [
        check
        for scene, runs in scenes.items()
        for check in _of_scene(dict(item for item in scene if item not in common), runs)
    ]


def _scene(measures: Mapping[str, Any]) -> Scene:
    inputs = measures["inputs"].items()
    return tuple(sorted((name, str(value)) for name, value in inputs if name not in SILENT))


def _of_scene(scene: Mapping[str, str], runs: Sequence[Mapping[str, Any]]) -> list[Check]:
    complete = [run for run in runs if run["complete"]]
    references = [run for run in complete if not run.get("asked")]
    if not references:
        raise TableError(f"scene {dict(scene)}: no complete run at full stiffness to compare with")
    arc = min(run["arc_m"] for run in complete)
    found = []
    for asked in {
        json.dumps(run["asked"]): run["asked"] for run in runs if run.get("asked")
    }.values():
        own = [run for run in complete if run.get("asked") == asked]
        found += _check(scene, asked, own, references, arc)
    return found


def _check(
    scene: Mapping[str, str],
    asked: Mapping[str, Any],
    own: Sequence[Mapping[str, Any]],
    references: Sequence[Mapping[str, Any]],
    arc_m: float,
) -> list[Check]:
    if not own:
        return []
    both = [Run(_setting(run), run["bed"], values_within(run, arc_m), run) for run in own]
    reference = _setting(references[0])
    both += [Run(reference, run["bed"], values_within(run, arc_m), run) for run in references]
    (quantity,) = (item for item in QUANTITIES if item.name == asked["quantity"])
    error = compare_quantity(quantity, both, reference).errors[both[0].setting]
    return [
        Check(
            scene=scene,
            numbers=own[0]["numbers"],
            quantity=quantity.name,
            tolerance=asked["tolerance"],
            setting=both[0].setting,
            runs=len(own),
            reference_runs=len(references),
            error=error,
            verdict=verdict(error, asked["tolerance"]),
        )
    ]


def _setting(measures: Mapping[str, Any]) -> Setting:
    modulus, step, speed = (float(measures["fidelity"][name]) for name in KNOBS)
    return Setting(modulus, step, speed)


def write_checks(out_dir: Path, files: Sequence[Path]) -> list[Check]:
    """Write ``checks.json`` and ``checks.csv`` and return what they hold."""
    checks = check_promises(files)
    out_dir.mkdir(parents=True, exist_ok=True)
    rows = [
        {
            "scene": dict(check.scene),
            "numbers": dict(check.numbers),
            "quantity": check.quantity,
            "tolerance": check.tolerance,
            **{name: getattr(check.setting, name) for name in KNOBS},
            "runs": check.runs,
            "reference_runs": check.reference_runs,
            **vars(check.error),
            "verdict": check.verdict,
        }
        for check in checks
    ]
    write_json(out_dir / "checks.json", {"schema": 1, "checks": rows})
    pd.DataFrame(rows).drop(columns="numbers").to_csv(out_dir / "checks.csv", index=False)
    return checks

"""Whether the advisor's promise holds on scenes that it was not measured on.

In each scene the runs that were asked for by a tolerance are compared with
runs at full stiffness. A promise is kept if the whole interval of the error
lies within the tolerance, broken if it lies outside, and open otherwise.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from dragchain.errors import TableError
from dragchain.frames import Floats
from dragchain.measures import QUANTITIES, Quantity
from dragchain.parquet import write_json
from dragchain.trade import (
    KNOBS,
    SILENT,
    Error,
    Setting,
    read_measures,
    relative_error,
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


@dataclass(frozen=True)
class _Pair:
    """The runs of one promise, and those at full stiffness in the same scene."""

    scene: Mapping[str, str]
    asked: Mapping[str, Any]
    own: Sequence[Mapping[str, Any]]
    references: Sequence[Mapping[str, Any]]

    @property
    def quantity(self) -> Quantity:
        return next(item for item in QUANTITIES if item.name == self.asked["quantity"])

    def logarithms(self) -> tuple[Floats, Floats]:
        """Of the quantity in the promised runs and in those at full stiffness."""
        arc = min(run["arc_m"] for run in (*self.own, *self.references))
        own, references = (
            np.log([abs(values_within(run, arc)[self.quantity.name]) for run in runs])
            for runs in (self.own, self.references)
        )
        return own, references


def check_promises(files: Sequence[Path]) -> list[Check]:
    """Compare every promise among the runs of a plan with the full stiffness of its scene.

    The scatter of runs is taken to be the same, relatively, in all scenes and
    settings: it is pooled over them, because few runs are made of each.

    Parameters
    ----------
    files : sequence of Path
        ``measures.json`` of the runs: of the reference, which asks nothing, and
        of those that ask for a tolerance.

    Raises
    ------
    TableError
        If a scene has no complete run at full stiffness, a quantity may change
        its sign, or there are too few runs for an interval.
    """
    pairs = list(_pairs([read_measures(file) for file in files]))
    groups = [group for pair in pairs for group in pair.logarithms()]
    degrees = sum(len(group) - 1 for group in groups)
    if degrees < 1:
        raise TableError("one run of each setting says nothing of their scatter: run more seeds")
    scatter = math.sqrt(sum(float(((g - g.mean()) ** 2).sum()) for g in groups) / degrees)
    return [_check(pair, scatter, degrees) for pair in pairs]


def _pairs(runs: Sequence[Mapping[str, Any]]) -> Iterator[_Pair]:
    scenes: dict[Scene, list[Mapping[str, Any]]] = {}
    for run in runs:
        if run["complete"]:
            scenes.setdefault(_scene(run), []).append(run)
    common = set.intersection(*map(set, scenes)) if scenes else set()
    for key, own in scenes.items():
        scene = dict(item for item in key if item not in common)
        references = [run for run in own if not run.get("asked")]
        if not references:
            raise TableError(f"scene {scene}: no complete run at full stiffness to compare with")
        asked = {json.dumps(run["asked"]): run["asked"] for run in own if run.get("asked")}
        for wanted in asked.values():
            pair = _Pair(
                scene, wanted, [run for run in own if run.get("asked") == wanted], references
            )
            if pair.quantity.signed:
                raise TableError(f"{pair.quantity.name} may change its sign: it has no promise")
            yield pair


def _scene(measures: Mapping[str, Any]) -> Scene:
    inputs = measures["inputs"].items()
    return tuple(sorted((name, str(value)) for name, value in inputs if name not in SILENT))


def _check(pair: _Pair, scatter: float, degrees: int) -> Check:
    own, references = pair.logarithms()
    difference = float(own.mean() - references.mean())
    uncertainty = scatter * math.sqrt(1 / len(own) + 1 / len(references))
    modulus, step, speed = (float(pair.own[0]["fidelity"][name]) for name in KNOBS)
    error = relative_error(difference, uncertainty, degrees)
    return Check(
        scene=pair.scene,
        numbers=pair.own[0]["numbers"],
        quantity=pair.quantity.name,
        tolerance=float(pair.asked["tolerance"]),
        setting=Setting(modulus, step, speed),
        runs=len(own),
        reference_runs=len(references),
        error=error,
        verdict=verdict(error, float(pair.asked["tolerance"])),
    )


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

"""Whether the advisor's promise holds on scenes that it was not measured on.

In each scene the runs that were asked for by a tolerance are compared with
runs at full stiffness. A promise is kept if the whole interval of the error
lies within the tolerance, broken if it lies outside, and open otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.files import write_json
from dragchain.tradeoff.compare import (
    PARAMETERS,
    SILENT,
    Error,
    Setting,
    read_measures,
    relative_error,
    values_within,
)
from dragchain.tradeoff.measures import QUANTITIES, Quantity

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
    held_to : float
        The error that the settings were chosen for: less than the tolerance
        where the scene is unlike those that were measured.
    setting : Setting
        What the advisor chose.
    runs, failed, reference_runs : int
    error : Error
    verdict : str
    """

    scene: Mapping[str, str]
    numbers: Mapping[str, float]
    quantity: str
    tolerance: float
    held_to: float
    setting: Setting
    runs: int
    failed: int
    reference_runs: int
    error: Error
    verdict: Verdict

    @property
    def met(self) -> bool:
        """Whether no run failed and the error is within what the settings were chosen for."""
        return not self.failed and verdict(self.error, self.held_to) == "kept"


def verdict(error: Error, tolerance: float) -> Verdict:
    """Whether an error with its interval keeps a tolerance."""
    if -tolerance <= error.ci95_low and error.ci95_high <= tolerance:
        return "kept"
    if error.ci95_low > tolerance or error.ci95_high < -tolerance:
        return "broken"
    return "open"


@dataclass(frozen=True)
class _Pair:
    """The runs of one promise, and those at full stiffness in the same scene."""

    scene: Mapping[str, str]
    asked: Mapping[str, Any]
    own: Sequence[Mapping[str, Any]]
    references: Sequence[Mapping[str, Any]]
    failed: int

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

    A scene whose runs at full stiffness all failed has nothing to compare with;
    `failures` lists them. The scatter of runs is taken to be the same, relatively,
    in all scenes and settings: it is pooled over them, because few runs are made
    of each.

    Parameters
    ----------
    files : sequence of Path
        ``measures.json`` of the runs: of the reference, which asks nothing, and
        of those that ask for a tolerance.

    Raises
    ------
    TableError
        If a scene was not run at full stiffness, a quantity may change its sign,
        or there are too few runs for an interval.
    """
    pairs = list(_pairs([read_measures(file) for file in files]))
    groups = [group for pair in pairs for group in pair.logarithms()]
    degrees = sum(len(group) - 1 for group in groups)
    if degrees < 1:
        raise TableError("one run of each setting says nothing of their scatter: run more seeds")
    scatter = math.sqrt(sum(float(((g - g.mean()) ** 2).sum()) for g in groups) / degrees)
    return [_check(pair, scatter, degrees) for pair in pairs]


def _pairs(runs: Sequence[Mapping[str, Any]]) -> Iterator[_Pair]:
    for scene, everyone in _by_scene(runs):
        own = [run for run in everyone if run["complete"]]
        references = [run for run in own if not run.get("asked")]
        if not any(not run.get("asked") for run in everyone):
            raise TableError(f"scene {scene}: no run at full stiffness to compare with")
        if not references:
            continue
        promised: dict[tuple[str, float], list[Mapping[str, Any]]] = {}
        for run in own:
            if run.get("asked"):
                promised.setdefault(_promise(run), []).append(run)
        for kept in promised.values():
            failed = sum(_failed(run, kept[0]) for run in everyone)
            pair = _Pair(scene, kept[0]["asked"], kept, references, failed)
            if pair.quantity.signed:
                raise TableError(f"{pair.quantity.name} may change its sign: it has no promise")
            yield pair


def _failed(run: Mapping[str, Any], kept: Mapping[str, Any]) -> bool:
    return not run["complete"] and bool(run.get("asked")) and _promise(run) == _promise(kept)


def _promise(run: Mapping[str, Any]) -> tuple[str, float]:
    return str(run["asked"]["quantity"]), float(run["asked"]["tolerance"])


def _by_scene(
    runs: Sequence[Mapping[str, Any]],
) -> Iterator[tuple[dict[str, str], list[Mapping[str, Any]]]]:
    """The inputs that tell a scene from the others, and its runs, failed ones included."""
    scenes: dict[Scene, list[Mapping[str, Any]]] = {}
    for run in runs:
        scenes.setdefault(_scene(run), []).append(run)
    common = set.intersection(*map(set, scenes)) if len(scenes) > 1 else set()
    for key, own in scenes.items():
        yield dict(item for item in key if item not in common), own


def failures(files: Sequence[Path]) -> list[dict[str, Any]]:
    """The runs that failed: scene, settings and the first acceptance check that did not hold."""
    return [
        {
            "scene": scene,
            "asked": bool(run.get("asked")),
            **{name: run["fidelity"][name] for name in PARAMETERS},
            "check": run["failure"][0]["name"],
            "seen": run["failure"][0]["seen"],
        }
        for scene, runs in _by_scene([read_measures(file) for file in files])
        for run in runs
        if not run["complete"]
    ]


def _scene(measures: Mapping[str, Any]) -> Scene:
    inputs = measures["inputs"].items()
    return tuple(
        sorted(
            (name, str(value)) for name, value in inputs if name not in SILENT and value is not None
        )
    )


def _check(pair: _Pair, scatter: float, degrees: int) -> Check:
    own, references = pair.logarithms()
    difference = float(own.mean() - references.mean())
    uncertainty = scatter * math.sqrt(1 / len(own) + 1 / len(references))
    modulus, step, speed = (float(pair.own[0]["fidelity"][name]) for name in PARAMETERS)
    error = relative_error(difference, uncertainty, degrees)
    return Check(
        scene=pair.scene,
        numbers=pair.own[0]["numbers"],
        quantity=pair.quantity.name,
        tolerance=float(pair.asked["tolerance"]),
        held_to=float(pair.asked.get("held_to", pair.asked["tolerance"])),
        setting=Setting(modulus, step, speed),
        runs=len(own),
        failed=pair.failed,
        reference_runs=len(references),
        error=error,
        verdict=verdict(error, float(pair.asked["tolerance"])),
    )


def write_checks(out_dir: Path, files: Sequence[Path]) -> list[Check]:
    """Write ``promises.json`` and ``promises.csv`` and return what they hold."""
    checks = check_promises(files)
    out_dir.mkdir(parents=True, exist_ok=True)
    rows = [
        {
            "scene": dict(check.scene),
            "numbers": dict(check.numbers),
            "quantity": check.quantity,
            "tolerance": check.tolerance,
            "held_to": check.held_to,
            **{name: getattr(check.setting, name) for name in PARAMETERS},
            "runs": check.runs,
            "failed": check.failed,
            "reference_runs": check.reference_runs,
            **vars(check.error),
            "verdict": check.verdict,
            "met": check.met,
        }
        for check in checks
    ]
    content = {"schema": 2, "checks": rows, "failed": failures(files)}
    write_json(out_dir / "promises.json", content)
    pd.DataFrame(rows).drop(columns="numbers").to_csv(out_dir / "promises.csv", index=False)
    return checks


def promises_command(out_dir: Path, measures: Sequence[Path]) -> str:
    """Check promises as the command line asks for; a line per promise."""
    lines = []
    for check in write_checks(out_dir, measures):
        scene = ", ".join(f"{name} {value}" for name, value in check.scene.items())
        error = check.error
        lines.append(
            f"{scene or 'other beds'}: {check.quantity} within {check.tolerance:g} by"
            f" {check.setting}: {error.error:+.3f} ({error.ci95_low:+.3f} to"
            f" {error.ci95_high:+.3f}), {check.verdict}"
        )
    return "\n".join(lines)

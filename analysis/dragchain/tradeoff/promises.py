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
from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.files import write_text
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


class PromiseError(Part):
    """The error of a promise; `significant`: zero is outside of its interval."""

    value: float
    se: float
    ci95_low: float
    ci95_high: float
    bound: float
    significant: bool


class Promise(Part):
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
    youngs_modulus_scale, timestep_fraction, speed_factor : float
        What the advisor chose.
    runs, failed, reference_runs : int
    error : PromiseError
    verdict : str
    met : bool
        Whether no run failed and the error is within what the settings were chosen for.
    """

    scene: Mapping[str, str]
    numbers: Mapping[str, float]
    quantity: str
    tolerance: float
    held_to: float
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    runs: int
    failed: int
    reference_runs: int
    error: PromiseError
    verdict: Verdict
    met: bool

    @property
    def setting(self) -> Setting:
        """What the advisor chose."""
        return Setting(self.youngs_modulus_scale, self.timestep_fraction, self.speed_factor)

    @property
    def place(self) -> str:
        """The scene as text."""
        return ", ".join(f"{name} {value}" for name, value in self.scene.items()) or "other beds"


class FailedRun(Part):
    """A run that failed: scene, settings and the first acceptance check that did not pass."""

    scene: Mapping[str, str]
    asked: bool
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    check: str
    seen: str


class PromisesFile(Document):
    """The content of ``promises.json``."""

    made_by = "snakemake tradeoff --config plan=promises"

    promises: tuple[Promise, ...]
    failed: tuple[FailedRun, ...] = ()


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


def check_promises(files: Sequence[Path]) -> list[Promise]:
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
    return [_promise_of(pair, scatter, degrees) for pair in pairs]


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


def failures(files: Sequence[Path]) -> list[FailedRun]:
    """The runs that failed."""
    return [
        FailedRun(
            scene=scene,
            asked=bool(run.get("asked")),
            **{name: run["fidelity"][name] for name in PARAMETERS},
            check=run["failure"][0]["name"],
            seen=run["failure"][0]["seen"],
        )
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


def _promise_of(pair: _Pair, scatter: float, degrees: int) -> Promise:
    own, references = pair.logarithms()
    difference = float(own.mean() - references.mean())
    uncertainty = scatter * math.sqrt(1 / len(own) + 1 / len(references))
    error = relative_error(difference, uncertainty, degrees)
    tolerance = float(pair.asked["tolerance"])
    held_to = float(pair.asked.get("held_to", tolerance))
    return Promise(
        scene=pair.scene,
        numbers=pair.own[0]["numbers"],
        quantity=pair.quantity.name,
        tolerance=tolerance,
        held_to=held_to,
        **{name: float(pair.own[0]["fidelity"][name]) for name in PARAMETERS},
        runs=len(own),
        failed=pair.failed,
        reference_runs=len(references),
        error=PromiseError(**vars(error)),
        verdict=verdict(error, tolerance),
        met=not pair.failed and verdict(error, held_to) == "kept",
    )


def write_promises(out_dir: Path, files: Sequence[Path]) -> list[Promise]:
    """Write ``promises.json`` and ``promises.csv`` and return what they hold."""
    promises = check_promises(files)
    failed = tuple(failures(files))
    PromisesFile(promises=tuple(promises), failed=failed).write(out_dir / "promises.json")
    table = pd.DataFrame([_columns(promise) for promise in promises])
    write_text(out_dir / "promises.csv", table.to_csv(index=False))
    return promises


def _columns(promise: Promise) -> dict[str, object]:
    """A promise as a row of ``promises.csv``."""
    row = promise.model_dump(exclude={"numbers", "error", "verdict", "met"})
    error = Error(**promise.error.model_dump())
    return {**row, **error.columns(), "verdict": promise.verdict, "met": promise.met}


def promises_command(out_dir: Path, measures: Sequence[Path]) -> str:
    """Check promises as the command line asks for; a line per promise."""
    lines = []
    for promise in write_promises(out_dir, measures):
        error = promise.error
        lines.append(
            f"{promise.place}: {promise.quantity} within {promise.tolerance:g} by"
            f" {promise.setting}: {error.value:+.3f} ({error.ci95_low:+.3f} to"
            f" {error.ci95_high:+.3f}), {promise.verdict}"
        )
    return "\n".join(lines)

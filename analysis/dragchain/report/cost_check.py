"""What a run was expected to cost and to err, beside what it did.

The expectation is ``advice.json`` of `dragdeck advise`; docs/outputs.md
describes it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dragchain.errors import TableError
from dragchain.run.case import AdvisedSettings, Case, changed_inputs
from dragchain.run.completeness import RunRecord

SCHEMA = 2

INTERVALS = {"drag_mean": "drag_n", "vertical_mean": "vertical_n"}
"""Quantities of a tolerance of which a run knows an interval, and the force each is a mean of."""

Entry = Mapping[str, Any]


@dataclass(frozen=True)
class CostRow:
    """Predicted and actual cost of one engine run.

    Attributes
    ----------
    scene : str
    steps, actual_steps : int
    steps_per_s : float
    actual_steps_per_s : float or None
        None for a run too short to measure it.
    wall_time_s, actual_wall_time_s : float
    """

    scene: str
    steps: int
    actual_steps: int
    steps_per_s: float
    actual_steps_per_s: float | None
    wall_time_s: float
    actual_wall_time_s: float

    @property
    def ratio(self) -> float:
        """Actual over predicted wall time."""
        return self.actual_wall_time_s / self.wall_time_s


def read_advice(file: Path) -> list[Entry]:
    """The options of all cases of an ``advice.json``.

    Raises
    ------
    TableError
        It is not there, or another dragdeck wrote it.
    """
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragdeck advise` first")
    known = json.loads(file.read_text(encoding="utf-8"))
    if known.get("schema") != SCHEMA:
        raise TableError(
            f"{file}: its schema is {known.get('schema')!r}, this dragchain reads {SCHEMA}"
        )
    return [option for case in known["cases"] for option in case["options"]]


def prediction_for(case: Case, options: list[Entry]) -> Entry | None:
    """The option that a process run is: same settings, same inputs; None where there is none."""
    return next((option for option in options if _is_of(case, option)), None)


def _is_of(case: Case, option: Entry) -> bool:
    settings, fidelity = option["settings"], case.fidelity
    names = ("youngs_modulus_scale", "timestep_fraction", "speed_factor", "ranks")
    same = all(math.isclose(settings[name], getattr(fidelity, name)) for name in names)
    return same and not changed_inputs(case.inputs, option["inputs"])


def cost_rows(option: Entry, records: Mapping[str, RunRecord]) -> Iterator[CostRow]:
    """Predicted and actual cost of every run that the option says something of.

    Parameters
    ----------
    option : mapping
    records : mapping
        ``run.json`` by scene.
    """
    for scene, steps in option["steps"].items():
        if scene in records:
            record = records[scene]
            yield CostRow(
                scene,
                steps,
                record.steps,
                option["steps_per_s"][scene],
                record.steps_per_s,
                option["wall_time_s"][scene],
                record.wall_time_s,
            )


def actual_interval(asked: AdvisedSettings, forces: Entry) -> dict[str, float] | None:
    """Mean and 95 % interval of the quantity asked about, N, and its relative half-width.

    None where a single run has no interval of it.
    """
    name = INTERVALS.get(asked.quantity)
    if name is None or not forces[name]["mean"]:
        return None
    mean, low, high = (float(forces[name][key]) for key in ("mean", "ci95_low", "ci95_high"))
    return {
        "mean": mean,
        "ci95_low": low,
        "ci95_high": high,
        "fraction": abs((high - low) / (2 * mean)),
    }

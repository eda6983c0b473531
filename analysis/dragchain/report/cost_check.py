"""What a run was expected to cost and to err, beside what it did.

The expectation is ``advice.json`` of `dragdeck advise`; docs/reference/results.md
describes it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from pydantic import JsonValue

from dragchain.documents import Document, Part
from dragchain.report.extrapolated import Extrapolated
from dragchain.run.case import AdvisedSettings, Case, changed_inputs
from dragchain.run.completeness import RunRecord
from dragchain.statistics.correlated import MeanEstimate

_INTERVALS = {"drag_mean": "drag_n", "vertical_mean": "vertical_n"}
"""Quantities of a tolerance of which a run knows an interval, and the force each is a mean of."""


class Settings(Part):
    """The settings of an option."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    ranks: int


class Option(Part):
    """Settings for a case, and what its runs are expected to take with them, by scene."""

    settings: Settings
    inputs: Mapping[str, JsonValue]
    steps: Mapping[str, int]
    steps_per_s: Mapping[str, float]
    wall_time_s: Mapping[str, float]
    source: str


class AdvisedCase(Part):
    """A case of ``advice.json``."""

    options: tuple[Option, ...]


class Advice(Document):
    """The content of ``advice.json`` that is set beside the runs."""

    made_by: ClassVar[str] = "dragdeck advise"

    cases: tuple[AdvisedCase, ...]


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


@dataclass(frozen=True)
class RunInterval:
    """Value of one run with its 95 % interval, and the relative half-width of that."""

    mean: float
    ci95_low: float
    ci95_high: float
    fraction: float

    @classmethod
    def of(cls, mean: float, low: float, high: float) -> "RunInterval":
        """From a value, which is not 0, and its interval."""
        return cls(mean, low, high, abs((high - low) / (2 * mean)))


def read_advice(file: Path) -> list[Option]:
    """The options of all cases of an ``advice.json``."""
    return [option for case in Advice.read(file).cases for option in case.options]


def prediction_for(case: Case, options: Sequence[Option]) -> Option | None:
    """The option that a process run is: same settings, same inputs; None where there is none."""
    return next((option for option in options if _is_of(case, option)), None)


def _is_of(case: Case, option: Option) -> bool:
    same = all(math.isclose(value, getattr(case.fidelity, name)) for name, value in option.settings)
    return same and not changed_inputs(case.inputs, option.inputs)


def cost_rows(option: Option, records: Mapping[str, RunRecord]) -> Iterator[CostRow]:
    """Predicted and actual cost of every run that the option says something of.

    Parameters
    ----------
    option : Option
    records : mapping
        ``run.json`` by scene.
    """
    for scene, steps in option.steps.items():
        if scene in records:
            record = records[scene]
            yield CostRow(
                scene,
                steps,
                record.steps,
                option.steps_per_s[scene],
                record.steps_per_s,
                option.wall_time_s[scene],
                record.wall_time_s,
            )


def actual_interval(
    asked: AdvisedSettings | None,
    forces: Mapping[str, MeanEstimate],
    extrapolated: Extrapolated | None,
) -> RunInterval | None:
    """Value and 95 % interval of the quantity asked about, extrapolated if that was asked.

    None where nothing was asked, or a single run has no interval of it.
    """
    if asked is None:
        return None
    if asked.extrapolated:
        one = extrapolated.of(asked.quantity) if extrapolated else None
        found = one.estimate if one else None
        return RunInterval.of(found.value, found.ci95_low, found.ci95_high) if found else None
    name = _INTERVALS.get(asked.quantity)
    if name is None or not forces[name].mean:
        return None
    force = forces[name]
    return RunInterval.of(force.mean, force.ci95_low, force.ci95_high)

"""What a run was expected to cost and asked to reach, beside what it did.

The expectation is ``advice.json`` of `./run dragdeck advise`; docs/reference/results.md
describes it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dragchain.report.cases import ReportedCase
from dragchain.run.case import changed_inputs, study_of
from dragchain.statistics.estimate import Estimate
from dragdeck.records.advice import AdviceFile, OptionEntry
from dragdeck.records.advised import AdvisedSettings
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import RunRecord

_RESTITUTION = "restitution"
"""The quantity of the drop test."""


_SETTINGS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor", "ranks")
"""Those that tell a run from another."""


@dataclass(frozen=True)
class CostRow:
    """Predicted and actual cost of one engine run.

    Attributes
    ----------
    scene : str
    steps : int
    steps_per_s, wall_time_s : float
        Predicted.
    record : RunRecord
        With the actual ones.
    """

    scene: str
    steps: int
    steps_per_s: float
    wall_time_s: float
    record: RunRecord

    @property
    def ratio(self) -> float:
        """Actual over predicted wall time."""
        return self.record.wall_time_s / self.wall_time_s


@dataclass(frozen=True)
class Answer:
    """What a case says of a quantity to which a tolerance applies.

    Attributes
    ----------
    label, unit : str
    value : Estimate or None
        None where there is none.
    half_width : float or None
        Relative half-width of its 95 % CI, or error of a restitution; None where it is not known.
    tolerance : float
    """

    label: str
    unit: str
    value: Estimate | None
    half_width: float | None
    tolerance: float

    @property
    def reached(self) -> str:
        """Whether it is inside the tolerance."""
        if self.half_width is None:
            return "not known"
        return "yes" if self.half_width <= self.tolerance else "no"


def read_advice(file: Path) -> list[OptionEntry]:
    """The options of all cases of an ``advice.json``."""
    return [option for case in AdviceFile.read(file).cases for option in case.options]


def prediction_for(case: CaseOfRun, options: Sequence[OptionEntry]) -> OptionEntry | None:
    """The option that a process run is: same settings, same inputs; None where there is none."""
    return next((option for option in options if _is_of(case, option)), None)


def _is_of(case: CaseOfRun, option: OptionEntry) -> bool:
    own, other = case.fidelity, option.settings
    same = all(math.isclose(getattr(other, name), getattr(own, name)) for name in _SETTINGS)
    return same and not changed_inputs(study_of(case).inputs(), option.inputs)


def cost_rows(option: OptionEntry, records: Mapping[str, RunRecord]) -> Iterator[CostRow]:
    """Predicted and actual cost of every run that the option says something of.

    Parameters
    ----------
    option : OptionEntry
    records : mapping
        ``run.json`` by scene.
    """
    for scene, steps in option.steps.items():
        if scene in records:
            speed, time_s = option.steps_per_s[scene], option.wall_time_s[scene]
            yield CostRow(scene, steps, speed, time_s, records[scene])


def answers(case: ReportedCase) -> list[Answer]:
    """The asked quantities of a case; none if nothing was asked."""
    asked = case.first.process.case.asked
    return [_answer(name, case, asked) for name in asked.quantities] if asked else []


def _answer(name: str, case: ReportedCase, asked: AdvisedSettings) -> Answer:
    if name == _RESTITUTION:
        return Answer("coefficient of restitution", "", None, asked.error, asked.tolerance)
    standing, scale = case.values.of(name), case.first.process.case.fidelity.youngs_modulus_scale
    if standing is None or standing.value is None or not (standing.corrected or scale == 1.0):
        return Answer(name, "", None, None, asked.tolerance)
    quantity, value = standing.quantity, standing.value
    return Answer(quantity.label, quantity.unit, value, value.relative_half_width, asked.tolerance)

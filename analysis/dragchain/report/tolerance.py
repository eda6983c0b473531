"""Whether a case reached the tolerance that its settings were chosen for."""

from dataclasses import dataclass

from dragchain.report.cases import ReportedCase
from dragchain.statistics.estimate import Estimate
from dragdeck.records.advised import AdvisedSettings

_RESTITUTION = "restitution"
"""The quantity of the drop test."""


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

"""What the uncertainties of a study's inputs do to the mean drag, by the measured scaling laws."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from dragchain.scaling.document import ScalingFile, read_scalings
from dragchain.statistics.estimate import Estimate
from dragdeck.records.case import AssumptionOfRun
from dragdeck.study.model import Study


class UncertainInput(NamedTuple):
    """An input with its standard uncertainty, and the relative one of the mean drag by it.

    Attributes
    ----------
    assumption : AssumptionOfRun
    law : ScalingFile
        Of which the exponent is taken.
    drag : Estimate
        Magnitude of the exponent times the relative uncertainty of the input; its interval is
        that of the exponent.
    """

    assumption: AssumptionOfRun
    law: ScalingFile
    drag: Estimate


def uncertain_inputs(
    assumptions: Sequence[AssumptionOfRun], study: Study
) -> Iterator[UncertainInput]:
    """The inputs whose uncertainty is given and within the levels of a scaling law."""
    for assumption in assumptions:
        law, value = _law_of(assumption.field, study), assumption.value
        if not law or not assumption.std or not isinstance(value, int | float):
            continue
        if law.levels[0].x <= value <= law.levels[-1].x:
            exponent = law.fit.exponent
            ends = sorted(abs(end) for end in (exponent.ci95_low, exponent.ci95_high))
            least = 0.0 if exponent.contains(0.0) else ends[0]
            drag = Estimate(abs(exponent.value), least, ends[1]).over(value / assumption.std)
            yield UncertainInput(assumption, law, drag)


def _law_of(field: str, study: Study) -> ScalingFile | None:
    """The scaling law of a field; all frictions of particles on a workpiece share one."""
    particle, workpiece = study.media.main_material, study.workpiece.material
    both = f"{particle}-{workpiece}", f"{workpiece}-{particle}"
    on_workpiece = field in [f"pairs.{pair}.friction" for pair in both]
    for law in read_scalings():
        if law.field == field or (on_workpiece and law.field.endswith(".friction")):
            return law
    return None

"""The cases of a report: process runs that differ in the packing (seed) alone are one case."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from dragchain.report.runs import StudyRuns
from dragchain.report.setup import set_up
from dragchain.report.values import Values, over_packings
from dragchain.run.case import changed_inputs

_SEED = "seed"
_IN_NAME = re.compile(rf"_?{_SEED}-[0-9]+")


@dataclass(frozen=True)
class ReportedCase:
    """A case: one process run, or several that differ in their seeds alone."""

    studies: tuple[StudyRuns, ...]

    @property
    def first(self) -> StudyRuns:
        """The first of its packings."""
        return self.studies[0]

    @property
    def key(self) -> str:
        """Name of its place on the page."""
        return self.first.process.case.run

    @property
    def name(self) -> str:
        """Name of the case, without the seed if it is a mean over packings."""
        case = self.first.process.case
        name = case.case or case.run
        return _IN_NAME.sub("", name).lstrip("_") if len(self.studies) > 1 else name

    @cached_property
    def values(self) -> Values:
        """Its quantities, means over the packings."""
        return over_packings([study.values for study in self.studies])

    @cached_property
    def set_up(self) -> list[tuple[str, str]]:
        """What was simulated, in six lines."""
        filling = self.first.filling
        bed = filling.findings if filling else None
        return set_up(self.first.process.case, len(self.studies), bed)


def cases_of(studies: Iterable[StudyRuns]) -> list[ReportedCase]:
    """Group process runs by all inputs but the seed, in the order of the first ones."""
    found: list[list[StudyRuns]] = []
    for study in studies:
        for group in found:
            if _same_but_seed(group[0], study):
                group.append(study)
                break
        else:
            found.append([study])
    return [ReportedCase(tuple(group)) for group in found]


def _same_but_seed(one: StudyRuns, other: StudyRuns) -> bool:
    a, b = one.process.case, other.process.case
    numbers = [case.workpiece.number if case.workpiece else 0 for case in (a, b)]
    changed = set(changed_inputs(a.inputs, b.inputs)) | set(changed_inputs(b.inputs, a.inputs))
    return changed == {_SEED} and a.fidelity == b.fidelity and numbers[0] == numbers[1]

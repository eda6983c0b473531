"""The quantities of a process run, each with what it says of the process."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from dragchain.quantities.basis import Basis, Correction, Standing, judge, notes
from dragchain.quantities.document import Extrapolated
from dragchain.quantities.registry import REPORTED
from dragchain.run.case import study_of
from dragchain.run.reference import ReferenceDrag, reference_drags
from dragchain.statistics.estimate import Estimate, mean_of
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import changed_in_words


class Against(NamedTuple):
    """A published mean drag, and the relative difference of the simulated one from it."""

    reference: ReferenceDrag
    difference: Estimate


@dataclass(frozen=True)
class Values:
    """The quantities of a case in the order of the registry.

    Attributes
    ----------
    case : CaseOfRun
    standings : tuple of Standing
    packings : int
        Number of packings (seeds) that the values are means of.
    """

    case: CaseOfRun
    standings: tuple[Standing, ...]
    packings: int = 1

    def of(self, name: str) -> Standing | None:
        """A quantity by its name, None if the run does not give it."""
        return next((value for value in self.standings if value.quantity.name == name), None)

    @property
    def drag(self) -> Standing:
        """The mean drag."""
        standing = self.of("drag_mean")
        assert standing is not None
        return standing

    @property
    def contacts(self) -> Estimate | None:
        """Contacts on the workpiece at a time, None if they are not known."""
        standing = self.of("workpiece_contacts")
        return standing.value if standing else None

    @property
    def adjusted(self) -> bool:
        """Whether any value differs from the run's."""
        return any(standing.value not in (None, standing.run) for standing in self.standings)

    @property
    def corrected(self) -> bool:
        """Whether any value is from windows at the physical Young's modulus."""
        return any(standing.corrected for standing in self.standings)

    @property
    def estimated(self) -> bool:
        """Whether other scenes suggest any value at the physical Young's modulus."""
        return any(standing.estimated for standing in self.standings)

    @cached_property
    def notes(self) -> list[str]:
        """What each setting does to the numbers, one sentence each."""
        return [*notes(self.case), *_of_packings(self)]

    @cached_property
    def against(self) -> list[Against]:
        """The mean drag beside the published ones."""
        return [
            Against(reference, reference.difference(self.drag.shown))
            for reference in reference_drags(study_of(self.case).reference)
        ]

    def headline(self) -> str:
        """The main numbers in one line of plain text."""
        shown = (self.drag, self.of("workpiece_contacts"))
        numbers = [_plain(standing) for standing in shown if standing]
        return "; ".join(filter(None, [*numbers, changed_in_words(self.case.changed_scripts)]))


def values_of(
    case: CaseOfRun, measured: Mapping[str, Estimate], extrapolated: Extrapolated | None
) -> Values:
    """The quantities of a process run.

    Parameters
    ----------
    case : CaseOfRun
    measured : mapping of str to Estimate
        The quantities of the run, in simulated time.
    extrapolated : Extrapolated or None
        Content of ``extrapolated.json``, if it was made.
    """
    standings = []
    for quantity in REPORTED:
        value = measured.get(quantity.name)
        if value is not None:
            correction = _correction(value, quantity.name, extrapolated)
            standings.append(judge(quantity, value, case, correction))
    return Values(case, tuple(standings))


def _correction(value: Estimate, name: str, extrapolated: Extrapolated | None) -> Correction | None:
    """What the windows of a run make of a quantity."""
    if extrapolated is None or name not in extrapolated.values or not extrapolated.tolerance:
        return None
    reached = extrapolated.tolerance
    windows = 0 if reached.whole else len(reached.runs)
    return Correction(extrapolated.values[name].over(value.value), windows)


def values_over_packings(packings: Sequence[Values]) -> Values:
    """The means over the packings of one case, each with Student's t interval between them.

    That of a value from windows joins those of the single runs, each of which includes the scatter
    from packing to packing.
    """
    first = packings[0]
    if len(packings) == 1:
        return first
    standings = []
    for standing in first.standings:
        same = [other for values in packings if (other := values.of(standing.quantity.name))]
        run = mean_of([other.run.value for other in same])
        value = _common([other.value for other in same if other.value], standing.basis)
        windows = sum(other.windows for other in same)
        standings.append(replace(standing, run=run, value=value, windows=windows))
    return Values(first.case, tuple(standings), len(packings))


def _common(values: Sequence[Estimate], basis: Basis) -> Estimate | None:
    if not values:
        return None
    if basis is Basis.WINDOWS:
        return mean_over_packings(values)
    return mean_of([estimate.value for estimate in values])


def mean_over_packings(values: Sequence[Estimate]) -> Estimate:
    """The mean of values whose intervals include the scatter between packings."""
    mean = math.fsum(estimate.value for estimate in values) / len(values)
    half = math.hypot(*(estimate.half_width for estimate in values))
    return Estimate.around(mean, half / len(values))


def _of_packings(values: Values) -> Iterator[str]:
    windows = (
        "; those of values from windows include the scatter from packing to packing"
        if values.corrected
        else ""
    )
    if values.packings > 1:
        yield (
            f"Means over {values.packings} packings (seeds); 95 % confidence intervals are "
            f"Student's t between packings{windows}."
        )
    else:
        yield (
            "One packing (seed): 95 % confidence intervals cover the scatter along its path and, "
            "of quantities of which it was measured in other scenes, that from packing to packing."
        )


def _plain(value: Standing) -> str:
    """Name and value with interval and, where it differs, that of the run."""
    name, unit, shown = value.quantity.label, f" {value.quantity.unit}".rstrip(), value.shown
    what = value.reason.partition(":")[0]
    doubt = "" if value.reliable or value.corrected else ", too short for a reliable interval"
    ends = f"95 % CI {shown.ci95_low:#.3g} to {shown.ci95_high:#.3g}{unit}{doubt}"
    text = f"{name} {shown.value:#.3g}{unit}" + (f" ({ends})" if shown.known else "")
    if value.corrected:
        return f"{text} {value.rests_on}, {value.run.value:#.3g}{unit} as simulated"
    estimated = ""
    if value.estimated and value.other_scenes:
        ends = f"{value.estimated.ci95_low:#.3g} to {value.estimated.ci95_high:#.3g}{unit}"
        estimated = f"at the physical one {ends} by {value.other_scenes.scenes} other scenes"
    return ", ".join(filter(None, (text, "" if value.value else "this run only", what, estimated)))

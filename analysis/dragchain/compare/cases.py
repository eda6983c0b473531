"""Cases of a comparison, and the differences of their quantities from the first one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.quantities.along import MAP_AZIMUTHS, MAP_DEPTHS
from dragchain.quantities.basis import Standing
from dragchain.quantities.registry import REPORTED, Quantity
from dragchain.report.cases import ReportedCase, StudyRuns
from dragchain.statistics.estimate import NOT_KNOWN, Estimate, mean_of


@dataclass(frozen=True)
class ComparedCase:
    """A case of a comparison, with its name there."""

    name: str
    case: ReportedCase

    @cached_property
    def by_seed(self) -> Mapping[int, StudyRuns]:
        """Its process runs by the seed of their packing."""
        return {runs.process.study.seed: runs for runs in self.case.studies}

    @cached_property
    def inputs(self) -> Mapping[str, JsonValue]:
        """Values of its study by dotted name."""
        return self.case.first.process.study.inputs()

    @cached_property
    def load_maps(self) -> Mapping[int, Floats]:
        """Mean normal load of each packing by depth and azimuth, N."""
        return {seed: _load_map(study) for seed, study in self.by_seed.items()}


@dataclass(frozen=True)
class CaseDifference:
    """A quantity of a case beside that of the first one.

    Attributes
    ----------
    name : str
        Of the case.
    quantity : Quantity
    first, value : Estimate
        In the first case, and in this one.
    difference : Estimate
        Of the two; the interval is NaN where a single packing gives none.
    basis : str
        Whether both are as simulated, or from windows.
    paired : bool
        Whether it is the mean over packings that both cases have.
    """

    name: str
    quantity: Quantity
    first: Estimate
    value: Estimate
    difference: Estimate
    basis: str
    paired: bool

    @property
    def relative(self) -> Estimate:
        """The difference over the value in the first case: positive where this one is larger."""
        size = self.first.value
        return self.difference.over(size) if size else NOT_KNOWN

    @property
    def verdict(self) -> str:
        """Whether the interval excludes zero, and what that says of the magnitude."""
        if not self.difference.known or self.difference.contains(0.0):
            return "undecided" if self.difference.known else "no interval"
        return "larger" if self.relative.value > 0 else "smaller"


def differences(first: ComparedCase, other: ComparedCase) -> list[CaseDifference]:
    """Every quantity that two cases have."""
    rows = []
    for quantity in REPORTED:
        pair = [case.case.values.of(quantity.name) for case in (first, other)]
        if all(pair):
            rows.append(_difference(quantity, first, other))
    return rows


def _difference(quantity: Quantity, first: ComparedCase, other: ComparedCase) -> CaseDifference:
    standings = [standings_of(case, quantity) for case in (first, other)]
    corrected = all(standing.corrected for packings in standings for standing in packings.values())
    before, after = (_mean(case, quantity, corrected) for case in (first, other))
    numbers = [
        {seed: _number(standing, corrected).value for seed, standing in packings.items()}
        for packings in standings
    ]
    paired = len(numbers[0]) > 1 and numbers[0].keys() == numbers[1].keys()
    if paired:
        change = mean_of([numbers[1][seed] - numbers[0][seed] for seed in numbers[0]])
    else:
        half = math.hypot(before.half_width, after.half_width)
        change = Estimate.around(after.value - before.value, half)
    basis = str(next(iter(standings[0].values())).basis) if corrected else "as simulated"
    return CaseDifference(other.name, quantity, before, after, change, basis, paired)


def standings_of(case: ComparedCase, quantity: Quantity) -> dict[int, Standing]:
    """A quantity of each packing that has it, by seed."""
    standings = {seed: study.values.of(quantity.name) for seed, study in case.by_seed.items()}
    return {seed: standing for seed, standing in standings.items() if standing}


def _number(standing: Standing, corrected: bool) -> Estimate:
    return standing.shown if corrected else standing.run


def _mean(case: ComparedCase, quantity: Quantity, corrected: bool) -> Estimate:
    standing = case.case.values.of(quantity.name)
    assert standing is not None
    return _number(standing, corrected)


def _load_map(study: StudyRuns) -> Floats:
    """Load map of a run: that from its windows where it has one."""
    load_map = study.extrapolated.load_map if study.extrapolated else None
    if load_map is not None:
        return np.array(load_map.value).reshape(MAP_DEPTHS, MAP_AZIMUTHS)
    return np.array(study.measured.load_map).reshape(MAP_DEPTHS, MAP_AZIMUTHS)

"""Effects of factors on a quantity, from cases of which every combination of levels is one."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.compare.cases import ComparedCase, standings_of
from dragchain.errors import SeriesError
from dragchain.quantities.registry import Quantity
from dragchain.run.case import changed_inputs
from dragchain.statistics.bed_effects import Factors, fit_effects
from dragchain.statistics.estimate import Estimate


@dataclass(frozen=True)
class FactorEffect:
    """What a factor does to a quantity, or two of them together.

    Attributes
    ----------
    quantity : Quantity
    factors : tuple of str
        One: the change from its first level to another, averaged over the other factors.
        Two: half of the difference between the changes of the first factor at another and at the
        first level of the second.
    levels : tuple of str
        Of each factor: the two levels.
    effect : Estimate
    """

    quantity: Quantity
    factors: tuple[str, ...]
    levels: tuple[str, ...]
    effect: Estimate

    @property
    def words(self) -> Sequence[str]:
        """Each factor with its levels."""
        return [f"{name} ({both})" for name, both in zip(self.factors, self.levels, strict=True)]


def changed_between(cases: Sequence[ComparedCase]) -> dict[str, list[JsonValue]]:
    """Inputs but the seed that differ between cases, with the value of each case."""
    first, *others = (case.inputs for case in cases)
    names = {name for inputs in others for name in changed_inputs(inputs, first)} - {"seed"}
    return {name: [case.inputs.get(name) for case in cases] for name in sorted(names)}


def factors_of(cases: Sequence[ComparedCase]) -> dict[str, list[JsonValue]]:
    """Inputs that are set independently of each other, with the level of each case.

    Empty unless there are at least two, and every combination of their levels is a case.
    """
    levels_by_name = changed_between(cases)
    levels = [{repr(level) for level in column} for column in levels_by_name.values()]
    combined = {tuple(map(repr, row)) for row in zip(*levels_by_name.values(), strict=True)}
    crossed = len(combined) == math.prod(map(len, levels)) == len(cases)
    return levels_by_name if len(levels_by_name) > 1 and crossed else {}


def effects_of(
    cases: Sequence[ComparedCase], factors: Mapping[str, Sequence[JsonValue]], quantity: Quantity
) -> list[FactorEffect]:
    """Main effects and interactions of two factors on a quantity, by least squares.

    Every combination of levels has a coefficient of its own, so that no shape of the response is
    assumed; numbers are ordered, others are as they come. A packing that all cases share is a
    block. Where too few runs remain for the scatter, the effects of single factors are added up.
    """
    levels = {name: _levels(column) for name, column in factors.items()}
    settings = [dict(zip(factors, map(str, row), strict=True))
                for row in zip(*factors.values(), strict=True)]  # fmt: skip
    values = [
        (number, seed, standing.run.value)
        for number, case in enumerate(cases)
        for seed, standing in standings_of(case, quantity).items()
    ]
    if len({number for number, *_ in values}) < len(cases):
        return []
    numbers, seeds, measured = zip(*values, strict=True)
    if not 0.0 < np.ptp(measured) < math.inf:
        return []
    shared = all(case.by_seed.keys() == cases[0].by_seed.keys() for case in cases)
    packings = list(dict.fromkeys(seeds))[1:] if shared else []
    blocks = np.array([[float(seed == packing) for packing in packings] for seed in seeds])
    reference = {name: known[0] for name, known in levels.items()}
    for additive in (False, True):
        model = Factors([settings[number] for number in numbers], reference, additive)
        design = np.hstack([model.design(), blocks])
        with suppress(SeriesError):
            fit = fit_effects(design, np.array(measured), range(len(design)))
            break
    else:
        return []
    of_cases = np.array([model.row(setting) for setting in settings])
    terms = [[name] for name in levels] + ([] if additive else [*combinations(levels, 2)])
    effects = []
    for term in terms:
        for others in product(*(levels[name][1:] for name in term)):
            change = {name: (reference[name], other)
                      for name, other in zip(term, others, strict=True)}  # fmt: skip
            weights = np.append(_contrast(of_cases, settings, change), np.zeros(len(packings)))
            words = tuple(" to ".join(both) for both in change.values())
            effects.append(FactorEffect(quantity, tuple(change), words, fit.estimate(weights)))
    return effects


def _levels(column: Sequence[JsonValue]) -> list[str]:
    """What the levels of a factor are called, numbers in their order."""
    if all(isinstance(level, int | float) for level in column):
        column = sorted(column, key=lambda level: float(str(level)))
    return list(dict.fromkeys(map(str, column)))


def _contrast(
    of_cases: Floats, settings: Sequence[Mapping[str, str]], change: Mapping[str, tuple[str, str]]
) -> Floats:
    """Weights of coefficients: from the first levels to others, averaged over other factors."""
    weights = np.zeros(of_cases.shape[1])
    for ends in product((0, 1), repeat=len(change)):
        levels = {name: change[name][end] for name, end in zip(change, ends, strict=True)}
        alike = [setting.items() >= levels.items() for setting in settings]
        weights += (-1) ** (len(change) - sum(ends)) * of_cases[alike].mean(axis=0)
    return weights / len(change)  # of an interaction, half

"""Effects of settings on a quantity, estimated from runs that partly share beds.

A run's value is the sum of the effects of its settings, of its bed and of
chance. Runs that start from the same bed are alike to some degree; how much is
estimated too, so that pairing counts exactly as much as it helps.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.shared_bed import Effects, Whitened, alike, same

Combination = tuple[tuple[str, Hashable], ...]
"""Factors and their levels, those of the reference left out."""

_LARGEST_FRACTION = 0.98
"""Largest fraction of the variance that a bed is allowed to explain."""


@dataclass(frozen=True)
class Fit(Effects):
    """Effects of settings.

    Attributes
    ----------
    residual_std : float
        Standard deviation of one run about its settings' effects, bed included.
    bed_fraction : float
        The part of that variance which runs from the same bed have in common.
    residuals : (N,) ndarray
        Whitened: independent and of equal variance if the model is right.
    """

    residual_std: float
    bed_fraction: float
    residuals: Floats


def fit_effects(
    design: Floats, values: Floats, beds: Sequence[Hashable], bed_fraction: float | None = None
) -> Fit:
    """Generalised least squares with a random effect of the bed.

    The covariance of two runs is ``s^2`` for a run with itself, ``r s^2`` for
    runs from the same bed and zero otherwise; ``r`` maximises the restricted
    likelihood (Patterson and Thompson 1971, Biometrika 58, 545-554).

    Parameters
    ----------
    design : (N, P) ndarray
        Of full column rank.
    values : (N,) ndarray
    beds : sequence of N labels
    bed_fraction : float, optional
        ``r``, if it is known.

    Raises
    ------
    SeriesError
        If there are not more runs than effects, or effects cannot be told apart.
    """
    runs, number = design.shape
    if runs <= number:
        raise SeriesError(f"{runs} runs are too few to estimate {number} effects: run more seeds")
    if np.linalg.matrix_rank(design) < number:
        raise SeriesError("the effects are confounded: vary one setting at a time as well")
    same_bed = same(beds)
    if bed_fraction is None:
        shared = len(set(beds)) < runs
        bed_fraction = _best_fraction(design, values, same_bed) if shared else 0.0
    model = Whitened.of(design, values, alike(same_bed, bed_fraction))
    variance = float(model.residuals @ model.residuals) / model.degrees
    covariance = np.asarray(variance * model.covariance)
    std = float(np.sqrt(variance))
    return Fit(model.effects, covariance, model.degrees, std, bed_fraction, model.residuals)


def _best_fraction(design: Floats, values: Floats, same_bed: Floats) -> float:
    """The fraction of the beds that maximises the restricted likelihood at the best variance."""

    def loss(fraction: float) -> float:
        model = Whitened.of(design, values, alike(same_bed, fraction))
        return model.log_determinants + 0.5 * model.degrees * math.log(max(model.square, 1e-300))

    found = minimize_scalar(loss, bounds=(0.0, _LARGEST_FRACTION), method="bounded")
    return float(found.x) if found.fun < loss(0.0) else 0.0


@dataclass(frozen=True)
class Factors:
    """How the settings of runs become columns of a design matrix.

    Attributes
    ----------
    settings : sequence of N mappings
        Factor to level, for each run.
    reference : mapping
        The levels that have no column of their own.
    additive : bool
        A column for every level of every factor; else one for every combination.
    apart : frozenset of combinations
        Those that have a column of their own all the same, and take no part in others.
    """

    settings: Sequence[Mapping[str, Hashable]]
    reference: Mapping[str, Hashable]
    additive: bool
    apart: frozenset[Combination] = frozenset()

    @cached_property
    def columns(self) -> list[Combination]:
        """What each column after the first stands for: one level, or one combination."""
        terms = (term for setting in self.settings for term in self._terms(setting))
        return list(dict.fromkeys(terms))

    def _terms(self, setting: Mapping[str, Hashable]) -> list[Combination]:
        """The columns that are 1 for a setting, besides the first."""
        own = self.combination(setting)
        if self.additive and own not in self.apart:
            return [(pair,) for pair in own]
        return [own] * bool(own)

    def combination(self, setting: Mapping[str, Hashable]) -> Combination:
        """The levels of a setting that are not those of the reference."""
        return tuple((f, setting[f]) for f in self.reference if setting[f] != self.reference[f])

    def row(self, setting: Mapping[str, Hashable]) -> Floats:
        """Row of the design matrix for some settings, (1 + columns,)."""
        terms = self._terms(setting)
        return np.array([1.0, *(float(column in terms) for column in self.columns)])

    def tells(self, setting: Mapping[str, Hashable]) -> bool:
        """Whether the runs had what a row for these settings stands for."""
        return all(term in self.columns for term in self._terms(setting))

    def design(self) -> Floats:
        """The design matrix, (N, 1 + columns)."""
        return np.array([self.row(setting) for setting in self.settings])


def lack_of_fit(additive: Fit, full: Fit) -> float:
    """Probability of so much disagreement with additivity by chance alone.

    F test of the sum of squares that the interactions explain against what is
    left with them. Both fits must have used the same `bed_fraction`. 1 if the two
    models are the same, or if nothing is left to test against.
    """
    more = additive.degrees - full.degrees
    left = full.residuals @ full.residuals / full.degrees
    if more == 0 or left == 0.0:
        return 1.0
    explained = (additive.residuals @ additive.residuals - full.residuals @ full.residuals) / more
    return float(stats.f.sf(explained / left, more, full.degrees))

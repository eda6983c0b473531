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
from scipy.optimize import minimize_scalar

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.shared_bed import (
    Effects,
    Whitened,
    alike,
    free_degrees,
    same,
    shares_beds,
)

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
    """

    residual_std: float
    bed_fraction: float


def fit_effects(
    design: Floats, values: Floats, beds: Sequence[Hashable], bed_fraction: float | None = None
) -> Fit:
    """Generalised least squares with a random effect of the bed.

    The covariance of two runs is ``s^2`` for a run with itself, ``r s^2`` for
    runs from the same bed and zero otherwise; ``r`` maximises the restricted
    likelihood (Patterson and Thompson 1971, Biometrika 58, 545-554). It is zero if too few
    runs are left to estimate it, which makes differences on the same beds less certain.

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
    same_bed, degrees = same(beds), runs - number
    if bed_fraction is None:
        bed_fraction, left = 0.0, free_degrees(beds, number)
        if shares_beds(beds) and left >= 1:
            bed_fraction, degrees = _best_fraction(design, values, same_bed), left
    model = Whitened.of(design, values, alike(same_bed, bed_fraction))
    variance = model.square / model.degrees
    covariance = np.asarray(variance * model.covariance)
    return Fit(model.effects, covariance, degrees, math.sqrt(variance), bed_fraction)


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
    """

    settings: Sequence[Mapping[str, Hashable]]
    reference: Mapping[str, Hashable]
    additive: bool

    @cached_property
    def columns(self) -> list[Combination]:
        """What each column after the first stands for: one level, or one combination."""
        terms = (term for setting in self.settings for term in self._terms(setting))
        return list(dict.fromkeys(terms))

    def _terms(self, setting: Mapping[str, Hashable]) -> list[Combination]:
        """The columns that are 1 for a setting, besides the first."""
        own = tuple((f, setting[f]) for f in self.reference if setting[f] != self.reference[f])
        return [(pair,) for pair in own] if self.additive else [own] * bool(own)

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

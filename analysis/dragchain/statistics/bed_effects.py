"""Effects of settings on a quantity, estimated from runs that partly share beds.

A run's value is the sum of the effects of its settings, of its bed and of
chance. Runs that start from the same bed are alike to some degree; how much is
estimated too, so that pairing counts exactly as much as it helps.

How much those have in common is estimated by the restricted likelihood (Patterson and Thompson
1971, Biometrika 58, 545). Runs that share no bed make it ordinary least squares.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import Estimate, student_quantile, t_interval

Combination = tuple[tuple[str, Hashable], ...]
"""Factors and their levels, those of the reference left out."""

_LARGEST_FRACTION = 0.98
"""Largest fraction of the variance that a bed is allowed to explain."""


@dataclass(frozen=True)
class EffectsFit:
    """Effects of settings, with their covariance.

    Attributes
    ----------
    effects : (P,) ndarray
    covariance : (P, P) ndarray
    degrees : int
        Degrees of freedom of an interval.
    residual_std : float
        Standard deviation of one run about its settings' effects, bed included.
    bed_fraction : float
        The part of that variance which runs from the same bed have in common.
    """

    effects: Floats
    covariance: Floats
    degrees: int
    residual_std: float
    bed_fraction: float

    @property
    def quantile(self) -> float:
        """Half-width of a 95 % interval in standard errors, of Student's t."""
        return student_quantile(self.degrees)

    def contrast(self, weights: ArrayLike) -> tuple[float, float]:
        """A combination of the effects, weights (P,), and its standard error."""
        row = np.asarray(weights, dtype=np.float64)
        variance = float(row @ self.covariance @ row)
        return float(row @ self.effects), float(np.sqrt(max(variance, 0.0)))

    def estimate(self, weights: ArrayLike) -> Estimate:
        """A combination of the effects, weights (P,), with its interval."""
        return t_interval(*self.contrast(weights), self.degrees)


def fit_effects(design: Floats, values: Floats, beds: Sequence[Hashable]) -> EffectsFit:
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
    codes = np.unique([str(bed) for bed in beds], return_inverse=True)[1]
    same_bed = np.asarray(codes[:, None] == codes, dtype=np.float64)
    bed_fraction, degrees, count = 0.0, runs - number, int(codes.max()) + 1
    # what the runs from one bed have in common is estimated from the same runs: where it is much,
    # an effect is as good as one of the differences within the beds
    left = degrees - (count - 1)
    if 1 < count < runs and left >= 1:

        def loss(fraction: float) -> float:
            solution = _solved(design, values, same_bed, fraction)
            square = max(solution.square, 1e-300)
            return float(solution.log_determinants + 0.5 * (runs - number) * math.log(square))

        optimum = minimize_scalar(loss, bounds=(0.0, _LARGEST_FRACTION), method="bounded")
        bed_fraction = float(optimum.x) if optimum.fun < loss(0.0) else 0.0
        degrees = left
    solution = _solved(design, values, same_bed, bed_fraction)
    variance = solution.square / (runs - number)
    covariance = np.asarray(variance * solution.covariance)
    return EffectsFit(solution.effects, covariance, degrees, math.sqrt(variance), bed_fraction)


class _Solution(NamedTuple):
    """Effects, their covariance for a variance of one, and the sum of squares that they leave.

    `log_determinants` is what the restricted likelihood takes off: half of the sum of ``ln |V|``
    and ``ln |X' V^-1 X|``, V the covariance and X the design.
    """

    effects: Floats
    covariance: Floats
    square: float
    log_determinants: float


def _solved(design: Floats, values: Floats, same_bed: Floats, fraction: float) -> _Solution:
    """Least squares of runs of which those from the same bed share a part of their variance."""
    root = np.linalg.cholesky((1.0 - fraction) * np.eye(len(values)) + fraction * same_bed)
    white, known = (np.linalg.solve(root, part) for part in (design, values))
    effects = np.linalg.lstsq(white, known, rcond=None)[0]
    triangle = np.linalg.qr(white)[1]
    logs = np.log(np.diag(root)).sum() + np.log(np.abs(np.diag(triangle))).sum()
    square = float(np.sum((known - white @ effects) ** 2))
    return _Solution(effects, np.linalg.inv(white.T @ white), square, float(logs))


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
        changed = tuple((f, setting[f]) for f in self.reference if setting[f] != self.reference[f])
        return [(pair,) for pair in changed] if self.additive else [changed] * bool(changed)

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

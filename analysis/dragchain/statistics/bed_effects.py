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

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import Estimate, student_quantile, t_interval


def same(labels: Sequence[Hashable]) -> Floats:
    """1 where two runs have the same label, else 0, (N, N)."""
    numbers = {label: number for number, label in enumerate(dict.fromkeys(labels))}
    codes = np.array([numbers[label] for label in labels])
    return np.asarray(codes[:, None] == codes[None, :], dtype=np.float64)


def shares_beds(beds: Sequence[Hashable]) -> bool:
    """Whether there are several beds, and some have several runs."""
    return 1 < len(set(beds)) < len(beds)


def free_degrees(beds: Sequence[Hashable], effects: int) -> int:
    """Degrees of freedom that some effects leave of N runs; beds that are shared take theirs.

    What the runs from one bed have in common is estimated from the same runs. Where it is much,
    an effect is as good as one of the differences within the beds, of which there are as many
    fewer as there are beds, minus one.
    """
    return len(beds) - effects - (len(set(beds)) - 1 if shares_beds(beds) else 0)


def correlation(same_bed: Floats, fraction: float) -> Floats:
    """Covariance of runs of which those from the same bed share a part, over the variance."""
    return np.asarray((1.0 - fraction) * np.eye(len(same_bed)) + fraction * same_bed)


@dataclass(frozen=True)
class Whitened:
    """A linear model whose residuals are independent and of equal variance.

    Attributes
    ----------
    root : (N, N) ndarray
        Lower Cholesky factor of the covariance.
    design : (N, P) ndarray
    values : (N,) ndarray
        Design and values, each multiplied by the inverse of `root`.
    """

    root: Floats
    design: Floats
    values: Floats

    @classmethod
    def of(cls, design: Floats, values: Floats, covariance: Floats) -> "Whitened":
        """Whiten a design (N, P) and values (N,) by their covariance (N, N)."""
        root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        left, right = (np.linalg.solve(root, part) for part in (design, values))
        return cls(root, np.asarray(left), np.asarray(right))

    @cached_property
    def effects(self) -> Floats:
        """The effects by least squares, (P,)."""
        solution = np.linalg.lstsq(self.design, self.values, rcond=None)[0]
        return np.asarray(solution, dtype=np.float64)

    @cached_property
    def residuals(self) -> Floats:
        """What the effects leave, (N,)."""
        return np.asarray(self.values - self.design @ self.effects)

    @cached_property
    def square(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals**2))

    @property
    def degrees(self) -> int:
        """Runs less effects."""
        return int(len(self.values) - self.design.shape[1])

    @property
    def covariance(self) -> Floats:
        """Covariance of the effects for a variance of one, (P, P)."""
        return np.asarray(np.linalg.inv(self.design.T @ self.design))

    @property
    def log_determinants(self) -> float:
        """What the restricted likelihood takes off for the covariance and for the effects.

        Half of the sum of ``ln |V|`` and ``ln |X' V^-1 X|``, V the covariance and X the design.
        """
        _, triangle = np.linalg.qr(self.design)
        return float(np.log(np.diag(self.root)).sum() + np.log(np.abs(np.diag(triangle))).sum())


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
    same_bed, bed_fraction, degrees = same(beds), 0.0, runs - number
    left = free_degrees(beds, number)
    if shares_beds(beds) and left >= 1:
        bed_fraction, degrees = _best_fraction(design, values, same_bed), left
    model = Whitened.of(design, values, correlation(same_bed, bed_fraction))
    variance = model.square / model.degrees
    covariance = np.asarray(variance * model.covariance)
    return EffectsFit(model.effects, covariance, degrees, math.sqrt(variance), bed_fraction)


def _best_fraction(design: Floats, values: Floats, same_bed: Floats) -> float:
    """The fraction of the beds that maximises the restricted likelihood at the best variance."""

    def loss(fraction: float) -> float:
        model = Whitened.of(design, values, correlation(same_bed, fraction))
        return model.log_determinants + 0.5 * model.degrees * math.log(max(model.square, 1e-300))

    optimum = minimize_scalar(loss, bounds=(0.0, _LARGEST_FRACTION), method="bounded")
    return float(optimum.x) if optimum.fun < loss(0.0) else 0.0


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

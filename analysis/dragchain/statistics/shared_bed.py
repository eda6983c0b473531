"""Generalised least squares of runs, some of which start from the same bed.

How much those have in common is estimated by the restricted likelihood (Patterson and Thompson
1971, Biometrika 58, 545), which differs with what else is known: `bed_effects` estimates one
variance of all runs, `power_law` what comes on top of each run's known error.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from dragchain.arrays import Floats
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


def alike(same_bed: Floats, fraction: float) -> Floats:
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
        left, right = (np.linalg.solve(root, one) for one in (design, values))
        return cls(root, np.asarray(left), np.asarray(right))

    @cached_property
    def effects(self) -> Floats:
        """The effects by least squares, (P,)."""
        found = np.linalg.lstsq(self.design, self.values, rcond=None)[0]
        return np.asarray(found, dtype=np.float64)

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


@dataclass(frozen=True)
class Effects:
    """Effects of a linear model with their covariance.

    Attributes
    ----------
    effects : (P,) ndarray
    covariance : (P, P) ndarray
    degrees : int
        Degrees of freedom of an interval.
    """

    effects: Floats
    covariance: Floats
    degrees: int

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

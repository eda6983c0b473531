"""Laws of two terms beside a power law: a sum of two powers, and a power of a shifted level."""

from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats
from dragchain.statistics.estimate import Estimate
from dragchain.statistics.power_law import Linear, PowerLaw, compare_with_levels, solve


@dataclass(frozen=True)
class TwoTerms:
    """``value = a x^n + b x^(n-1)`` with a given n.

    Attributes
    ----------
    power : float
        n.
    leading, lower : Estimate
        a and b.
    lower_fraction : Estimate
        Part of the value at the highest level that the lower term makes.
    lack_of_fit : float or None
        As for a power law.
    """

    power: float
    leading: Estimate
    lower: Estimate
    lower_fraction: Estimate
    lack_of_fit: float | None


@dataclass(frozen=True)
class Shifted:
    """``value = a (x + offset)^n`` with a given n.

    Attributes
    ----------
    power : float
        n.
    root_slope, root_constant : float
        The root of the value is ``root_slope x + root_constant``.
    offset : Estimate or None
        By Fieller's theorem, in the unit of x; None if its interval is not bounded.
    lack_of_fit : float or None
        As for a power law.
    """

    power: float
    root_slope: float
    root_constant: float
    offset: Estimate | None
    lack_of_fit: float | None

    def at(self, x: float) -> float:
        """The value at a level; zero where the line is below."""
        return float(max(self.root_slope * x + self.root_constant, 0.0) ** self.power)


def fit_two_terms(law: PowerLaw, power: float) -> TwoTerms:
    """Fit a sum of two powers, in place of one power with a free exponent.

    Residuals are relative to the mean of the level, so that they scatter as the
    logarithms of a power law do.

    Parameters
    ----------
    law : PowerLaw
        The power law fitted to the same runs.
    power : float
        The higher power.
    """
    runs = law.runs
    terms = np.column_stack([runs.x**power, runs.x ** (power - 1.0)])
    fit, lack = _fit_terms(law, terms, 1.0)
    top = runs.levels[-1]
    return TwoTerms(
        power=power,
        leading=fit.estimate([1.0, 0.0]),
        lower=fit.estimate([0.0, 1.0]),
        lower_fraction=_fraction(fit, np.array([top**power, top ** (power - 1.0)])),
        lack_of_fit=lack,
    )


def fit_shifted(law: PowerLaw, power: float) -> Shifted:
    """Fit a given power of a shifted x: the root of the value is a straight line.

    Parameters
    ----------
    law : PowerLaw
        The power law fitted to the same runs.
    power : float
        n, not zero.
    """
    x = law.runs.x
    fit, lack = _fit_terms(law, np.column_stack([x, np.ones(len(x))]), 1.0 / power)
    slope, constant = (float(effect) for effect in fit.effects)
    return Shifted(power, slope, constant, _ratio(fit), lack)


def _fit_terms(law: PowerLaw, terms: Floats, root: float) -> tuple[Linear, float | None]:
    """Fit terms (N, 2) to a root of the values, relative to the levels, and test their lack."""
    runs = law.runs
    size = np.exp(root * (runs.each_level() @ law.means.effects))
    design, relative = terms / size[:, None], runs.values**root / size
    covariance = root**2 * runs.covariance(law.scatter)
    fit = solve(design, relative, covariance, runs.degrees(2))
    tested = compare_with_levels(runs, design, relative, root**2)
    return fit, None if tested is None else tested.lack_of_fit


def _ratio(fit: Linear) -> Estimate | None:
    """Second effect over the first with its interval (Fieller 1954, J. R. Stat. Soc. B 16, 175)."""
    (a, b), v, t2 = fit.effects, fit.covariance, fit.quantile**2
    square = a * a - t2 * v[0, 0]
    linear = -2.0 * (a * b - t2 * v[0, 1])
    rest = b * b - t2 * v[1, 1]
    inside = linear * linear - 4.0 * square * rest
    if square <= 0.0 or inside < 0.0:
        return None
    low, high = (float((-linear + sign * np.sqrt(inside)) / (2.0 * square)) for sign in (-1, 1))
    return Estimate(float(b / a), low, high)


def _fraction(fit: Linear, sizes: Floats) -> Estimate:
    """Part of the second term in the sum, each effect times a size; to first order."""
    first, second = fit.effects * sizes
    total = first + second
    slope = np.array([-second * sizes[0], first * sizes[1]]) / total**2
    half = fit.quantile * float(np.sqrt(slope @ fit.covariance @ slope))
    return Estimate.around(float(second / total), half)

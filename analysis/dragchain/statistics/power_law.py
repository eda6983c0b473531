"""A power law fitted to the means of runs that partly share beds.

The logarithm of a run's mean is the sum of the law, of what its bed and chance
bring, and of the error of a mean over a finite path. The last is known for each
run; how large the others are is estimated from all runs together.
"""

import itertools
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import stats
from scipy.optimize import minimize

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.bed_effects import (
    Effects,
    Whitened,
    correlation,
    free_degrees,
    same,
    shares_beds,
)
from dragchain.statistics.estimate import Estimate

_LEAST_LEVELS = 3
"""A line through two levels always fits."""

_LARGEST_FRACTION = 0.9
"""Largest fraction of the variance that a bed is allowed to explain."""

_SPREADS = (1e-4, 2.0)
"""Limits of the standard deviation between runs, in logarithms."""


@dataclass(frozen=True)
class Linear(Effects):
    """Effects of a linear model by generalised least squares.

    Attributes
    ----------
    square : float
        Sum of the squared whitened residuals.
    """

    square: float


@dataclass(frozen=True)
class Scatter:
    """How the logarithms of runs scatter about a model.

    Attributes
    ----------
    spread : float
        Standard deviation between runs, beside the errors of their means.
    bed_fraction : float
        The part of that variance which runs from the same bed have in common.
    """

    spread: float
    bed_fraction: float


@dataclass(frozen=True)
class RunMeans:
    """What a fit is made from: N runs.

    Attributes
    ----------
    x, values : (N,) ndarray
        Level of the varied field and mean of each run, both positive.
    errors : (N,) ndarray
        Standard error of each mean, relative, from its own autocorrelation.
    beds : sequence of N labels
        Runs with the same label start from the same bed.

    Raises
    ------
    SeriesError
        If a value is not positive, or there are too few levels or runs.
    """

    x: Floats
    values: Floats
    errors: Floats
    beds: Sequence[Hashable]

    def __post_init__(self) -> None:
        numbers = np.array([self.x, self.values, self.errors])
        if not (np.isfinite(numbers).all() and (numbers[:2] > 0.0).all()):
            raise SeriesError(
                "a power law requires levels and means that are finite and above zero"
            )
        if len(self.levels) < _LEAST_LEVELS:
            raise SeriesError(
                f"{len(self.levels)} level(s) are too few to test a power law: use "
                f"{_LEAST_LEVELS} or more"
            )
        if self.degrees(2) < 1:
            raise SeriesError(
                f"{len(self.x)} runs are too few to estimate the scatter: run more seeds"
            )

    @cached_property
    def levels(self) -> Floats:
        """The different levels, rising, (L,)."""
        return np.unique(self.x)

    @cached_property
    def logarithms(self) -> Floats:
        """Logarithms of the means, (N,)."""
        return np.log(self.values)

    @cached_property
    def same_bed(self) -> Floats:
        """1 where two runs start from the same bed, else 0, (N, N)."""
        return same(self.beds)

    def degrees(self, effects: int) -> int:
        """Degrees of freedom that some effects leave."""
        return free_degrees(self.beds, effects)

    def line(self) -> Floats:
        """Design of a power law: constant and ln(x / geometric mean of the levels), (N, 2)."""
        return np.column_stack([np.ones(len(self.x)), np.log(self.x / self.centre)])

    @property
    def centre(self) -> float:
        """Geometric mean of the levels."""
        return float(np.exp(np.mean(np.log(self.levels))))

    def each_level(self) -> Floats:
        """Design with a mean of its own for every level, (N, L)."""
        return np.asarray(self.x[:, None] == self.levels[None, :], dtype=np.float64)

    def covariance(self, scatter: Scatter) -> Floats:
        """Covariance of the logarithms, (N, N)."""
        between = correlation(self.same_bed, scatter.bed_fraction)
        return np.asarray(scatter.spread**2 * between + np.diag(self.errors**2))

    def within(self, low: float, high: float) -> "RunMeans":
        """The runs whose level is from `low` to `high`."""
        inside = (self.x >= low) & (self.x <= high)
        beds = [bed for bed, one in zip(self.beds, inside, strict=True) if one]
        return RunMeans(self.x[inside], self.values[inside], self.errors[inside], beds)


def estimate_scatter(runs: RunMeans, design: Floats) -> Scatter:
    """Scatter about a linear model by restricted likelihood.

    Patterson and Thompson 1971, Biometrika 58, 545; with known errors of the
    single values it is the random-effects model of meta-analysis.
    """

    def loss(parameters: Floats) -> float:
        scatter = Scatter(float(np.exp(parameters[0])), float(parameters[1]))
        model = Whitened.of(design, runs.logarithms, runs.covariance(scatter))
        return 2.0 * model.log_determinants + model.square

    least, most = (float(limit) for limit in np.log(_SPREADS))
    fraction = _LARGEST_FRACTION if shares_beds(runs.beds) else 0.0
    trials = itertools.product(np.linspace(least, most, 12)[1:-2], {0.0, 0.5 * fraction})
    start = min((np.array(trial) for trial in trials), key=loss)
    found = minimize(loss, start, bounds=[(least, most), (0.0, fraction)], method="L-BFGS-B")
    return Scatter(float(np.exp(found.x[0])), float(found.x[1]))


def solve(design: Floats, values: Floats, covariance: Floats, degrees: int) -> Linear:
    """Generalised least squares, its covariance scaled by the residuals.

    The scale is that of Knapp and Hartung 2003, Statistics in Medicine 22, 2693:
    with it Student's t holds though the scatter was estimated from few runs. It is
    never below 1 (Roever, Knapp and Friede 2015, BMC Med. Res. Methodol. 15, 99):
    a few runs that happen to agree do not make their own errors smaller.
    """
    model = Whitened.of(design, values, covariance)
    scale = max(1.0, model.square / model.degrees)
    return Linear(model.effects, np.asarray(scale * model.covariance), degrees, model.square)


@dataclass(frozen=True)
class PowerLaw:
    """``value = a x^n`` fitted to runs.

    Attributes
    ----------
    runs : RunMeans
    line : Linear
        Effects: logarithm of the value at the centre of the levels, and n.
    means : Linear
        One logarithm a level; its interval comes from the runs of equal level
        where there are enough, else from the residuals of the line.
    scatter : Scatter
        About the line.
    lack_of_fit : float or None
        Probability of so much disagreement with a power law by chance alone;
        None if no level has runs enough to tell.
    """

    runs: RunMeans
    line: Linear
    means: Linear
    scatter: Scatter
    lack_of_fit: float | None

    @property
    def exponent(self) -> Estimate:
        """The exponent n."""
        return self.line.estimate([0.0, 1.0])

    def at(self, x: float) -> Estimate:
        """The value of the law at a level."""
        return self.line.estimate([1.0, float(np.log(x / self.runs.centre))]).exp()

    def level(self, number: int) -> Estimate:
        """The mean of one level, whatever the law."""
        return self.means.estimate(np.eye(len(self.runs.levels))[number]).exp()

    def local_exponents(self) -> list[Estimate]:
        """Exponents between neighbouring levels, L - 1 of them."""
        units = np.eye(len(self.runs.levels))
        steps = np.diff(np.log(self.runs.levels))
        return [
            self.means.estimate((above - below) / step)
            for (below, above), step in zip(pairwise(units), steps, strict=True)
        ]

    def deviation(self, number: int) -> Estimate | None:
        """Relative difference of one level from the law of the others; None if too few runs."""
        runs, degrees = self.runs, self.runs.degrees(3)
        if degrees < 1:
            return None
        design = np.column_stack([runs.line(), runs.each_level()[:, number]])
        covariance = runs.covariance(estimate_scatter(runs, design))
        found = solve(design, runs.logarithms, covariance, degrees)
        return found.estimate([0.0, 0.0, 1.0]).exp(minus=1.0)


def fit_power_law(runs: RunMeans) -> PowerLaw:
    """Fit a power law to runs, and test whether it holds.

    The test compares the residuals of the law with those of a mean for every
    level (lack-of-fit F test), at the scatter that the latter leave.

    Returns
    -------
    PowerLaw
    """
    design = runs.line()
    scatter = estimate_scatter(runs, design)
    line = solve(design, runs.logarithms, runs.covariance(scatter), runs.degrees(2))
    means, lack = compare_with_levels(runs, design, runs.logarithms)
    return PowerLaw(runs, line, means or _level_means(runs, scatter, line), scatter, lack)


def compare_with_levels(
    runs: RunMeans, design: Floats, values: Floats, scale: float = 1.0
) -> tuple[Linear, float] | tuple[None, None]:
    """Test a law of two effects by the means of the levels.

    Parameters
    ----------
    runs : RunMeans
    design : (N, 2) ndarray
        Of the law.
    values : (N,) ndarray
        What it is fitted to.
    scale : float
        Factor of the covariance of the runs' logarithms that is that of the values.

    Returns
    -------
    means : Linear or None
        A mean of its own for every level; None if too few runs repeat a level.
    lack_of_fit : float or None
        Probability of so much disagreement with the law by chance alone, by an F test.
    """
    free = runs.degrees(len(runs.levels))
    if free < 1:
        return None, None
    single = runs.each_level()
    covariance = scale * runs.covariance(estimate_scatter(runs, single))
    means = solve(single, values, covariance, free)
    straight = solve(design, values, covariance, runs.degrees(2))
    return means, _lack_of_fit(straight, means, runs)


def _level_means(runs: RunMeans, scatter: Scatter, line: Linear) -> Linear:
    """Means of levels without repetition, with the scatter about the line."""
    model = Whitened.of(runs.each_level(), runs.logarithms, runs.covariance(scatter))
    scale = max(1.0, line.square / (len(runs.x) - 2))
    return Linear(model.effects, np.asarray(scale * model.covariance), line.degrees, 0.0)


def _lack_of_fit(straight: Linear, means: Linear, runs: RunMeans) -> float:
    more = len(runs.levels) - 2
    left = means.square / (len(runs.x) - len(runs.levels))
    if left == 0.0:
        return 0.0 if straight.square > 0.0 else 1.0
    ratio = (straight.square - means.square) / more / left
    return float(stats.f.sf(max(ratio, 0.0), more, means.degrees))


@dataclass(frozen=True)
class TwoTerms:
    """``value = a x^n + b x^(n-1)`` with a given n.

    Attributes
    ----------
    power : float
        n.
    lower_fraction : Estimate
        Part of the value at the highest level that the lower term makes.
    lack_of_fit : float or None
        As for a power law.
    """

    power: float
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
    return fit, compare_with_levels(runs, design, relative, root**2)[1]


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

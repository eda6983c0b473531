"""Means of a correlated series, and functions of such means, with their uncertainty.

A ratio, a fraction or a profile follows from the means of several columns of sums over frames in a
row. To first order, its error is that of one series: the columns of each frame about their means,
weighted by how fast the function changes with each. That series has the interval of
`estimate_mean`, so there is one rule for means and for what follows from means (delta method:
Oehlert 1992, Am. Stat. 46, 27).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from dragchain.arrays import Floats, Ints
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import Estimate, student_quantile

MIN_SAMPLES = 8
"""Fewer samples carry no autocorrelation worth estimating."""

_WINDOW = 5.0
"""Lags are summed up to this many autocorrelation times (Sokal 1997, section 3)."""

SLOW_WAVES = 8
"""Cosines of the lowest frequencies that tell of slow fluctuations, see `slow_error`."""

_SLOWER = 1.4
"""Ratio of variances of the mean that 8 cosines of a series exceed by chance in 20 % of cases."""

RELIABLE_TIMES = 10.0
"""The interval of a series shorter than this many autocorrelation times is not reliable."""


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of a correlated series of N samples.

    Attributes
    ----------
    mean, std : float
        Mean and standard deviation (divisor N - 1), in the unit of the series.
    samples : int
        N.
    autocorrelation_samples : float
        Integrated autocorrelation time, in samples; 1/2 for independent ones.
    effective_samples : float
        Number of independent samples with the same standard error of the mean.
    se : float
        Standard error of the mean, in the unit of the series.
    ci95_low, ci95_high : float
        Confidence interval of the mean.
    reliable : bool
        Whether the series is at least 10 autocorrelation times long and not
        constant. If not, the interval is probably too narrow.
    """

    mean: float
    std: float
    samples: int
    autocorrelation_samples: float
    effective_samples: float
    se: float
    ci95_low: float
    ci95_high: float
    reliable: bool

    @property
    def estimate(self) -> Estimate:
        """The mean with its interval."""
        return Estimate(self.mean, self.ci95_low, self.ci95_high, reliable=self.reliable)

    def over(self, below: "MeanEstimate") -> Estimate:
        """The ratio to an independent mean: relative half-widths add up as squares do."""
        above, under = (
            0.5 * (estimate.ci95_high - estimate.ci95_low) / estimate.mean
            for estimate in (self, below)
        )
        value, reliable = self.mean / below.mean, self.reliable and below.reliable
        half = abs(value) * math.hypot(above, under)
        return Estimate(value, value - half, value + half, reliable=reliable)


def estimate_mean(series: ArrayLike) -> MeanEstimate:
    """Estimate the mean of a correlated series and its confidence interval.

    The standard error is ``std / sqrt(n)`` with ``n = N / (2 tau)`` (Sokal 1997,
    section 2). The autocorrelation time is itself estimated: its relative variance is
    ``2 (2 W + 1) / N`` (Sokal 1997, section 3), which is that of a variance with
    ``N / (2 W + 1)`` degrees of freedom. The interval uses Student's t with these, at least 1.
    A fluctuation that is slow and weak beside a fast one is not within W: if the variance by
    `slow_error` is larger by more than `_SLOWER`, the wider of both intervals holds.

    Parameters
    ----------
    series : (N,) array_like
        Samples at equal intervals, at least 8.

    Returns
    -------
    MeanEstimate
        Mean, standard error, confidence interval and autocorrelation time.

    Raises
    ------
    SeriesError
        If there are too few samples, or one is not finite.
    """
    samples = _checked(series)
    count = len(samples)
    mean, std = float(samples.mean()), float(samples.std(ddof=1))
    tau, window = _time_and_window(samples)
    effective = count / (2.0 * tau)
    error = std / np.sqrt(effective)
    slow, slow_degrees = slow_error(samples)
    half = student_quantile(max(count / (2 * window + 1), 1.0)) * error
    if slow**2 > _SLOWER * error**2:
        half = max(half, student_quantile(slow_degrees) * slow)
    return MeanEstimate(
        mean=mean,
        std=std,
        samples=count,
        autocorrelation_samples=tau,
        effective_samples=effective,
        se=float(error),
        ci95_low=float(mean - half),
        ci95_high=float(mean + half),
        reliable=bool(np.ptp(samples) > 0.0 and count >= RELIABLE_TIMES * tau),
    )


def slow_error(series: ArrayLike) -> tuple[float, int]:
    """Standard error of a mean from the slowest fluctuations of the series alone.

    The amplitudes of the cosines of the lowest frequencies are independent and have the
    variance of the mean times N, whatever the correlation, if the series is long beside it
    (Mueller 2007, J. Econometrics 141, 1331; Lazarus et al. 2018, J. Bus. Econ. Stat. 36, 541).

    Parameters
    ----------
    series : (N,) array_like
        Samples at equal intervals.

    Returns
    -------
    se : float
        In the unit of the series.
    degrees : int
        Degrees of freedom: the number of cosines, 8 or N - 1 if that is less.
    """
    samples = np.asarray(series, dtype=np.float64)
    amplitudes = slow_waves(len(samples)) @ samples
    return float(np.sqrt(np.mean(amplitudes**2) / len(samples))), len(amplitudes)


@lru_cache(maxsize=1)
def slow_waves(count: int) -> Floats:
    """Orthonormal cosines of the lowest frequencies, the constant left out, (8, count)."""
    number = np.arange(1, min(SLOW_WAVES, count - 1) + 1)
    phase = np.pi * (np.arange(count) + 0.5) / count
    return np.asarray(np.sqrt(2.0 / count) * np.cos(number[:, None] * phase))


def _time_and_window(samples: Floats) -> tuple[float, int]:
    """Integrated autocorrelation time of a series in samples, and the lag W at which its sum ends.

    ``tau = 1/2 + sum of rho(t) for t = 1 ... W`` with rho the normalised
    autocovariance and W the smallest lag that is at least 5 tau (Sokal 1997,
    section 3), times ``(1 + (2 W + 1) / N) / (1 + 1 / N)`` against the bias from
    the mean being estimated too (Wolff 2004, equation 49). It is never below the 1/2 of
    independent samples, which is also that of a constant series.

    References
    ----------
    Sokal (1997), Monte Carlo methods in statistical mechanics, in Functional
    Integration, NATO ASI B 361, Springer. Wolff (2004), Monte Carlo errors with
    less errors, Comput. Phys. Commun. 156, 143-153.
    """
    if np.ptp(samples) == 0.0:
        return 0.5, 0
    covariance = autocovariance(samples)
    sums = np.cumsum(covariance) / covariance[0] - 0.5
    window = int(np.argmax(np.arange(len(sums)) >= _WINDOW * sums))
    count = len(samples)
    unbiased = (1.0 + (2 * window + 1) / count) / (1.0 + 1.0 / count)
    return max(0.5, float(sums[window]) * unbiased), window


def autocovariance(series: ArrayLike) -> Floats:
    """Autocovariance of a series about its mean, by fast Fourier transform.

    Parameters
    ----------
    series : (N,) array_like
        Samples at equal intervals.

    Returns
    -------
    (N,) ndarray
        ``sum of (x_i - m)(x_(i+t) - m) / (N - t)`` for the lags t = 0 ... N - 1.
    """
    samples = np.asarray(series, dtype=np.float64)
    count = len(samples)
    spectrum = np.fft.rfft(samples - samples.mean(), n=2 * count)
    products = np.fft.irfft(np.abs(spectrum) ** 2, n=2 * count)[:count]
    return np.asarray(products / np.arange(count, 0, -1))


def _checked(series: ArrayLike) -> Floats:
    samples = np.asarray(series, dtype=np.float64)
    if samples.ndim != 1 or len(samples) < MIN_SAMPLES:
        raise SeriesError(
            f"the series has shape {samples.shape}, but statistics require {MIN_SAMPLES} "
            "samples in a"
            " row; use a longer path or a shorter transient"
        )
    if not np.isfinite(samples).all():
        bad = int(np.flatnonzero(~np.isfinite(samples))[0])
        raise SeriesError(f"sample {bad} of the series is not a finite number: {samples[bad]}")
    return samples


_STEP = 1e-6
"""Step of the numerical slopes, over the root mean square of a column."""

_ROUNDING = 1e-9

LARGEST_REACH = 0.6
"""An interval that reaches further, over a sum that is never negative, is not reliable.

The sum then comes from a few dozen events, and its distribution is too skew for Student's t.
"""


def estimates(sums: Floats, statistic: Callable[[Floats], Floats]) -> list[Estimate]:
    """Return statistics of mean frame sums with their intervals.

    The ends of an interval are the values of the statistic where the means are moved as far as
    the interval of its series reaches, each column in proportion to its covariance with that
    series. A ratio thus keeps its skewness. Sums that are never negative stay so. An interval that
    does not contain its value is not known: that of a ratio whose lower sum may be zero.

    Parameters
    ----------
    sums : (n, k) array
        Sums of each frame, in the order of time.
    statistic
        Function of (..., k) mean sums that returns (..., m) numbers.

    Raises
    ------
    SeriesError
        If there are too few frames.
    """
    if len(sums) < MIN_SAMPLES:
        raise SeriesError(
            f"a confidence interval requires at least {MIN_SAMPLES} frames; there are {len(sums)}"
        )
    means = sums.mean(axis=0)
    centred = sums - means
    least = np.where((sums >= 0.0).all(axis=0), 0.0, -np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = statistic(means)
        series = centred @ _slopes(sums, means, statistic)
        mean_estimates = [
            estimate_mean(column) if np.isfinite(column).all() else None for column in series.T
        ]
        reach = [mean.ci95_high - mean.mean if mean else np.nan for mean in mean_estimates]
        shares = np.nan_to_num(centred.T @ series / np.sum(series**2, axis=0))
        moves = (shares * reach).T
        low, high = (
            np.diagonal(statistic(np.maximum(means + sign * moves, least))) for sign in (-1.0, 1.0)
        )
        beyond = np.maximum(low - values, values - high) > _ROUNDING * np.abs(values)
    low, high = (np.where(beyond, np.nan, end) for end in (low, high))
    few = ((least == 0.0) & (np.abs(moves) > LARGEST_REACH * means)).any(axis=1)
    reliable = [mean is not None and mean.reliable for mean in mean_estimates] & ~few
    ends = zip(values.tolist(), low.tolist(), high.tolist(), reliable.tolist(), strict=True)
    return [Estimate(*end, reliable=sure) for *end, sure in ends]


def _slopes(sums: Floats, means: Floats, statistic: Callable[[Floats], Floats]) -> Floats:
    """How fast each number of a statistic changes with each mean, (k, m)."""
    size = np.sqrt(np.mean(sums**2, axis=0))
    step = _STEP * np.where(size > 0.0, size, 1.0)
    above, below = (statistic(means + sign * np.diag(step)) for sign in (1.0, -1.0))
    return np.asarray((above - below) / (2.0 * step[:, None]))


def frame_sums(frame: Ints, frames: int, weights: Floats) -> Floats:
    """Add rows of `weights`, (c, k), up to the frames they belong to, (frames, k)."""
    return np.stack([np.bincount(frame, column, frames) for column in weights.T], axis=1)

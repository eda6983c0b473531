"""The mean of a correlated series and its uncertainty."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import CONFIDENCE, student_quantile

MIN_SAMPLES = 8
"""Fewer samples carry no autocorrelation worth estimating."""

_WINDOW = 5.0
"""Lags are summed up to this many autocorrelation times (Sokal 1997, section 3)."""

RELIABLE_TIMES = 50.0
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
    confidence : float
        Confidence level of the interval.
    reliable : bool
        Whether the series is at least 50 autocorrelation times long and not
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
    confidence: float
    reliable: bool


def estimate_mean(series: ArrayLike, *, confidence: float = CONFIDENCE) -> MeanEstimate:
    """Estimate the mean of a correlated series and its confidence interval.

    The standard error is ``std / sqrt(n)`` with ``n = N / (2 tau)`` (Sokal 1997,
    section 2). The interval uses Student's t with n - 1 degrees of freedom, at least 1.

    Parameters
    ----------
    series : (N,) array_like
        Samples at equal intervals, at least 8.
    confidence : float
        Level of the interval, between 0 and 1.

    Returns
    -------
    MeanEstimate
        Mean, standard error, confidence interval and autocorrelation time.

    Raises
    ------
    SeriesError
        If there are too few samples, one is not finite, or `confidence` is not
        between 0 and 1.
    """
    samples = _checked(series)
    if not 0.0 < confidence < 1.0:
        raise SeriesError(f"the confidence must lie between 0 and 1, but is {confidence}")
    count = len(samples)
    mean, std = float(samples.mean()), float(samples.std(ddof=1))
    tau = autocorrelation_time(samples)
    effective = count / (2.0 * tau)
    error = std / np.sqrt(effective)
    quantile = student_quantile(max(effective - 1.0, 1.0), confidence)
    return MeanEstimate(
        mean=mean,
        std=std,
        samples=count,
        autocorrelation_samples=tau,
        effective_samples=effective,
        se=float(error),
        ci95_low=float(mean - quantile * error),
        ci95_high=float(mean + quantile * error),
        confidence=confidence,
        reliable=bool(np.ptp(samples) > 0.0 and count >= RELIABLE_TIMES * tau),
    )


def autocorrelation_time(series: ArrayLike) -> float:
    """Integrated autocorrelation time of a series.

    ``tau = 1/2 + sum of rho(t) for t = 1 ... W`` with rho the normalised
    autocovariance and W the smallest lag that is at least 5 tau (Sokal 1997,
    section 3), times ``(1 + (2 W + 1) / N) / (1 + 1 / N)`` against the bias from
    the mean being estimated too (Wolff 2004, equation 49).

    Parameters
    ----------
    series : (N,) array_like
        Samples at equal intervals, at least 8.

    Returns
    -------
    float
        tau in samples, never below the 1/2 of independent samples, which is
        also returned for a constant series.

    Raises
    ------
    SeriesError
        If there are too few samples or one is not finite.

    References
    ----------
    Sokal (1997), Monte Carlo methods in statistical mechanics, in Functional
    Integration, NATO ASI B 361, Springer. Wolff (2004), Monte Carlo errors with
    less errors, Comput. Phys. Commun. 156, 143-153.
    """
    samples = _checked(series)
    if np.ptp(samples) == 0.0:
        return 0.5
    covariance = autocovariance(samples)
    sums = np.cumsum(covariance) / covariance[0] - 0.5
    window = int(np.argmax(np.arange(len(sums)) >= _WINDOW * sums))
    count = len(samples)
    unbiased = (1.0 + (2 * window + 1) / count) / (1.0 + 1.0 / count)
    return max(0.5, float(sums[window]) * unbiased)


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

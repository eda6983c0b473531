"""Functions of the means of sums over frames in a row, with their intervals.

A ratio, a fraction or a profile follows from the means of several columns. To first order, its
error is that of one series: the columns of each frame about their means, weighted by how fast
the function changes with each. That series has the interval of `estimate_mean`, so there is one
rule for means and for what follows from means (delta method: Oehlert 1992, Am. Stat. 46, 27).
"""

from collections.abc import Callable

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.errors import SeriesError
from dragchain.statistics.correlated import MIN_SAMPLES, estimate_mean
from dragchain.statistics.estimate import Estimate

_STEP = 1e-6
"""Step of the numerical slopes, over the root mean square of a column."""

LARGEST_REACH = 0.6
"""An interval that reaches further, over a sum that is never negative, is not reliable.

The sum then comes from a few dozen events, and its distribution is too skew for Student's t.
"""


def estimates(sums: Floats, statistic: Callable[[Floats], Floats]) -> list[Estimate]:
    """Return statistics of mean frame sums with their intervals.

    The ends of an interval are the values of the statistic where the means are moved as far as
    the interval of its series reaches, each column in proportion to its covariance with that
    series. A ratio thus keeps its skewness. Sums that are never negative stay so.

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
        found = [estimate_mean(one) if np.isfinite(one).all() else None for one in series.T]
        reach = [one.ci95_high - one.mean if one else np.nan for one in found]
        shares = np.nan_to_num(centred.T @ series / np.sum(series**2, axis=0))
        moves = (shares * reach).T
        low, high = (
            np.diagonal(statistic(np.maximum(means + sign * moves, least))) for sign in (-1.0, 1.0)
        )
    few = ((least == 0.0) & (np.abs(moves) > LARGEST_REACH * means)).any(axis=1)
    reliable = [one is not None and one.reliable for one in found] & ~few
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

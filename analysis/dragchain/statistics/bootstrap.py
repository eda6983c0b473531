"""Intervals of statistics of frames in a row, by a circular block bootstrap.

Whatever is sampled along the path is autocorrelated; resampling blocks of frames (Politis and
Romano 1992) does not take neighbouring frames for independent.
"""

from collections.abc import Callable

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.errors import SeriesError
from dragchain.statistics.correlated import MIN_SAMPLES, autocorrelation_time
from dragchain.statistics.estimate import CONFIDENCE, Estimate

_RESAMPLES = 2000
_SEED = 20150101


def block_length(sums: Floats) -> int:
    """A block length that outlasts the memory of every column, (n, k) frames in a row.

    Four times the largest integrated autocorrelation time (1/2 for independent frames), but no
    less than the cube root of n and no more than a quarter of it.
    """
    count = len(sums)
    longest = max(autocorrelation_time(column) for column in sums.T)
    return int(np.clip(np.ceil(4.0 * longest), np.ceil(count ** (1 / 3)), count // 4))


def bootstrap_means(sums: Floats, length: int, resamples: int = _RESAMPLES) -> Floats:
    """Return resampled column means by circular blocks (Politis and Romano 1992).

    Parameters
    ----------
    sums : (n, k) array
        One row a frame, in the order of time.
    length
        Frames in a block, 1 to n.

    Returns
    -------
    (resamples, k) array
        The same for the same input: the generator's seed is fixed.
    """
    count = len(sums)
    total = np.vstack([np.zeros(sums.shape[1]), np.cumsum(np.vstack([sums, sums]), axis=0)])
    block_means = (total[length : length + count] - total[:count]) / length
    blocks = -(-count // length)
    starts = np.random.default_rng(_SEED).integers(0, count, (resamples, blocks))
    return np.asarray(np.stack([block_means[row].mean(axis=0) for row in starts]))


def estimates(sums: Floats, statistic: Callable[[Floats], Floats]) -> list[Estimate]:
    """Return statistics of mean frame sums with their percentile intervals.

    Parameters
    ----------
    sums : (n, k) array
        Sums of each frame, in the order of time.
    statistic
        Function of (..., k) mean sums that returns (..., m) numbers.

    Raises
    ------
    SeriesError
        If there are too few frames to resample in blocks.
    """
    if len(sums) < MIN_SAMPLES:
        raise SeriesError(
            f"a confidence interval requires at least {MIN_SAMPLES} frames; there are {len(sums)}"
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        value = statistic(sums.mean(axis=0))
        resampled = statistic(bootstrap_means(sums, block_length(sums)))
    return [
        Estimate(number, *_interval(column))
        for number, column in zip(value.tolist(), resampled.T, strict=True)
    ]


def _interval(resampled: Floats) -> tuple[float, float]:
    """The percentile interval of the resamples that have a value, NaN if none has."""
    known = resampled[~np.isnan(resampled)]
    if not known.size:
        return float("nan"), float("nan")
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(known, [tail, 1.0 - tail], method="nearest")
    return float(low), float(high)


def frame_sums(frame: Ints, frames: int, weights: Floats) -> Floats:
    """Add rows of `weights`, (c, k), up to the frames they belong to, (frames, k)."""
    return np.stack([np.bincount(frame, column, frames) for column in weights.T], axis=1)

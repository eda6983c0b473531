"""A quantity at physical stiffness from windows, and how many windows it takes."""

import math
from collections.abc import Sequence

import numpy as np

from dragchain.arrays import Floats
from dragchain.statistics.estimate import Estimate, student_quantile, t_interval


def scatter(blocks: Floats, windows: Sequence[float]) -> tuple[float, float]:
    """Relative standard deviation of one window, and its degrees of freedom.

    Pooled from the blocks of the soft run, which are as long as a window's sample, and from the
    windows themselves.
    """
    found = [np.asarray(blocks, dtype=np.float64), np.asarray(windows, dtype=np.float64)]
    sums = [float(((one / one.mean() - 1) ** 2).sum()) for one in found if one.size > 1]
    degrees = sum(one.size - 1 for one in found if one.size > 1)
    return (math.sqrt(sum(sums) / degrees), degrees) if degrees else (math.nan, 0)


def joined(blocks: Floats, windows: Sequence[float]) -> Estimate:
    """The mean at physical stiffness with its interval."""
    relative, degrees = scatter(blocks, windows)
    mean = float(np.mean(windows))
    return t_interval(mean, abs(mean) * relative / math.sqrt(len(windows)), degrees)


def needed(blocks: Floats, windows: Sequence[float], tolerance: float) -> int:
    """How many windows bring the half-width of the interval to a relative tolerance."""
    relative, degrees = scatter(blocks, windows)
    if not degrees:
        return len(windows) + 1
    return max(1, math.ceil((student_quantile(degrees) * relative / tolerance) ** 2))

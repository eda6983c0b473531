"""The blocks of a quantity along the path of a run, and the one estimator of all quantities.

A run's value is the mean over its blocks, each with the weight of what it counts (samples,
contacts, chains). To first order, the error of such a ratio of sums is that of the series of the
blocks' deviations times their weights (delta method: Oehlert 1992, Am. Stat. 46, 27). Blocks of one
particle diameter depend little on any but their neighbours (`Known.correlation`), which a process
of first order describes.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dragchain.arrays import Floats
from dragchain.quantities.registry import Quantity
from dragchain.statistics.correlated import LARGEST_REACH
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate, student_quantile
from dragdeck.records.windows import UNKNOWN, Known


@dataclass(frozen=True)
class Blocks:
    """Values of B blocks and what each counts, (B,) each; NaN with weight 0 where there is none."""

    values: Floats
    weights: Floats

    @classmethod
    def ratio(cls, above: ArrayLike, below: ArrayLike) -> "Blocks":
        """Ratios of sums, (B,) each; the mean over blocks is the ratio of the whole sums."""
        sums, weights = (np.asarray(of, dtype=np.float64) for of in (above, below))
        with np.errstate(invalid="ignore", divide="ignore"):
            return cls(np.where(weights > 0.0, sums / weights, math.nan), weights)

    def part(self, which: slice) -> "Blocks":
        """Some of the blocks."""
        return Blocks(self.values[which], self.weights[which])

    def between(self, first: float, last: float) -> "Blocks":
        """The blocks of a stretch, which may begin and end inside of one: in lengths of a block."""
        number = np.arange(len(self.values))
        share = (np.minimum(number + 1.0, last) - np.maximum(number, first)).clip(0.0, 1.0)
        return Blocks(self.values, self.weights * share)

    @property
    def mean(self) -> float:
        """The mean over the blocks that have a value; NaN if there is none."""
        counted = self.weights > 0.0
        if not counted.any():
            return math.nan
        return float(np.average(self.values[counted], weights=self.weights[counted]))

    def means(self, count: int) -> Floats:
        """The means of equal parts of the path, NaN where one has no value, (count,)."""
        parts = (np.array_split(of, count) for of in (self.values, self.weights))
        return np.array([Blocks(*part).mean for part in zip(*parts, strict=True)])

    @property
    def series(self) -> Floats:
        """What each block says of the mean, (B,): a block without a value says nothing new."""
        mean, share = self.mean, self.weights / self.weights.mean()
        return mean + np.where(share > 0.0, share * (self.values - mean), 0.0)


FEWEST = 4
"""Blocks of the shortest paths. They are shorter than a diameter, so that their neighbours are more
alike than those of other scenes; an interval of so few is not reliable."""

_LARGEST = 0.8
"""Correlation of neighbours at which a path is too short for an interval."""

_PRIOR_BLOCKS = 20
"""Blocks' worth of evidence that runs of other scenes are on the correlation of neighbours."""


def neighbour_correlation(series: Floats) -> float:
    """Correlation of neighbours in a series, corrected for its bias (Kendall 1954).

    Parameters
    ----------
    series : (N,) ndarray
        At least four values, not all the same.
    """
    count, away = len(series), series - series.mean()
    seen = float(away[1:] @ away[:-1]) / float(away @ away)
    return (seen + 1.0 / count) / (1.0 - 3.0 / count)


def half_width_of_mean(series: Floats, known: float) -> tuple[float, bool]:
    """Half-width of the interval of the mean of a series, and whether it is reliable.

    The variance of independent values is multiplied by ``(1 + r) / (1 - r)`` (Zwiers and von
    Storch 1995, J. Climate 8, 336), with r the correlation of neighbours: that of the series
    (`neighbour_correlation`), joined with the known one in proportion to the number of blocks
    behind each, and not below 0.

    Parameters
    ----------
    series : (N,) ndarray
        At least two values.
    known : float
        Correlation of neighbours in runs of other scenes.
    """
    count, variance, neighbours = len(series), float(series.var(ddof=1)), known
    if count >= FEWEST and variance:
        seen = neighbour_correlation(series)
        joined = (count * seen + _PRIOR_BLOCKS * known) / (count + _PRIOR_BLOCKS)
        neighbours = min(max(joined, 0.0), _LARGEST)
    variance *= (1.0 + neighbours) / (1.0 - neighbours) / count
    reliable = count > FEWEST and variance > 0.0 and neighbours < _LARGEST
    return student_quantile(count - 1) * math.sqrt(variance), reliable


def estimate_of(quantity: Quantity, blocks: Blocks, known: Known = UNKNOWN) -> Estimate:
    """A run's value with its interval; see `half_width_of_mean`.

    The interval is not known for a single block, or if the quantity is zero all along; it is not
    reliable if the path is short (4 blocks at most), or if the interval reaches so far that the
    value comes from a few events.

    Parameters
    ----------
    quantity : Quantity
    blocks : Blocks
        Of which one at least has a value.
    known : Known
        Of runs of other scenes. Their scatter from packing to packing adds to that along the path,
        which belongs to one packing.
    """
    mean, series = blocks.mean, blocks.series
    value = quantity.of_mean(mean)
    if len(series) < 2 or value == 0.0:
        return Estimate(value, math.nan, math.nan, reliable=False)
    half, reliable = half_width_of_mean(series, known.correlation)
    if quantity.kind == "odds":
        estimate = Estimate.around(mean, half).within_one.mapped(quantity.of_mean)
    else:  # the root of a mean has half of its relative error
        half = half / (2.0 * value) if quantity.squared else half
        between = NORMAL_QUANTILE * known.packing_std * abs(value)
        estimate = Estimate.around(value, math.hypot(half, between))
    negative = bool((blocks.values < 0.0).any())
    rare = not negative and estimate.half_width > LARGEST_REACH * value
    return replace(estimate, reliable=reliable and not rare)

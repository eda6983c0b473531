"""How long to drag: what a run knows of a quantity, how it drifts, and what chance shows."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from dragchain.arrays import Floats
from dragchain.statistics.correlated import autocovariance
from dragchain.statistics.estimate import CONFIDENCE, NORMAL_QUANTILE, student_quantile
from dragchain.tradeoff.measures import QUANTITIES, Measurand
from dragchain.tradeoff.outcome import Tradeoff


@dataclass(frozen=True)
class Reach:
    """How well a run of some path knows a quantity.

    Attributes
    ----------
    quantity : Measurand
    halfwidth : float
        Relative half-width of the 95 % interval of one run over the common path.
    arc_m : float
        That path, m.
    block_m : float
        Length of a block: nothing is known of shorter paths, m.
    """

    quantity: Measurand
    halfwidth: float
    arc_m: float
    block_m: float

    def at(self, path_m: float) -> float:
        """The half-width at another path; it falls with its root."""
        return self.halfwidth * math.sqrt(self.arc_m / path_m)

    def path_m(self, tolerance: float) -> float:
        """The path at which one run knows the quantity within a tolerance, m."""
        return float(self.arc_m * (self.halfwidth / tolerance) ** 2)

    def seeds(self, tolerance: float) -> int:
        """Runs over the common path, each on its own bed, that know it as well together."""
        return max(1, math.ceil((self.halfwidth / tolerance) ** 2))


def reaches(tradeoff: Tradeoff) -> list[Reach]:
    """How well runs know the quantities that have blocks along the path."""
    along_path = {name for run in tradeoff.runs for name in run.measures.blocks}
    block_m = float(np.median([run.measures.block_m for run in tradeoff.runs if run.complete]))
    return [
        Reach(
            quantity,
            NORMAL_QUANTILE * tradeoff.comparisons[quantity.name].run_std,
            tradeoff.arc_m,
            block_m,
        )
        for quantity in QUANTITIES
        if quantity.name in tradeoff.comparisons and quantity.name in along_path
    ]


@dataclass(frozen=True)
class Along:
    """How a quantity behaves along the path of the longest runs.

    Attributes
    ----------
    blocks : int
        In each of them.
    runs : int
    correlation : list of float
        Between blocks 1, 2 and 3 apart.
    drift : float
        Second half less first half of the path, relative to the whole; of a
        quantity that may change its sign, in mean drags.
    drift_halfwidth : float
        Of its interval of `CONFIDENCE`; NaN for a single run.
    """

    blocks: int
    runs: int
    correlation: list[float]
    drift: float
    drift_halfwidth: float


def along(tradeoff: Tradeoff, quantity: Measurand) -> Along | None:
    """How a quantity changes along the path; None if runs are too short for that."""
    complete = [run.measures for run in tradeoff.runs if run.complete]
    longest = max(measures.arc_m for measures in complete)
    pairs = [
        (own.of_blocks(quantity.name), own.of_blocks("drag_mean"))
        for own in complete
        if own.arc_m > 0.99 * longest
    ]
    pairs = [(own, drag) for own, drag in pairs if len(own) >= 8 and np.isfinite(own).all()]
    if not pairs:
        return None
    covariance = np.sum([autocovariance(own)[:4] for own, _ in pairs], axis=0)
    drifts = np.array([_drift(quantity, own, drag) for own, drag in pairs])
    error = stats.sem(drifts) if len(drifts) > 1 else math.nan
    return Along(
        blocks=len(pairs[0][0]),
        runs=len(pairs),
        correlation=[float(value) for value in covariance[1:] / covariance[0]],
        drift=float(drifts.mean()),
        drift_halfwidth=float(student_quantile(max(len(drifts) - 1, 1)) * error),
    )


def _drift(quantity: Measurand, blocks: Floats, drag: Floats) -> float:
    half = len(blocks) // 2
    scale = drag.mean() if quantity.signed else quantity.of_blocks(blocks)
    change = quantity.of_blocks(blocks[-half:]) - quantity.of_blocks(blocks[:half])
    return float(change / abs(scale))


@dataclass(frozen=True)
class Chance:
    """How many differences to the reference were tested, and how many are significant.

    Attributes
    ----------
    tested, significant : int
    expected : int
        Significant ones if there were no differences.
    """

    tested: int
    significant: int
    expected: int


def chance(tradeoff: Tradeoff) -> Chance:
    """How many differences are significant, and how many chance alone would make so."""
    errors = [
        error
        for comparison in tradeoff.comparisons.values()
        for setting, error in comparison.errors.items()
        if setting != tradeoff.reference
    ]
    significant = sum(error.significant for error in errors)
    expected = round((1.0 - CONFIDENCE) * len(errors))
    return Chance(len(errors), significant, expected)

"""Runs whose drag follows the strength of their chains as much as a test wants."""

import numpy as np

from dragchain.arrays import Floats
from dragchain.drag import find_drag_peaks
from evidence.validation.peaks import ChainSeries, PeakFindings, peak_findings

FRAMES = 400
INTERVAL_S = 0.01
COUNT = 1999
"""Shifts: Holm's adjustment for 5 tests of the smallest p-value, 1 in 2000, is 0.0025."""


def wander(rng: np.random.Generator, count: int = FRAMES) -> Floats:
    """Return a series with memory: an autoregressive process of first order."""
    steps = rng.normal(size=count + 100)
    for at in range(1, len(steps)):
        steps[at] += 0.9 * steps[at - 1]
    return steps[100:]


def made_run(rng: np.random.Generator, pull: float) -> ChainSeries:
    """Return a run whose drag follows the strength of its chain by `pull`."""
    strength = np.exp(0.2 * wander(rng))
    drag = -pull * np.log(strength) / 0.2 + wander(rng)
    time_s = np.arange(FRAMES) * INTERVAL_S
    chains = {
        "strength": strength,
        "strength_over_surroundings": strength,
        "strength_over_drag": wander(rng),
    }
    peaks = find_drag_peaks(time_s, drag, min_separation_s=0.1)
    return ChainSeries("made", time_s, peaks.index, 0.1, chains)


def found_of(seed: int, pull: float, runs: int = 4) -> PeakFindings:
    """The findings of runs whose drag follows their chains by `pull`."""
    rng = np.random.default_rng(seed)
    return peak_findings([made_run(rng, pull) for _ in range(runs)], COUNT)

"""Runs whose drag follows the strength of their chains as much as a test wants."""

from functools import cache

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from evidence.validation.peaks.findings import Findings, study_of
from evidence.validation.peaks.lifetimes import lives
from evidence.validation.peaks.run_series import RunSeries
from evidence.validation.peaks.runs import peak_table
from evidence.validation.peaks.settings import SETTINGS

FRAMES = 400
INTERVAL_S = 0.01
COUNT = 1999
"""Shifts: Holm's adjustment for 40 tests of the smallest p-value, 1 in 2000, is 0.02."""


def wander(rng: np.random.Generator, count: int = FRAMES) -> Floats:
    """Return a series with memory: an autoregressive process of first order."""
    steps = rng.normal(size=count + 100)
    for at in range(1, len(steps)):
        steps[at] += 0.9 * steps[at - 1]
    return steps[100:]


def made_run(rng: np.random.Generator, pull: float, name: str = "made") -> RunSeries:
    """Return a run whose drag follows the strength of its chain by `pull`."""
    strength = np.exp(0.2 * wander(rng))
    noise = wander(rng)
    resistance = pull * np.log(strength) / 0.2 + noise
    time_s = np.arange(FRAMES) * INTERVAL_S
    particles = [[1, 2, 3 + at // 20] for at in range(FRAMES)]
    azimuth = rng.uniform(-1.0, 1.0, FRAMES)
    columns = pd.DataFrame(
        {
            "time_s": time_s, "resistance_n": resistance, "exists": np.ones(FRAMES),
            "particle_ids": particles, "bottleneck_n": strength, "bottleneck_over_mean": strength,
            "outer_over_mean": strength, "bottleneck_over_drag": wander(rng),
            "workpiece_fraction": wander(rng), "stands_out": strength, "particles": wander(rng),
            "straightness": wander(rng), "angle_rad": np.abs(azimuth), "azimuth_rad": azimuth,
            "inclination_rad": azimuth, "altitude_m": 0.03 + 0.01 * azimuth,
            **vars(lives(particles, time_s)),
        }
    )  # fmt: skip
    table = peak_table(time_s, -resistance, time_s, 0.1)
    return RunSeries(
        name, name, time_s, resistance, table, table, 0.1, 1, (columns,) * len(SETTINGS)
    )


@cache
def findings(seed: int, pull: float) -> Findings:
    """Of four runs whose drag follows their chains by `pull`."""
    rng = np.random.default_rng(seed)
    return study_of([made_run(rng, pull, str(number)) for number in range(4)], COUNT).findings

"""How often 95 % intervals of removal contain the true value of simulated processes.

    python benchmarks/removal_coverage.py docs/data/loading/removal_coverage.csv 1000

A process has 12 patches with different loads; in each packing its loads differ by 5 % together and
by 10 % each, and vary over time with a correlation of 20 samples. The coefficient is known with an
uncertainty of 10 %, or from a trial weighed to 5 %, or three. With one packing the true load is
that of the packing, since its interval excludes the scatter between packings.
"""

import sys

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from dragchain.report.removal import joined_half_width, patch_means, predict
from dragchain.statistics.correlated import estimate_mean, slow_error
from dragchain.statistics.estimate import Estimate, mean_of, student_quantile
from dragdeck.study.removal import Removal

TRUE_M2_N, DENSITY, TIME_S, PATCHES, FRAMES = 1e-15, 7800.0, 3600.0, 12, 1500
SETUPS = [(1, 0), (1, 1), (3, 0), (5, 1), (5, 3)]
"""Packings, and weighed trials; 0: the coefficient is given."""


def contained(random: np.random.Generator, packings: int, trials: int) -> dict[str, bool]:
    """Whether the intervals of one simulated process contain the truth."""
    loads, shape = np.exp(random.normal(0.0, 0.7, PATCHES)), (packings, PATCHES)
    levels = 1 + 0.05 * random.normal(size=(packings, 1)) + 0.1 * random.normal(size=shape)
    noise = lfilter([1.0], [1.0, -0.95], random.normal(size=(*shape, FRAMES)))
    series = (loads * levels)[..., None] * (1 + 0.25 * noise)
    true = loads * levels[0] if packings == 1 else loads
    totals = series.sum(axis=1)
    action = mean_of(totals.mean(axis=1)) if packings > 1 else estimate_mean(totals[0]).estimate
    lost = TRUE_M2_N * DENSITY * true.sum() * TIME_S
    weighed = lost * (1 + 0.05 * random.normal(size=trials))
    block = [{"mass_loss_kg": m, "time_s": TIME_S, "sd_kg": 0.05 * lost} for m in weighed]
    known = TRUE_M2_N * (1 + 0.1 * random.normal())
    given = (
        {"calibrate": block} if trials else {"coefficient_m2_n": known, "sd_m2_n": TRUE_M2_N / 10}
    )
    coefficient, rate = predict(
        Removal.model_validate(given), action, DENSITY, packings - 1 if packings > 1 else np.inf
    )
    errors = np.array([[slow_error(one)[0] for one in each] for each in series])
    mean, error, degrees = patch_means(series.mean(axis=2), errors)
    half = joined_half_width(student_quantile(degrees) * error, mean * rate.coefficient, degrees)
    depth = Estimate.around(mean[0], half[0])
    return {
        "volume": rate.combined.contains(TRUE_M2_N * true.sum()),
        "coefficient": coefficient.combined.contains(TRUE_M2_N),
        "depth of a patch": depth.over(1 / coefficient.value).contains(TRUE_M2_N * true[0]),
    }


def coverage(trials: int, seed: int = 1) -> pd.DataFrame:
    """How often each quantity's interval contains the truth, in each set-up."""
    random, rows = np.random.default_rng(seed), []
    for packings, weighed in SETUPS:
        found = pd.DataFrame([contained(random, packings, weighed) for _ in range(trials)]).mean()
        key = {"packings": packings, "weighed_trials": weighed, "trials": trials}
        rows += [{**key, "quantity": name, "coverage": each} for name, each in found.items()]
    return pd.DataFrame(rows)


if __name__ == "__main__":
    coverage(int(sys.argv[2])).to_csv(sys.argv[1], index=False, lineterminator="\n")

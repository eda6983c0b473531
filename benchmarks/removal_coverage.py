"""How often 95 % intervals of removal contain the true value of simulated processes.

    python benchmarks/removal_coverage.py docs/data/loading/removal_coverage.csv [--trials 2000]

A process has 12 patches with different loads; in each packing its loads differ by 5 % together and
by 10 % each, and vary over time with a correlation of 20 samples. The coefficient is known with an
uncertainty of 10 %, or from a trial weighed to 5 %, or three. With one packing the true load is
that of the packing, since its interval excludes the scatter between packings.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from dragchain.report.removal import patch_means, predict
from dragchain.statistics.correlated import estimate_mean, slow_error
from dragchain.statistics.estimate import Estimate, mean_of
from dragdeck.study.removal import Removal

TRUE_M2_N, DENSITY, TIME_S, PATCHES, FRAMES = 1e-15, 7800.0, 3600.0, 12, 1500
SETUPS = [(1, 0), (1, 1), (3, 0), (5, 1), (5, 3)]
"""Packings, and weighed trials; 0: the coefficient is given."""


def contained(random: np.random.Generator, packings: int, trials: int) -> dict[str, bool]:
    """Whether the intervals of one simulated process contain the truth."""
    loads = np.exp(random.normal(0.0, 0.7, PATCHES))
    levels = 1 + 0.05 * random.normal(size=(packings, 1)) + 0.1 * random.normal(
        size=(packings, PATCHES))  # fmt: skip
    noise = lfilter([1.0], [1.0, -0.95], random.normal(size=(packings, PATCHES, FRAMES)))
    series = (loads * levels)[..., None] * (1 + 0.25 * noise)
    true = loads * levels[0] if packings == 1 else loads
    totals = series.sum(axis=1)
    action = estimate_mean(totals[0]).estimate
    if packings > 1:
        action = mean_of(totals.mean(axis=1))
    lost = TRUE_M2_N * DENSITY * true.sum() * TIME_S
    weighed = [{"mass_loss_kg": lost * (1 + 0.05 * random.normal()), "time_s": TIME_S,
                "sd_kg": 0.05 * lost} for _ in range(trials)]  # fmt: skip
    given = {
        "coefficient_m2_n": TRUE_M2_N * (1 + 0.1 * random.normal()),
        "sd_m2_n": 0.1 * TRUE_M2_N,
    }
    law = Removal.model_validate({"calibrate": weighed} if trials else given)
    coefficient, rate = predict(law, action, DENSITY)
    errors = np.array([[slow_error(one)[0] for one in each] for each in series])
    mean, error, quantile = patch_means(series.mean(axis=2), errors)
    depth = Estimate.around(mean[0], np.hypot(quantile * error[0], mean[0] * rate.coefficient))
    return {
        "volume": rate.combined.contains(TRUE_M2_N * true.sum()),
        "coefficient": coefficient.combined.contains(TRUE_M2_N),
        "depth of a patch": depth.over(1 / coefficient.value).contains(TRUE_M2_N * true[0]),
    }


def rows(trials: int, seed: int = 1) -> list[dict[str, object]]:
    """Coverage of each quantity in each set-up."""
    random, found = np.random.default_rng(seed), list[dict[str, object]]()
    for packings, weighed in SETUPS:
        every = [contained(random, packings, weighed) for _ in range(trials)]
        for name in every[0]:
            coverage = float(np.mean([one[name] for one in every]))
            found.append({"packings": packings, "weighed_trials": weighed, "quantity": name,
                          "coverage": coverage, "trials": trials})  # fmt: skip
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--trials", type=int, default=2000)
    asked = parser.parse_args()
    with asked.out.open("w", newline="", encoding="utf-8") as stream:
        table = rows(asked.trials)
        writer = csv.DictWriter(stream, table[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)

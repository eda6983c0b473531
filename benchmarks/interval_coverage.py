"""How often an interval contains the true value, for every kind of interval, by simulation.

    OPENBLAS_NUM_THREADS=1 python benchmarks/interval_coverage.py --trials 1000

Each kind is a function of a generator and a length that returns an interval of a number that is
known, by the code that analyses runs; `KINDS` has them all, with their lengths. A length counts
autocorrelation times (a series shorter than that has half as many independent samples), packings
or contact events. Rows go to docs/data/benchmarks/coverage.csv; `docs/explanation/statistics.md`
shows them.
"""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "helpers"), str(ROOT / "studies" / "droptest")]

from make_record import Sensor, record_of  # noqa: E402
from paper_drops import FALL_S, HEIGHT, paper_drop, paper_drops  # noqa: E402

from dragchain.arrays import Floats  # noqa: E402
from dragchain.calibration.fit import calibrate  # noqa: E402
from dragchain.calibration.measured_impacts import measure_impacts  # noqa: E402
from dragchain.calibration.simulated_drops import Drops  # noqa: E402
from dragchain.loading.samples import (  # noqa: E402
    LEAST_EVENTS,
    Sampled,
    standard_errors,
)
from dragchain.statistics.bed_effects import Factors, fit_effects  # noqa: E402
from dragchain.statistics.correlated import (  # noqa: E402
    SLOW_WAVES,
    estimate_mean,
    estimates,
)
from dragchain.statistics.estimate import (  # noqa: E402
    NORMAL_QUANTILE,
    Estimate,
    mean_of,
    t_interval,
)
from dragchain.statistics.power_law import RunMeans, fit_power_law  # noqa: E402
from dragchain.tradeoff.measures import PathQuantities  # noqa: E402
from dragchain.windows.estimate import WindowOfRun, WindowsRecord  # noqa: E402
from dragchain.windows.rounds import judged  # noqa: E402

RECORD = ROOT / "docs" / "data" / "benchmarks" / "coverage.csv"

Random = np.random.Generator
Kind = Callable[[Random, int], tuple[Estimate, float]]
"""An interval of some length, and the number that it should contain."""

TAU = 8.0
"""Autocorrelation time of the simulated series, samples."""


# --- a single run ----------------------------------------------------------------------------


def series(random: Random, length: float, tau: float = TAU) -> Floats:
    """First-order autoregressive series of unit variance, so many of its times `TAU` long."""
    phi = (2.0 * tau - 1.0) / (2.0 * tau + 1.0)
    noise = random.normal(size=round(length * TAU)) * math.sqrt(1.0 - phi**2)
    noise[0] /= math.sqrt(1.0 - phi**2)
    return np.asarray(lfilter([1.0], [1.0, -phi], noise))


def mean(random: Random, length: int) -> tuple[Estimate, float]:
    """Mean of a run, with one memory."""
    return estimate_mean(series(random, length)).estimate, 0.0


def slow_mean(random: Random, length: int, part: float = 0.2) -> tuple[Estimate, float]:
    """Mean of a run of which a fifth of the variance is slow, the rest white, as of a number."""
    slow = series(random, length, (TAU - 0.5 * (1.0 - part)) / part)
    both = math.sqrt(part) * slow + math.sqrt(1.0 - part) * random.normal(size=len(slow))
    return estimate_mean(both).estimate, 0.0


def skewed_mean(random: Random, length: int) -> tuple[Estimate, float]:
    """Mean of a run whose logarithm is normal, with a standard deviation of 0.5."""
    return estimate_mean(np.exp(0.5 * series(random, length))).estimate, math.exp(0.125)


def ratio(random: Random, length: int) -> tuple[Estimate, float]:
    """Ratio of two sums over the frames of one run, as of the force ahead and behind."""
    ahead, behind = 5.0 + series(random, length), 1.5 + 0.5 * series(random, length)
    sums = np.column_stack([ahead, behind])
    return estimates(sums, lambda means: means[..., :1] / means[..., 1:])[0], 5.0 / 1.5


_FRAMES, _LASTS, _BINS = 2000, 5, 4


def hits(random: Random, events: int) -> tuple[Floats, Floats]:
    """Frame and force of contacts that begin at random, last 5 frames and differ in force."""
    count = random.poisson(events * (_FRAMES + _LASTS) / _FRAMES)
    start = random.integers(1 - _LASTS, _FRAMES, count)
    frame = (start[:, None] + np.arange(_LASTS)).ravel()
    force = np.repeat(random.exponential(size=count), _LASTS)
    inside = (frame >= 0) & (frame < _FRAMES)
    return frame[inside], force[inside]


def profile(random: Random, events: int) -> tuple[Estimate, float]:
    """A bin of a profile, with so many contact events in it."""
    frame, force = hits(random, events)
    sums = np.bincount(frame.astype(np.int64), force, _FRAMES)[:, None]
    true = events * _LASTS * (_FRAMES + _LASTS) / _FRAMES / (_FRAMES + _LASTS)
    return estimates(sums, lambda means: means)[0], true


def facet(random: Random, events: int) -> tuple[Estimate, float]:
    """The load on a facet, with so many contact events on it."""
    frame, force = hits(random, events)
    rows = pd.DataFrame({"frame": frame, "facet_id": 0, "load": force}).astype({"frame": np.int64})
    (error,) = standard_errors(Sampled(rows, _FRAMES, 1.0, 1.0, np.zeros(3)), "load", 1)
    found = t_interval(float(force.sum()), float(error), SLOW_WAVES)
    return replace(found, reliable=len(force) >= _LASTS * LEAST_EVENTS), float(events * _LASTS)


# --- several runs ----------------------------------------------------------------------------


def two_parts(random: Random, length: int) -> tuple[Estimate, float]:
    """Ratio of the mean drag of two parts of a run, as of a wake, each so long."""
    after, before = (estimate_mean(-2.5 + 0.6 * series(random, length)) for _ in range(2))
    return after.over(before), 1.0


def over_packings(random: Random, packings: int) -> tuple[Estimate, float]:
    """Mean over packings."""
    return mean_of(random.normal(size=packings)), 0.0


def effect(
    random: Random, packings: int, fraction: float = 0.5, interaction: float = 0.0
) -> tuple[Estimate, float]:
    """Effect of two settings that were changed together, in a plan of six combinations.

    `fraction` of a run's variance is that of its packing; what the settings do together differs
    from the sum of what they do by a random number of so many standard deviations of a run.
    """
    points = [{"modulus": m, "step": s} for m in (1.0, 0.1, 0.01) for s in (0.2, 0.5)]
    own = random.normal(0.0, interaction, len(points))
    bed = random.normal(0.0, math.sqrt(fraction), packings)
    rows = [(number, one) for number in range(len(points)) for one in range(packings)]
    chance = random.normal(0.0, math.sqrt(1.0 - fraction), len(rows))
    values = np.array([own[number] + bed[one] for number, one in rows]) + chance
    factors = Factors([points[number] for number, _ in rows], points[0], additive=False)
    fit = fit_effects(factors.design(), values, [one for _, one in rows])
    weights = factors.row(points[-1]) - factors.row(points[0])
    return fit.estimate(weights), float(own[-1] - own[0])


def difference(random: Random, packings: int) -> tuple[Estimate, float]:
    """Difference of two cases on the same packings, half of the variance common to both."""
    bed = np.tile(random.normal(0.0, math.sqrt(0.5), packings), 2)
    values = bed + random.normal(0.0, math.sqrt(0.5), 2 * packings)
    design = np.column_stack([np.ones(2 * packings), np.repeat([0.0, 1.0], packings)])
    fit = fit_effects(design, values, [*range(packings)] * 2)
    return fit.estimate([0.0, 1.0]), 0.0


def exponent(random: Random, packings: int, fraction: float = 0.3) -> tuple[Estimate, float]:
    """Exponent of a sweep over five levels."""
    x = np.repeat([10.0, 20.0, 30.0, 40.0, 50.0], packings)
    beds = [*range(packings)] * 5
    bed = random.normal(0.0, 0.06 * math.sqrt(fraction), packings)[beds]
    errors = 0.03 * random.uniform(0.5, 1.5, len(x))
    noise = bed + random.normal(0.0, 0.06 * math.sqrt(1.0 - fraction), len(x))
    values = np.exp(2.0 * np.log(x / 25.0) + noise + random.normal(0.0, errors))
    return fit_power_law(RunMeans(x, values, errors, beds)).exponent, 2.0


@cache
def _sweep() -> Drops:
    return paper_drops()


def calibration(random: Random, impacts: int) -> tuple[Estimate, float]:
    """Restitution from a noisy record of a drop whose height is known to 0.1 mm."""
    drop = paper_drop(0.68, height=HEIGHT + 1e-4 * random.normal())
    sensor = Sensor(500e3, 0.05, offset_n=4.0, drift_n_per_s=1.0, resolution_n=0.005)
    found = calibrate(
        measure_impacts(record_of(drop, sensor, random), fall_time_s=FALL_S), _sweep()
    )
    fit = found.fit_reference
    return Estimate(fit.restitution, fit.ci95_low, fit.ci95_high), 0.68


# --- all kinds -------------------------------------------------------------------------------


_TOLERANCE, _MOST_WINDOWS, _SOFT_BLOCKS = 0.1, 16, 18


def windows(
    random: Random, percent: int, name: str = "drag_mean", unlike: float = 0.0
) -> tuple[Estimate, float]:
    """A quantity from windows that stop at a tolerance, with so many percent of scatter each.

    The scene's ratio to the soft run is drawn from those of other scenes, or so many of their
    standard deviations away from them.
    """
    known = _windows_record().quantities[name]
    std = min(known.ratio_log_std, 0.15)
    ratio_log = known.ratio_log + std * (unlike or random.normal())
    packing, scatter = known.packing_std * random.normal(), 0.01 * percent
    variance_ratio = known.variance_ratio * random.chisquare(known.degrees) / known.degrees
    soft = 1.0 + scatter / math.sqrt(variance_ratio) * random.normal(size=_SOFT_BLOCKS)
    soft *= (1.0 + packing) * math.exp(-ratio_log)
    along = PathQuantities(
        arc_m=0.01 * _SOFT_BLOCKS, block_m=0.01, blocks={name: tuple(soft.tolist())}
    )
    every = [
        WindowOfRun(run=str(number), values={name: value}, arc_m=0.01, cpu_time_s=0.0)
        for number, value in enumerate(
            (1.0 + packing) * (1.0 + scatter * random.normal(size=_MOST_WINDOWS))
        )
    ]
    count, last = 3, False
    while not last:
        found = judged(along, every[:count], _TOLERANCE, [name], _MOST_WINDOWS, _windows_record())
        count, last = found.wanted, found.last
    (row,) = found.quantities
    return row.value, 1.0


@cache
def _windows_record() -> WindowsRecord:
    return WindowsRecord.read(ROOT / "workflow/dragdeck/data/windows.json")


@dataclass(frozen=True)
class Simulated:
    """A kind of interval and the lengths at which it is simulated, in a unit."""

    name: str
    unit: str
    lengths: Sequence[int]
    kind: Kind


_TIMES, _EVENTS, _PACKINGS = "autocorrelation times", "contact events", "packings"
_SCATTER = "percent of scatter"

KINDS = (
    Simulated("mean of a run", _TIMES, (5, 10, 20, 40, 80, 200, 1000), mean),
    Simulated("mean of a run, skewed", _TIMES, (20, 40, 80, 200), skewed_mean),
    Simulated("mean of a run, a fifth of it slow", _TIMES, (20, 80, 200, 500), slow_mean),
    Simulated("ratio", _TIMES, (10, 20, 40, 80, 200), ratio),
    Simulated("bin of a profile", _EVENTS, (10, 25, 50, 200), profile),
    Simulated("load of a facet", _EVENTS, (10, 25, 50, 200), facet),
    Simulated("ratio of two parts of a run", _TIMES, (10, 20, 40, 80), two_parts),
    Simulated("mean over packings", _PACKINGS, (2, 4, 8), over_packings),
    Simulated("difference of two cases", _PACKINGS, (2, 3, 4, 8), difference),
    Simulated("effect of a setting", _PACKINGS, (2, 3, 4), effect),
    Simulated(
        "effect, packings alike in nothing", _PACKINGS, (2, 4), partial(effect, fraction=0.0)
    ),
    Simulated("effect, settings interact", _PACKINGS, (2, 4), partial(effect, interaction=1.4)),
    Simulated("exponent", _PACKINGS, (2, 4), exponent),
    Simulated("calibration", "impacts", (4,), calibration),
    Simulated("drag from windows", _SCATTER, (5, 10, 20), windows),
    Simulated(
        "contacts from windows", _SCATTER, (5, 10, 20), partial(windows, name="workpiece_contacts")
    ),
    Simulated(
        "drag from windows, scene unlike others",
        _SCATTER,
        (5, 10, 20),
        partial(windows, unlike=2.0),
    ),
)
"""Every kind of interval."""


_FEW = 50
"""Of fewer reliable intervals no coverage is told."""


def simulate(case: Simulated, length: int, trials: int) -> dict[str, object]:
    """One row of the record, with the exact interval of Clopper and Pearson (1934)."""
    random = np.random.default_rng([length, *case.name.encode()])
    found = [case.kind(random, length) for _ in range(trials)]
    held = np.array([one.contains(true) for one, true in found])
    reliable = np.array([one.reliable for one, _ in found])
    errors = np.array([one.value - true for one, true in found])
    widths = np.array([one.ci95_high - one.ci95_low for one, _ in found])
    ideal = 2.0 * NORMAL_QUANTILE * math.sqrt(np.mean(errors**2))
    low, high = binomtest(int(held.sum()), trials).proportion_ci(0.95, "exact")
    return {
        "kind": case.name,
        "length": length,
        "unit": case.unit,
        "trials": trials,
        "coverage": held.mean(),
        "ci95_low": low,
        "ci95_high": high,
        "flagged": 1.0 - reliable.mean(),
        "reliable_coverage": held[reliable].mean() if reliable.sum() >= _FEW else math.nan,
        "width_ratio": np.median(widths) / ideal,
    }


def main() -> None:
    """Simulate all kinds, print a row each, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=2000, help="(default: %(default)s)")
    parser.add_argument("--processes", type=int, default=2, help="(default: %(default)s)")
    parser.add_argument("--kind", default="", help="only kinds with this text; writes no record")
    asked = parser.parse_args()
    cases = [(one, length) for one in KINDS for length in one.lengths if asked.kind in one.name]
    found = []
    with ProcessPoolExecutor(asked.processes) as pool:
        for row in pool.map(partial(simulate, trials=asked.trials), *zip(*cases, strict=True)):
            found.append(row)
            print(*(f"{n:.3f}" if isinstance(n, float) else n for n in row.values()), flush=True)
    if not asked.kind:
        table = pd.DataFrame(found)
        table.to_csv(RECORD, index=False, float_format="%.3f", lineterminator="\n")


if __name__ == "__main__":
    main()

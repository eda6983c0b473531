"""How often 95 % intervals of removal contain the true value of simulated processes.

    python benchmarks/removal_coverage.py docs/data/loading/removal_coverage.csv 1000

A process has patches with different loads. In each packing its loads differ by 5 % together and by
10 % each. With one packing the true load is that of the packing, since its interval excludes the
scatter between packings. Each row of the record is a quantity in a setting; `coverage` is of the
cases in which the value is available.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from dragchain.arrays import Floats
from dragchain.loading.edges import EdgeBands, band_actions
from dragchain.loading.wear import Wear
from dragchain.report.removal import edge_rows, joined_half_width, patch_means, predict
from dragchain.statistics.correlated import estimate_mean, slow_error, slow_waves
from dragchain.statistics.estimate import Estimate, EstimateColumns, mean_of, student_quantile
from dragchain.statistics.noisy_map import map_spread
from dragdeck.study.removal import Removal

TRUE_M2_N, DENSITY, TIME_S, PATCHES, FRAMES = 1e-15, 7800.0, 3600.0, 12, 1500
PACKINGS = (1, 2, 3, 5)
KINDS = ("log-normal", "two groups", "rod")
"""Of maps, see `loads_of`."""

Random = np.random.Generator
Hits = Mapping[str, bool | None]
"""Whether the interval of each quantity contains the truth; None if it is not available."""


def levels(random: Random, packings: int, patches: int) -> Floats:
    """Relative loads of the patches of each packing, (packings, patches)."""
    together, alone = random.normal(size=(packings, 1)), random.normal(size=(packings, patches))
    return np.maximum(0.05, 1 + 0.05 * together + 0.1 * alone)


# --- volume, coefficient and depth ---------------------------------------------------------------


def weighed(
    random: Random, lost: float, number: int, part: float, scatter: float, unequal: bool
) -> list[Any]:
    """Trials weighed to a part of the loss, every second to three times that if unequal.

    They scatter by a multiple of their uncertainties.
    """
    sd = part * lost * np.where(unequal & (np.arange(number) % 2 == 1), 3.0, 1.0)
    mass = lost + scatter * sd * random.normal(size=number)
    rows = zip(mass.tolist(), sd.tolist(), strict=True)
    return [{"mass_loss_kg": loss, "time_s": TIME_S, "sd_kg": std} for loss, std in rows]


def rates(random: Random, number: int, scatter: float, unequal: bool) -> Hits:
    """The mass loss per time of so many trials."""
    block = weighed(random, 2e-5, number, 0.02, scatter, unequal)
    _, rate = predict(Removal(calibrate=block), Estimate(1.0, 1.0, 1.0), DENSITY)
    return {"mass loss": rate.combined.contains(2e-5 / TIME_S / DENSITY)}


def volume(random: Random, packings: int, trials: int) -> Hits:
    """One process with series of load over time, whose correlation is 20 samples."""
    loads, level = np.exp(random.normal(0.0, 0.7, PATCHES)), levels(random, packings, PATCHES)
    noise = lfilter([1.0], [1.0, -0.95], random.normal(size=(*level.shape, FRAMES)))
    series = (loads * level)[..., None] * (1 + 0.25 * noise)
    true = loads * level[0] if packings == 1 else loads
    totals = series.sum(axis=1)
    action = mean_of(totals.mean(axis=1)) if packings > 1 else estimate_mean(totals[0]).estimate
    lost = TRUE_M2_N * DENSITY * true.sum() * TIME_S
    known = TRUE_M2_N * (1 + 0.1 * random.normal())
    given: dict[str, Any] = {"coefficient_m2_n": known, "sd_m2_n": TRUE_M2_N / 10}
    if trials:
        given = {"calibrate": weighed(random, lost, trials, 0.05, 1.0, unequal=False)}
    between = packings - 1 if packings > 1 else np.inf
    coefficient, rate = predict(Removal.model_validate(given), action, DENSITY, between)
    errors = np.array([[slow_error(row)[0] for row in of_packing] for of_packing in series])
    mean, error, degrees = patch_means(series.mean(axis=2), errors)
    halves = student_quantile(degrees) * error, mean * rate.coefficient
    half = joined_half_width(*halves, degrees, rate.coefficient_degrees)
    depth = Estimate.around(mean[0], half[0])
    return {
        "volume": rate.combined.contains(TRUE_M2_N * true.sum()),
        "coefficient": coefficient.combined.contains(TRUE_M2_N),
        "depth of a patch": depth.over(1 / coefficient.value).contains(TRUE_M2_N * true[0]),
    }


# --- percentiles of the map ----------------------------------------------------------------------


def loads_of(random: Random, kind: str, patches: int) -> Floats:
    """True loads of a map: skewed, two groups of equal ones, or those of a rod with a lee side."""
    if kind == "log-normal":
        return np.asarray(np.exp(random.normal(0.0, 0.7, patches)))
    if kind == "two groups":
        return np.repeat([0.3, 1.7], patches // 2)
    around = 0.15 + np.maximum(np.cos(np.linspace(-np.pi, np.pi, 10, endpoint=False)), 0.0)
    return np.asarray(np.outer(np.linspace(0.3, 1.0, patches // 10), around).ravel())


def percentiles(random: Random, packings: int, kind: str, events: int) -> Hits:
    """A map of 120 patches with so many events on a mean one in each packing."""
    loads, area = loads_of(random, kind, 120), np.where(random.random(120) < 0.3, 0.5, 1.0)
    level, frames = loads * levels(random, packings, 120), 400
    unit = float(np.average(loads, weights=area)) / events
    waves, values, errors = slow_waves(frames), [], []
    for of_packing in level:
        number = random.poisson(of_packing * area / unit)
        at, size = np.repeat(np.arange(120), number), random.exponential(size=number.sum())
        frame = random.integers(frames, size=len(at))
        squares = [np.bincount(at, size * wave[frame], 120) ** 2 for wave in waves]
        values.append(np.bincount(at, size, 120) * unit / area)
        errors.append(np.sqrt(frames * np.mean(squares, axis=0)) * unit / area)
    spread = map_spread(np.array(values), np.array(errors), area, np.arange(120))
    true = level[0] if packings == 1 else loads
    true = true / np.average(true, weights=area)
    ends = np.quantile(true, (0.05, 0.95), weights=area, method="inverted_cdf")
    hits = dict[str, bool | None]()
    for name, estimate, end in zip(("5th", "95th"), spread.percentiles, ends, strict=True):
        hits[f"{name} percentile"] = estimate.contains(float(end)) if estimate.known else None
    return hits


# --- edges ---------------------------------------------------------------------------------------


def edges(random: Random, packings: int, rounding: float) -> Hits:
    """Bands along an edge with contacts by chance: even, and a line at the edge."""
    frames, area = 400, np.array([1.0, 1.0, 2.0, 4.0, 8.0, 16.0])
    even, line = 40 * area / frames, np.array([40 * rounding / frames, 0, 0, 0, 0, 0])
    wears = []
    for level in 1 + 0.1 * random.normal(size=packings):
        number = random.poisson(level * (even + line), (frames, len(area)))
        action, excess = band_actions(random.gamma(np.maximum(number, 1e-9)), area, 1.0)
        bands = EdgeBands(
            length_m=1.0, angle_rad=np.pi / 2, distance_m=tuple(np.r_[0.0, area.cumsum()].tolist()),
            area_m2=tuple(area.tolist()), action_w=EstimateColumns.of(action),
            excess_w=EstimateColumns.of(excess),
        )  # fmt: skip
        wears.append(Wear.model_construct(edges=bands))
    _, rate = predict(Removal(coefficient_m2_n=1.0), Estimate(1.0, 1.0, 1.0), 1.0)
    (*_, radius), *_ = edge_rows(wears, 1e-12, rate)
    scale = level if packings == 1 else 1.0
    true = 1e6 * np.sqrt(1e-12 * scale * line[0] * 1800 / (1 - np.pi / 4))
    return {"edge radius": radius.contains(true) if radius and radius.known else None}


# --- record --------------------------------------------------------------------------------------


def removal_settings() -> Iterator[tuple[dict[str, Any], Callable[[Random], Hits]]]:
    """What is simulated: the columns that name it, and how."""

    def case(
        simulate: Callable[..., Hits], *of: Any, packings: int = 1, trials: int = 0, said: str = ""
    ) -> tuple[dict[str, Any], Callable[[Random], Hits]]:
        key = {"packings": packings, "weighed_trials": trials, "setting": said}
        return key, lambda random: simulate(random, *of)

    for packings, trials in ((1, 0), (1, 1), (2, 0), (3, 0), (5, 1), (5, 3)):
        yield case(volume, packings, trials, packings=packings, trials=trials)
    for trials, scatter, unequal in product((2, 3, 5, 10), (1.0, 3.0), (False, True)):
        said = f"scatter of {scatter:g} {'unequal' if unequal else 'equal'} uncertainties"
        yield case(rates, trials, scatter, unequal, trials=trials, said=said)
    for packings, kind, events in product(PACKINGS, KINDS, (30, 120)):
        said = f"{kind}, {events} events per patch"
        yield case(percentiles, packings, kind, events, packings=packings, said=said)
    for packings, rounding in product(PACKINGS, (0.0, 2.0)):
        said = "rounded edge" if rounding else "even removal"
        yield case(edges, packings, rounding, packings=packings, said=said)


def removal_coverage(trials: int, seed: int = 1) -> pd.DataFrame:
    """How often each quantity's interval contains the truth, in each setting."""
    rows = []
    for number, (key, simulate) in enumerate(removal_settings()):
        random = np.random.default_rng([seed, number])
        hits = pd.DataFrame([simulate(random) for _ in range(trials)])
        for name, hit in hits.items():
            known = hit.dropna().astype(float)
            rows.append({**key, "quantity": name, "trials": trials, "coverage": known.mean(),
                         "available": len(known) / trials})  # fmt: skip
    return pd.DataFrame(rows).round(3)


if __name__ == "__main__":
    removal_coverage(int(sys.argv[2])).to_csv(sys.argv[1], index=False, lineterminator="\n")

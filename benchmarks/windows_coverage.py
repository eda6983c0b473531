"""How often what windows say of simulated processes contains the truth, and how far it is off.

    python benchmarks/windows_coverage.py docs/data/windows/coverage.csv 1000

A path has as many stretches as windows may be run. The soft run scatters along it; a window keeps a
part of that, the slope, and scatters about it. A drift rises along the path in both. Rounds of
windows are judged as in a study, until the tolerance is reached, the whole drag is run instead, or
nothing can reach it, in each packing; packings are joined as in a report. The slope of a process
differs from that of the record by so many of its standard deviations.
"""

import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.quantities.document import PathQuantities, RunQuantities
from dragchain.report.values import mean_over_packings
from dragchain.statistics.estimate import Estimate
from dragchain.windows.estimate import WindowOfRun
from dragchain.windows.rounds import Asked, judged, with_drag
from dragdeck.records.windows import UNKNOWN, WindowsRecord
from dragdeck.scenes.lead import spread_out

TRUE, STRETCHES, BLOCKS, LENGTHS = -2.0, 16, 3, 9.0
"""Drag, N; stretches of a path; blocks of a stretch; cost of the whole drag in windows, each of
which takes as much path before its sample as in it."""

SLOPE_STD, DEGREES = 0.2, 10.0
"""What is known of a slope, and of the variance about it, from scene to scene."""

Random = np.random.Generator


@dataclass(frozen=True)
class Process:
    """What is simulated.

    Attributes
    ----------
    scatter : float
        Of the soft run's stretches, and about, of windows, relative to the mean.
    slope : float
        Of other scenes.
    drift : float
        Difference from the beginning of the path to its end, relative to the mean.
    packing : float
        Scatter between packings, relative.
    unlike : float
        Slope less that of other scenes, in standard deviations.
    seeds : int
    tolerance : float
    varied : int
        Whether slope and scatter about it are drawn for each process, as scenes differ.
    """

    scatter: float = 0.1
    slope: float = 0.6
    drift: float = 0.0
    packing: float = 0.0
    unlike: float = 0.0
    seeds: int = 1
    tolerance: float = 0.1
    varied: int = 0

    @property
    def record(self) -> WindowsRecord:
        """What other scenes say of it."""
        return _record(self.slope, self.packing)

    def said(self, random: Random) -> tuple[Estimate, bool, float]:
        """Mean drag over packings, whether all reached the tolerance, cost of one in windows."""
        slope, about = self.slope + self.unlike * SLOPE_STD, _about(self.slope)
        if self.varied:
            slope += SLOPE_STD * random.normal()
            about *= DEGREES / random.chisquare(DEGREES)
        rounds = [self._of_packing(slope, about, random) for _ in range(self.seeds)]
        values = [value for value, _, _ in rounds]
        number = float(np.mean([windows for _, _, windows in rounds]))
        return mean_over_packings(values), all(reached for _, reached, _ in rounds), number

    def _of_packing(
        self, slope: float, variance: float, random: Random
    ) -> tuple[Estimate, bool, float]:
        mean = TRUE * (1.0 + self.packing * random.normal())
        of_block = self.scatter * math.sqrt(BLOCKS)
        drift = self.drift * (np.arange(STRETCHES) / (STRETCHES - 1) - 0.5)[:, None]
        noise = of_block * random.normal(size=(STRETCHES, BLOCKS))
        about = self.scatter * math.sqrt(variance) * random.normal(size=STRETCHES)
        windows = mean * (1.0 + drift[:, 0] + slope * noise.mean(axis=1) + about)
        total = of_block * math.sqrt(slope**2 + variance)
        whole = mean * (1.0 + drift + total * random.normal(size=(STRETCHES, BLOCKS)))
        return _judged(0.9 * mean * (1.0 + drift + noise), windows, whole, self)


def _about(slope: float) -> float:
    """Variance of windows about the slope, over that of the soft run."""
    return max(1.0 - slope**2, 0.1)


@cache
def _record(slope: float, packing: float) -> WindowsRecord:
    known = UNKNOWN.model_copy(
        update={
            "slope": slope, "slope_std": SLOPE_STD, "packing_std": packing, "degrees": DEGREES,
            "variance_ratio": _about(slope),
        }
    )  # fmt: skip
    return WindowsRecord(measured="", source="", quantities={"drag_mean": known})


def _judged(
    soft: Floats, stiff: Floats, whole: Floats, process: Process
) -> tuple[Estimate, bool, float]:
    """What the rounds of a packing end with: value, whether it reached, cost in windows."""
    run, drag = (
        PathQuantities(
            arc_m=STRETCHES * BLOCKS, block_m=1.0, blocks={"drag_mean": tuple(of.ravel().tolist())}
        )
        for of in (soft, whole)
    )
    windows = [
        WindowOfRun(
            run="", begin_m=BLOCKS * place, arc_m=BLOCKS, cpu_time_s=1.0,
            values={"drag_mean": float(stiff[place])},
        )
        for place in spread_out(STRETCHES)
    ]  # fmt: skip
    quantities = ("drag_mean",)
    asked = Asked(process.tolerance, quantities, STRETCHES, LENGTHS, BLOCKS, process.seeds)
    number, cost = 0, 0.0
    while True:
        last = judged(run, windows[:number], asked, process.record)
        if last.whole:
            measured = RunQuantities.model_construct(
                run="", complete=True, values_of_run=drag.estimates(process.record.quantities)
            )
            last, cost = with_drag(last, measured, asked), cost + LENGTHS
        if last.last:
            assert last.tolerance is not None
            return last.values["drag_mean"], last.tolerance.reached, cost
        number, cost = last.wanted, float(last.wanted)


GRID: tuple[dict[str, tuple[float, ...]], ...] = (
    {"scatter": (0.05, 0.1, 0.2), "slope": (0.0, 0.6, 0.85), "tolerance": (0.05, 0.1)},
    {"drift": (0.15, 0.3), "tolerance": (0.05, 0.1)},
    {"unlike": (-2.0, 2.0), "tolerance": (0.05, 0.1)},
    {"packing": (0.03, 0.05), "seeds": (1, 2, 4, 8)},
    {"scatter": (0.05, 0.1, 0.2), "tolerance": (0.05, 0.1), "varied": (1,)},
)
"""What varies together; all else is that of `Process`."""


def windows_settings() -> Iterator[tuple[Mapping[str, float], Process]]:
    """What is simulated, with the columns that name it."""
    for varied in GRID:
        for values in product(*varied.values()):
            process = Process(**dict(zip(varied, values, strict=True)))  # type: ignore[arg-type]
            yield asdict(process), process


def windows_coverage(trials: int, seed: int = 1) -> pd.DataFrame:
    """How often the interval contains the truth in each setting, and the bias of the value."""
    rows = []
    for number, (named, process) in enumerate(windows_settings()):
        random = np.random.default_rng([seed, number])
        said = [process.said(random) for _ in range(trials)]
        hits = np.array([value.contains(TRUE) for value, _, _ in said])
        reached = np.array([reached for _, reached, _ in said])
        errors = np.array([value.value / TRUE - 1.0 for value, _, _ in said])
        rows.append({
            **named, "trials": trials, "coverage": hits.mean(), "reached": reached.mean(),
            "coverage_reached": hits[reached].mean() if reached.any() else np.nan,
            "bias": errors.mean(), "bias_se": errors.std() / np.sqrt(trials),
            "cost": np.mean([cost for _, _, cost in said]),
        })  # fmt: skip
    return pd.DataFrame(rows).round(4)


if __name__ == "__main__":
    windows_coverage(int(sys.argv[2])).to_csv(sys.argv[1], index=False, lineterminator="\n")

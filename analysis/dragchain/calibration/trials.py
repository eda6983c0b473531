"""Trials of a calibration: records of simulated drops, and whether their answer is found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from dragchain.calibration.fit import calibrate
from dragchain.calibration.force_record import Record, check_samples
from dragchain.calibration.measured_impacts import IMPACTS, measure
from dragchain.calibration.results import write_csv
from dragchain.calibration.simulated_drops import DropRun, read_drops
from dragchain.calibration.sweep import Sweep, prepare
from dragchain.documents import Document, Part
from dragchain.errors import RecordError
from dragchain.statistics.estimate import CONFIDENCE, Estimate, flattened

_LEAD_S = 0.02
"""What a record shows before the first impact, s."""

_TAIL_S = 0.01
"""What it shows after the last, s."""

_RATES_HZ = (200e3, 500e3, 1e6)
_NOISE_FRACTIONS = (0.002, 0.01)
"""Lowest and highest noise of a trial: standard deviation over the first peak."""

_OFFSET_FRACTION = 0.5
_DRIFT_FRACTION = 0.02
"""Largest offset, and largest drift over the record, over the first peak."""

_NOTHING = Estimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Sensor:
    """A force sensor without dynamics of its own.

    Attributes
    ----------
    rate_hz : float
    noise_n : float
        Standard deviation of white noise, N.
    offset_n : float
    drift_n_per_s : float
    resolution_n : float
        Values are rounded to multiples of it; 0: not at all.
    """

    rate_hz: float
    noise_n: float
    offset_n: float = 0.0
    drift_n_per_s: float = 0.0
    resolution_n: float = 0.0


@dataclass(frozen=True)
class Trial:
    """A record of a simulated drop: what is known of it, and what was recovered.

    Attributes
    ----------
    drop_test : int
        Number of the drop, from 1.
    height_m, rate_hz, noise_fraction : float
        Of drop and sensor; the noise over the first peak.
    deck_known, effective_known : float
        The drop's restitution in the deck, and what it shows.
    deck : Estimate
        Recovered deck value, by the drops at full modulus.
    put : Estimate
        Deck value for production.
    effective : Estimate
        Rebound of the production drop at `put`.
    chi2, degrees : float or None
        Of the fit at full modulus.
    refused : str or None
        Reason of a record that cannot be used; nothing is recovered from it.
    """

    drop_test: int
    height_m: float
    rate_hz: float
    noise_fraction: float
    deck_known: float
    effective_known: float
    deck: Estimate = _NOTHING
    put: Estimate = _NOTHING
    effective: Estimate = _NOTHING
    chi2: float | None = None
    degrees: int | None = None
    refused: str | None = None

    @property
    def deck_held(self) -> bool:
        """Whether the interval includes the known deck value."""
        return self.deck.contains(self.deck_known)

    @property
    def effective_held(self) -> bool:
        """Whether the interval includes the known rebound."""
        return self.effective.contains(self.effective_known)


class Coverage(Part):
    """How many intervals include the known value, and the fraction with its own 95 % interval."""

    held: int
    of: int
    fraction: float
    ci95_low: float
    ci95_high: float


class TrialsFile(Document):
    """The content of ``trials.json``.

    Attributes
    ----------
    refused : int
        Records that could not be used.
    deck, effective : Coverage
        Of the known deck value and of the known rebound.
    """

    made_by: ClassVar[str] = "snakemake calibrate"

    seed: int
    drops: int
    records_per_drop: int
    refused: int
    deck: Coverage
    effective: Coverage


def record_of(run: DropRun, sensor: Sensor, random: np.random.Generator) -> Record:
    """What a sensor shows of a simulated drop, begun at a random phase."""
    step = 1.0 / sensor.rate_hz
    first, last = run.impacts[0].time_s[0], run.impacts[IMPACTS - 1].time_s[-1]
    start = first - _LEAD_S + random.random() * step
    time = start + step * np.arange(int((last + _TAIL_S - start) / step))
    force = np.zeros(len(time))
    for shape in run.impacts[:IMPACTS]:
        force += np.interp(time, shape.time_s, shape.force_n, 0.0, 0.0)
    since = time - start
    force += sensor.offset_n + sensor.drift_n_per_s * since
    force += random.normal(0.0, sensor.noise_n, len(time))
    if sensor.resolution_n > 0.0:
        force = np.round(force / sensor.resolution_n) * sensor.resolution_n
    return check_samples(since, force)


def _some_sensor(peak_n: float, random: np.random.Generator) -> Sensor:
    """A sensor drawn for a trial, fit for a first peak of `peak_n`."""
    return Sensor(
        rate_hz=float(random.choice(_RATES_HZ)),
        noise_n=float(random.uniform(*_NOISE_FRACTIONS)) * peak_n,
        offset_n=float(random.uniform(-_OFFSET_FRACTION, _OFFSET_FRACTION)) * peak_n,
        drift_n_per_s=float(random.uniform(-_DRIFT_FRACTION, _DRIFT_FRACTION)) * peak_n / 0.15,
        resolution_n=peak_n / 2**12,
    )


def run_trials(runs: Sequence[DropRun], sweep: Sweep, seed: int, sensors: int = 1) -> list[Trial]:
    """Recover the known restitution of simulated drops from records of them.

    Parameters
    ----------
    runs : sequence of DropRun
        Made at another time step than the sweep.
    sweep : Sweep
    seed : int
        Of sensors, noise and phases.
    sensors : int
        Records of each drop, each with a sensor and noise of its own.
    """
    return [
        _trial(number, run, sweep, np.random.default_rng([seed, number, again]))
        for number, run in enumerate(runs, start=1)
        for again in range(sensors)
    ]


def _trial(number: int, run: DropRun, sweep: Sweep, random: np.random.Generator) -> Trial:
    peak = run.impacts[0].peak_n
    sensor = _some_sensor(peak, random)
    trial = Trial(
        drop_test=number,
        height_m=run.drop.height_m,
        rate_hz=sensor.rate_hz,
        noise_fraction=sensor.noise_n / peak,
        deck_known=run.drop.restitution,
        effective_known=run.effective,
    )
    try:
        record = record_of(run, sensor, random)
        found = calibrate(measure(record, fall_time_s=sweep.known.fall_time_s), sweep)
    except RecordError as error:
        return replace(trial, refused=error.reason)
    deck, put = found.fit_reference, found.fit.interval
    return replace(
        trial,
        deck=deck.interval,
        put=put,
        effective=put.mapped(sweep.production.rebound),
        chi2=deck.chi2,
        degrees=deck.degrees,
    )


def coverage(held: Sequence[bool]) -> Coverage:
    """Fraction of intervals that include the known value.

    Its interval is exact (Clopper and Pearson 1934, Biometrika 26, 404).
    """
    test = binomtest(sum(held), len(held))
    low, high = test.proportion_ci(CONFIDENCE, "exact")
    return Coverage(held=test.k, of=test.n, fraction=test.statistic, ci95_low=low, ci95_high=high)


def _table(trials: Sequence[Trial]) -> pd.DataFrame:
    """Trials as a table, one row each: intervals as ``<name>_ci95_low``, ``<name>_ci95_high``."""
    table = pd.DataFrame([flattened(vars(trial)) for trial in trials])
    for name in ("deck_held", "effective_held"):
        table.insert(len(table.columns) - 1, name, [getattr(trial, name) for trial in trials])
    return table


def write_trials(drops_file: Path, trials_file: Path, seed: int, records: int, out: Path) -> None:
    """Recover known values from records of simulated drops; write ``trials.csv`` and ``.json``."""
    runs = read_drops(trials_file).select("trial")
    trials = run_trials(runs, prepare(read_drops(drops_file)), seed, records)
    write_csv(out.with_suffix(".csv"), _table(trials))
    TrialsFile(
        seed=seed,
        drops=len(runs),
        records_per_drop=records,
        refused=sum(trial.refused is not None for trial in trials),
        deck=coverage([trial.deck_held for trial in trials]),
        effective=coverage([trial.effective_held for trial in trials]),
    ).write(out)

"""Records of drops of the engine, as a sensor would give them, and their recovery."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import beta

from dragchain.calibration.fit import Sweep, calibrate
from dragchain.calibration.force_record import Record, check_samples, measure
from dragchain.calibration.simulated_drops import IMPACTS, DropRun
from dragchain.errors import RecordError

LEAD_S = 0.02
"""What a record shows before the first impact, s."""

TAIL_S = 0.01
"""What it shows after the last, s."""

RATES_HZ = (200e3, 500e3, 1e6)
NOISE_FRACTIONS = (0.002, 0.01)
"""Lowest and highest noise of a trial: standard deviation over the first peak."""

OFFSET_FRACTION = 0.5
DRIFT_FRACTION = 0.02
"""Largest offset, and largest drift over the record, over the first peak."""


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


def record_of(run: DropRun, sensor: Sensor, random: np.random.Generator) -> Record:
    """What a sensor shows of a simulated drop, begun at a random phase."""
    step = 1.0 / sensor.rate_hz
    first, last = run.impacts[0].time_s[0], run.impacts[IMPACTS - 1].time_s[-1]
    start = first - LEAD_S + random.random() * step
    time = start + step * np.arange(int((last + TAIL_S - start) / step))
    force = np.zeros(len(time))
    for shape in run.impacts[:IMPACTS]:
        force += np.interp(time, shape.time_s, shape.force_n, 0.0, 0.0)
    since = time - start
    force += sensor.offset_n + sensor.drift_n_per_s * since
    force += random.normal(0.0, sensor.noise_n, len(time))
    if sensor.resolution_n > 0.0:
        force = np.round(force / sensor.resolution_n) * sensor.resolution_n
    return check_samples(since, force)


def some_sensor(peak_n: float, random: np.random.Generator) -> Sensor:
    """A sensor drawn for a trial, fit for a first peak of `peak_n`."""
    return Sensor(
        rate_hz=float(random.choice(RATES_HZ)),
        noise_n=float(random.uniform(*NOISE_FRACTIONS)) * peak_n,
        offset_n=float(random.uniform(-OFFSET_FRACTION, OFFSET_FRACTION)) * peak_n,
        drift_n_per_s=float(random.uniform(-DRIFT_FRACTION, DRIFT_FRACTION)) * peak_n / 0.15,
        resolution_n=peak_n / 2**12,
    )


def run_trials(
    runs: Sequence[DropRun], sweep: Sweep, seed: int, sensors: int = 1
) -> list[dict[str, Any]]:
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

    Returns
    -------
    list of dict
        One a record: the known values, what was recovered, and whether the
        intervals hold the known values. A refused record holds nothing.
    """
    rows = []
    for number, run in enumerate(runs, start=1):
        for again in range(sensors):
            random = np.random.default_rng([seed, number, again])
            sensor = some_sensor(run.impacts[0].peak_n, random)
            rows.append({"drop_test": number, **_trial(run, sensor, sweep, random)})
    return rows


def _trial(
    run: DropRun, sensor: Sensor, sweep: Sweep, random: np.random.Generator
) -> dict[str, Any]:
    effective = float(run.rebound[:IMPACTS].mean())
    known: dict[str, Any] = {
        "height_m": run.height_m,
        "rate_hz": sensor.rate_hz,
        "noise_fraction": sensor.noise_n / run.impacts[0].peak_n,
        "deck_known": run.restitution,
        "effective_known": effective,
    }
    try:
        measured = measure(record_of(run, sensor, random), fall_time_s=sweep.known["fall_time_s"])
        found = calibrate(measured, sweep)
    except RecordError as error:
        nothing = dict.fromkeys(("deck", "deck_low", "deck_high", "put", "put_low", "put_high"))
        lost = dict.fromkeys(("effective", "effective_low", "effective_high", "chi2", "degrees"))
        return {**known, **nothing, **lost, "deck_held": False, "effective_held": False,
                "refused": error.reason}  # fmt: skip
    deck, put = found.fit_reference, found.fit
    low, middle, high = (
        float(sweep.production.rebound(e)) for e in (put.low, put.restitution, put.high)
    )
    return {
        **known,
        **{"deck": deck.restitution, "deck_low": deck.low, "deck_high": deck.high},
        **{"put": put.restitution, "put_low": put.low, "put_high": put.high},
        **{"effective": middle, "effective_low": low, "effective_high": high},
        **{"chi2": deck.chi2, "degrees": deck.degrees},
        "deck_held": deck.low <= run.restitution <= deck.high,
        "effective_held": low <= effective <= high,
        "refused": None,
    }


def coverage(held: Sequence[bool]) -> dict[str, float]:
    """Share of intervals that hold the known value, with its own 95 % interval.

    Clopper and Pearson (1934), Biometrika 26, 404.
    """
    n, k = len(held), sum(held)
    low = float(beta.ppf(0.025, k, n - k + 1)) if k else 0.0
    high = float(beta.ppf(0.975, k + 1, n - k)) if k < n else 1.0
    return {"held": k, "of": n, "fraction": k / n, "low": low, "high": high}

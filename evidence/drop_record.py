"""The synthetic record of a drop test: a drop of the engine as a force sensor would show it.

How ``studies/droptest/record.csv`` was made is described in docs/evidence/calibration.md.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dragchain.calibration.drops import IMPACTS, Drop, full
from dragchain.calibration.simulated_drops import DropRun, Drops, run_drops
from dragdeck.cases.case import Case
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.project import project_here
from dragdeck.study.calibration import measurements
from dragdeck.study.force_record import Record, check_samples

LEAD_S, TAIL_S = 0.02, 0.01
"""What a record shows before the first impact and after the last, s."""

STEP_FRACTION = 0.005
"""Time step of the drop over the Rayleigh time: half the finest of a calibration."""

RESTITUTIONS = (0.5, 0.9)
"""Range of the value in the deck, which is drawn."""


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


def drop_of(case: Case, seed: int) -> Drop:
    """A drop with a seeded restitution and a seeded height, as if it had been set by hand."""
    random, study = np.random.default_rng(seed), case.study
    measured = measurements(study.calibration, case.file)
    value = round(float(random.uniform(*RESTITUTIONS)), 4)
    height = study.drop_test.height_m + float(random.normal(0.0, measured.height_std_m))
    return Drop("drop", "reference", value, height, full(study, STEP_FRACTION))


def synthetic_record(drops: Drops, sensor: Sensor, seed: int) -> str:
    """A CSV of the first drop that says what it is."""
    run = drops.runs[0]
    drop, record = run.drop, record_of(run, sensor, np.random.default_rng(seed))
    head = [
        "# SYNTHETIC: no measurement. A drop of the engine as a force sensor would show it.",
        f"# engine: restitution {drop.restitution:g} in the deck,"
        f" limitForce {'on' if drops.known.limit_force else 'off'},",
        f"#   modulus times {drop.fidelity.youngs_modulus_scale:g},"
        f" step {STEP_FRACTION:.2%} of the",
        f"#   Rayleigh time, height {drop.height_m * 1e3:.4f} mm;"
        f" it rebounds with {run.effective:.5f}",
        f"# sensor: {sensor.rate_hz:g} Hz, noise {sensor.noise_n:g} N (standard deviation),",
        f"#   offset {sensor.offset_n:g} N, drift {sensor.drift_n_per_s:g} N/s,",
        f"#   resolution {sensor.resolution_n:g} N, seed {seed}",
        "# how it was made: docs/evidence/calibration.md",
        "time_s,force_n",
    ]
    digits = max(0, math.ceil(-math.log10(sensor.resolution_n))) if sensor.resolution_n else 6
    stamps = max(0, math.ceil(-math.log10(0.1 * record.interval_s)))
    samples = zip(record.time_s, record.force_n, strict=True)
    return "\n".join([*head, *(f"{t:.{stamps}f},{f:.{digits}f}" for t, f in samples)]) + "\n"


def make_record(
    folder: Path,
    out: Path,
    seed: int,
    rate_hz: float,
    noise_n: float,
    offset_n: float,
    drift_n_per_s: float,
    resolution_n: float,
) -> None:
    """Run a drop of the study ``droptest`` in a folder, and write its record.

    Parameters
    ----------
    folder, out : Path
        Of the drop, and the CSV file.
    seed : int
        Of the drop and of the noise.
    rate_hz, noise_n, offset_n, drift_n_per_s, resolution_n : float
        As of `Sensor`.
    """
    project = project_here()
    case = project.cases("droptest")[0]
    batch = Batch(folder, project.templates_of(case))
    drops = run_drops(case, [drop_of(case, seed)], batch, say)
    sensor = Sensor(rate_hz, noise_n, offset_n, drift_n_per_s, resolution_n)
    out.write_text(synthetic_record(drops, sensor, seed), encoding="utf-8")

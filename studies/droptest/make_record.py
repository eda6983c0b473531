"""Make a synthetic record of a drop test: a drop of the engine as a force sensor would show it.

How ``record.csv`` was made is described in docs/evidence/calibration.md.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from dragchain.calibration.simulated_drops import DropRun, read_drops
from dragchain.calibration.trials import Sensor, record_of


def synthetic_record(run: DropRun, sensor: Sensor, seed: int) -> str:
    """A CSV that says what it is."""
    drop, record = run.drop, record_of(run, sensor, np.random.default_rng(seed))
    fraction = f"{drop.timestep_fraction:.2%}"
    head = [
        "# SYNTHETIC: no measurement. A drop of the engine as a force sensor would show it.",
        f"# engine: restitution {drop.restitution:g} in the deck,"
        f" limitForce {'on' if drop.limit_force else 'off'},",
        f"#   modulus times {drop.youngs_modulus_scale:g}, step {fraction} of the",
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


def main() -> None:
    """Write the record of the first drop of a list."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drops", type=Path, help="drops.json of one drop")
    parser.add_argument("out", type=Path, help="the CSV")
    parser.add_argument("--rate", type=float, required=True, help="samples per second, Hz")
    parser.add_argument("--noise", type=float, required=True, help="standard deviation, N")
    parser.add_argument("--offset", type=float, default=0.0, help="N")
    parser.add_argument("--drift", type=float, default=0.0, help="N/s")
    parser.add_argument("--resolution", type=float, default=0.0, help="N")
    parser.add_argument("--seed", type=int, required=True)
    options = parser.parse_args()
    sensor = Sensor(options.rate, options.noise, options.offset, options.drift, options.resolution)
    run = read_drops(options.drops).runs[0]
    options.out.write_text(synthetic_record(run, sensor, options.seed), encoding="utf-8")


if __name__ == "__main__":
    main()

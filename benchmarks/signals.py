"""How often the comparison of two force signals finds a difference that is or is not there.

    python benchmarks/signals.py trials OUT.csv [--trials 120]    # synthetic signals of known truth
    python benchmarks/signals.py example RUN_DIR OUT.csv          # a run as a dynamometer shows it

In half of the trials the simulated signal is another realisation of the measured one, in the other
half one of which every force is 10 % larger.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from dragchain.arrays import Floats
from dragchain.report.measured_signal import SIGNAL_QUANTITIES, compared
from dragchain.run.kinematics import process_time
from dragdeck.records.case import load_case
from dragdeck.study.force_record import low_passed

BANDWIDTH_HZ, MARGIN, PLANTED = 20.0, 0.1, 0.1
REVOLUTION_S = 11.9
"""Counted time of a revolution of the study uhlmann2015, s."""
LENGTHS = (1, 5, 15)
MEAN_N, SPREAD = 2.6, 0.23
CORRELATION = ((0.8, 0.05), (0.2, 0.25))
"""Share of the variance and correlation time in s of the parts of the logarithm of the force."""
FACTOR, OFFSET_N, DRIFT_N_S, NOISE_N, REST_S = 1.25, 0.8, 0.02, 0.05, 1.5


def synthetic(random: np.random.Generator, seconds: float) -> Floats:
    """A skewed, correlated resistance at the common rate, N."""
    count, rate = int(5 * BANDWIDTH_HZ * seconds), 5 * BANDWIDTH_HZ
    parts = np.zeros(count + 400)
    for share, time_s in CORRELATION:
        kept = np.exp(-1 / (rate * time_s))
        steps = random.normal(0.0, np.sqrt(share * (1 - kept**2)), len(parts))
        parts += lfilter([1.0], [1.0, -kept], steps)
    force = MEAN_N * np.exp(SPREAD * parts - SPREAD**2 / 2)
    smooth = low_passed(np.arange(len(force)) / rate, force, BANDWIDTH_HZ)[1]
    return smooth[200 : 200 + count]


def trials(count: int, lengths: tuple[int, ...] = LENGTHS) -> pd.DataFrame:
    """Fractions of verdicts: a row per length, planted difference and quantity; last `any`."""
    rows, random = [], np.random.default_rng(28)
    for length in lengths:
        for planted in (0.0, PLANTED):
            found = []
            for _ in range(count):
                a, b = (synthetic(random, length * REVOLUTION_S) for _ in range(2))
                found.append(
                    compared(a, [(1 + planted) * b], low_pass_hz=BANDWIDTH_HZ, separation_s=0.327,
                             margin=MARGIN)
                )  # fmt: skip
            verdicts = np.array([[one.verdict for one in each] for each in found])
            needs = np.array([[one.needs or np.nan for one in each] for each in found])
            for at, quantity in enumerate(SIGNAL_QUANTITIES):
                words = ("different", "equivalent")
                shares = {word: (verdicts[:, at] == word).mean() for word in words}
                needed = float(np.nanmedian(np.append(needs[:, at], np.nan)))
                rows.append({"revolutions": length, "planted": planted,
                             "quantity": quantity.label, **shares, "needs": needed})  # fmt: skip
            some = (verdicts == "different").any(axis=1).mean()
            rows.append({"revolutions": length, "planted": planted, "quantity": "any",
                         "different": some, "trials": count})  # fmt: skip
    return pd.DataFrame(rows)


def example(run_dir: Path) -> str:
    """The drag of a run times `FACTOR` as a dynamometer with offset, drift and noise shows it."""
    case, random = load_case(run_dir), np.random.default_rng(1)
    table = pd.read_parquet(run_dir / "tables" / "workpiece_force.parquet")
    drag = table[table["phase"] == "drag"]
    time, force = process_time(drag["time_s"].to_numpy(), case), -FACTOR * drag["drag_n"].to_numpy()
    grid = np.arange(-REST_S, time[-1] + REST_S, 0.005)
    shown = np.interp(grid, time, force, 0.0, 0.0) + OFFSET_N + DRIFT_N_S * (grid + REST_S)
    shown += random.normal(0.0, NOISE_N, len(grid))
    head = (
        f"# SYNTHETIC, no measurement: the drag of another packing times {FACTOR:g}, with offset,",
        "# drift and noise of a sensor; made by benchmarks/signals.py",
        "time_s,fx_n",
    )
    rows = (f"{at + REST_S:.3f},{force:.3f}" for at, force in zip(grid, shown, strict=True))
    return "\n".join([*head, *rows]) + "\n"


def main() -> None:
    """Write the record of the trials, or the example."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("trials", "example"))
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    parser.add_argument("--trials", type=int, default=120)
    options = parser.parse_args()
    if options.what == "trials":
        trials(options.trials).round(4).to_csv(options.files[-1], index=False)
    else:
        options.files[-1].write_text(example(options.files[0]), encoding="utf-8")


if __name__ == "__main__":
    main()

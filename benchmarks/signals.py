"""How often the comparison of two force signals finds a difference that is or is not there.

    python benchmarks/signals.py OUT.csv [--trials 120]    # synthetic signals of known truth
    python benchmarks/signals.py RUN_DIR OUT.csv           # a run as a dynamometer shows it

In half of the trials the simulated signal is another realisation of the measured one, in the other
half one of which every force is 10 % larger.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from dragchain.arrays import Floats
from dragchain.report.measured_signal import SIGNAL_QUANTITIES, Difference, compared
from dragchain.run.kinematics import process_time
from dragdeck.records.case import load_case
from dragdeck.study.force_record import low_passed

BANDWIDTH_HZ, FOUND = 20.0, 1.1
REVOLUTION_S = 11.9
"""Counted time of a revolution of the study uhlmann2015, s."""
LENGTHS = (1, 5, 15)
COLUMNS = ("revolutions", "quantity", "found", "false", "equivalent", "needs", "trials")
MEAN_N, SPREAD = 2.6, 0.23
CORRELATION = ((0.8, 0.05), (0.2, 0.25))
"""Share of the variance and correlation time in s of the parts of the logarithm of the force."""
FACTOR, OFFSET_N, DRIFT_N_S, NOISE_N, REST_S = 2.0, 0.8, 0.02, 0.05, 1.5


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
    """Fractions of trials by length and quantity, and for `any` of them.

    `found`: called different if every force is 10 % larger; `false`: if the truth is the same;
    `equivalent`: if the truth is the same; `needs`: median multiple of the length in the latter.
    """
    rows, random = [], np.random.default_rng(28)
    labels = [one.label for one in SIGNAL_QUANTITIES]
    for length in lengths:
        seconds = length * REVOLUTION_S
        same, larger = (_compared(random, count, seconds, factor) for factor in (1.0, FOUND))
        needs = pd.DataFrame([[one.needs for one in each] for each in same], columns=labels)
        null, planted = (
            np.array([[one.verdict for one in each] for each in some]) for some in (same, larger)
        )
        for name, which in (
            *zip(labels, np.eye(len(labels), dtype=bool), strict=True),
            ("any", ...),
        ):
            shares = [(some[:, which] == "different").any(1).mean() for some in (planted, null)]
            more = [np.nan, np.nan]
            if name in labels:
                equivalent = (null[:, which] == "equivalent").mean()
                more = [equivalent, needs[name].astype(float).median()]
            rows.append([length, name, *shares, *more, count])
    return pd.DataFrame(rows, columns=COLUMNS)


def _compared(
    random: np.random.Generator, count: int, seconds: float, factor: float
) -> list[list[Difference]]:
    """Comparisons of pairs of realisations, the second times a factor."""
    pairs = ([synthetic(random, seconds) for _ in "ab"] for _ in range(count))
    usual = {"low_pass_hz": BANDWIDTH_HZ, "separation_s": 0.327, "margin": FOUND - 1.0}
    return [compared(one, [factor * other], **usual) for one, other in pairs]


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
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    parser.add_argument("--trials", type=int, default=120)
    *run_dir, out = (options := parser.parse_args()).files
    if run_dir:
        out.write_text(example(run_dir[0]), encoding="utf-8")
    else:
        trials(options.trials).round(4).to_csv(out, index=False)


if __name__ == "__main__":
    main()

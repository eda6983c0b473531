"""Two force signals of known truth: differences, their intervals and verdicts."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from force_signals import BANDWIDTH_HZ, synthetic
from report_files import PICTURES, case_json, make_run, page_of, process_findings

from dragchain.errors import SeriesError
from dragchain.report.measured_signal import Difference, _over_packings, compared
from dragchain.report.study_report import write_study_report
from dragchain.statistics.estimate import Estimate


def differences(measured: Any, *simulated: Any, margin: float = 0.1) -> dict[str, Difference]:
    found = compared(measured, simulated, low_pass_hz=BANDWIDTH_HZ, separation_s=0.3, margin=margin)
    return {difference.label: difference for difference in found}


def test_the_same_signal_scaled_differs_by_that_factor() -> None:
    """Of forces, and of nothing else."""
    force = synthetic(np.random.default_rng(1), 60.0)
    found = differences(force, 1.2 * force)
    for label in ("mean", "standard deviation", "mean peak height"):
        assert found[label].relative.value == pytest.approx(0.2, abs=1e-9)
    assert found["peak rate"].relative.value == pytest.approx(0.0, abs=1e-9)
    assert found["mean"].verdict == "different"


def test_intervals_of_mean_and_spread_cover_the_true_difference() -> None:
    """In 100 pairs of independent signals with the same truth, and of one that is 10 % larger."""
    random, inside, planted = np.random.default_rng(7), {"mean": 0, "standard deviation": 0}, 0
    for _ in range(100):
        one, other = (synthetic(random, 60.0) for _ in range(2))
        found = differences(one, 1.1 * other)
        for label in inside:
            inside[label] += found[label].relative.contains(0.1)
        planted += found["mean"].verdict == "different"
    assert min(inside.values()) >= 90
    assert planted >= 80


def test_too_short_a_signal_is_refused() -> None:
    short = synthetic(np.random.default_rng(1), 12.0)
    with pytest.raises(SeriesError, match="shape"):
        differences(short, short[:3])


@pytest.mark.parametrize(
    ("ends", "reliable", "verdict"),
    [
        ((-0.05, 0.09), True, "equivalent"),
        ((0.01, 0.09), True, "equivalent"),
        ((0.01, 0.12), True, "different"),
        ((-0.3, -0.01), True, "different"),
        ((-0.05, 0.11), True, "undecided"),
        ((0.01, 0.12), False, "undecided"),
        ((math.nan, 0.12), True, "undecided"),
    ],
)
def test_verdicts(ends: tuple[float, float], reliable: bool, verdict: str) -> None:
    estimate = Estimate(0.05, *ends, reliable=reliable)
    assert Difference("mean", "N", estimate, estimate, estimate, 0.1).verdict == verdict


def test_packings_that_scatter_widen_the_interval() -> None:
    """By Student's t for the difference from one packing more: of four, 3.18 sqrt(1.25) std."""
    packings = [Estimate.around(3.0 + 0.5 * at, 0.3) for at in range(4)]
    mean = _over_packings(packings)
    std = np.std([packing.value for packing in packings], ddof=1)
    assert mean.half_width == pytest.approx(3.182 * math.sqrt(1.25) * std, rel=1e-3)
    assert _over_packings(packings[:1]) == packings[0]


@pytest.fixture
def process(tmp_path: Path) -> Path:
    """A process run with a force on the workpiece, and force.csv: another one times 1.25."""
    random, step = np.random.default_rng(5), 1e-3
    time = np.arange(0.0, 30.0, step)
    coarse = np.arange(0.0, 31.0, 0.01)
    drags = [np.interp(time, coarse, synthetic(random, 31.0)) for _ in range(2)]
    own = {"file": "force.csv", "column": "fx_kn", "sign": -1, "starts_at_s": 2.0,
           "low_pass_hz": 20.0, "orientation": "follow_path"}  # fmt: skip
    reference = {"source": "SYNTHETIC", "signal": own}
    case = case_json("process", "workpiece-1", {"reference": reference}, timestep_s=step / 4,
                     phases=[{"name": "drag", "start_step": 4000, "end_step": 124000}])  # fmt: skip
    run = make_run(tmp_path / "results", case, process_findings(), PICTURES)
    table = pd.DataFrame({"time_s": 1.0 + step + time, "phase": "drag", "drag_n": -drags[0]})
    (run / "tables").mkdir(exist_ok=True)
    table.to_parquet(run / "tables/workpiece_force.parquet")
    rows = [f"{t + 2.0:.4f},{1.25e-3 * f:.8f}" for t, f in zip(time, drags[1], strict=True)]
    (tmp_path / "force.csv").write_text("\n".join(["time_s,fx_kn", *rows]))
    return run


def test_the_report_has_both_signals_and_the_verdicts(process: Path, tmp_path: Path) -> None:
    write_study_report(tmp_path / "out", [process], signal=tmp_path / "force.csv")
    words = page_of(tmp_path / "out").words
    assert "Measured force signal" in words
    assert "Source of the measurement: SYNTHETIC" in words
    table = pd.read_csv(tmp_path / "out/signal.csv").set_index("label")
    assert table.loc["mean", "verdict"] == "different"
    assert table.loc["mean", "relative_ci95_low"] < -0.2 < table.loc["mean", "relative_ci95_high"]
    assert table["verdict"].isin(["equivalent", "different", "undecided"]).all()
    assert len(page_of(tmp_path / "out").images) == len(PICTURES) + 1


def test_a_report_without_the_signal_says_so(process: Path, tmp_path: Path) -> None:
    write_study_report(tmp_path / "out", [process])
    assert "force.csv is not compared" in page_of(tmp_path / "out").words
    (tmp_path / "force.csv").write_text("time_s,fx_kn\n0,0\n")
    write_study_report(tmp_path / "out", [process], signal=tmp_path / "force.csv")
    assert "too few samples" in page_of(tmp_path / "out").words
    assert not (tmp_path / "out/signal.csv").exists()

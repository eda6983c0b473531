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
from dragchain.report.measured_signal import (
    SIGNAL_QUANTITIES,
    Difference,
    _correlation_time,
    _difference,
    _over_packings,
    compared,
)
from dragchain.report.study_report import write_study_report
from dragchain.statistics.estimate import Estimate

LABELS = [quantity.label for quantity in SIGNAL_QUANTITIES]
FORCES = [label for label in LABELS if label not in ("peak rate", "correlation time")]


def differences(measured: Any, *simulated: Any, margin: float = 0.1) -> dict[str, Difference]:
    found = compared(measured, simulated, low_pass_hz=BANDWIDTH_HZ, separation_s=0.3, margin=margin)
    return {one.quantity.label: one for one in found}


def test_the_same_signal_scaled_differs_by_that_factor() -> None:
    """Of forces, and of nothing else; the intervals are those of two independent signals."""
    one = synthetic(np.random.default_rng(1), 60.0)
    found = differences(one, 1.2 * one)
    for label in ("standard deviation", "mean peak height", *LABELS[-4:]):
        assert found[label].relative.value == pytest.approx(0.2, abs=1e-9)
    for label in ("peak rate", "correlation time"):
        assert found[label].relative.value == pytest.approx(0.0, abs=1e-9)
    high = np.quantile(one, 0.95) / one.mean()
    assert found["mean"].relative.value == pytest.approx(0.2)
    assert found["95 % quantile"].relative.value == pytest.approx(0.2 * high)
    assert found["mean"].verdict == "different"


def test_a_planted_difference_is_found_and_none_that_is_not_there() -> None:
    random, planted, null = np.random.default_rng(7), 0, 0
    for _ in range(12):
        one, other = (synthetic(random, 60.0) for _ in range(2))
        null += any(each.verdict == "different" for each in differences(one, other).values())
        planted += differences(one, 1.1 * other)["mean"].verdict == "different"
    assert planted >= 11
    assert null <= 2


def test_equal_correlation_times_are_rarely_called_different() -> None:
    """Of 300 pairs about 1.5 by chance; an interval linear in the autocovariances excluded 12."""
    random, found = np.random.default_rng(17), []
    for _ in range(300):
        pair = (synthetic(random, 12.0) for _ in range(2))
        one, other = (_correlation_time(force - force.mean(), 5 * BANDWIDTH_HZ) for force in pair)
        found.append(_difference(one, other, None))
    assert sum(not one.contains(0.0) for one in found) <= 4
    assert np.median([one.half_width for one in found]) < 1.5


def test_a_correlation_time_three_times_as_long_is_found() -> None:
    random = np.random.default_rng(19)
    fast, slow = synthetic(random, 240.0), np.repeat(synthetic(random, 80.0), 3)
    rest = [one - one.mean() for one in (fast, slow)]
    one, other = (_correlation_time(force, 5 * BANDWIDTH_HZ) for force in rest)
    assert _difference(other, one, None).ci95_low > 0.0
    assert other.value == pytest.approx(3 * one.value, rel=0.3)


def test_too_short_a_signal_is_said_to_be_so() -> None:
    short = synthetic(np.random.default_rng(1), 12.0)
    with pytest.raises(SeriesError, match="3 samples"):
        differences(short, short[:3])


def test_an_undecided_quantity_says_how_long_a_signal_it_needs() -> None:
    random = np.random.default_rng(11)
    short = differences(*(synthetic(random, 12.0) for _ in range(2)))["mean"]
    long = differences(*(synthetic(random, 240.0) for _ in range(2)))["mean"]
    assert short.verdict == "undecided"
    assert short.needs is not None and 2.0 < short.needs < 20.0
    assert f"needs {short.needs:.2g} times the length" in short.said
    assert long.verdict == "equivalent"


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
    one = Estimate(0.05, *ends, reliable=reliable)
    assert Difference(SIGNAL_QUANTITIES[0], one, one, one, 0.1, False).verdict == verdict


def test_packings_that_scatter_widen_the_interval() -> None:
    near = [Estimate.around(3.0 + 0.01 * at, 0.3) for at in range(4)]
    far = [Estimate.around(3.0 + 0.5 * at, 0.3) for at in range(4)]
    mean, between = _over_packings(near)
    assert not between
    assert mean.ci95_high - mean.value == pytest.approx(0.15)
    mean, between = _over_packings(far)
    assert between
    assert mean.ci95_high - mean.value > 2 * np.std([one.value for one in far], ddof=1)


@pytest.fixture
def process(tmp_path: Path) -> Path:
    """A process run with a force on the workpiece, and force.csv: another one times 1.25."""
    random, step = np.random.default_rng(5), 1e-3
    time = np.arange(0.0, 30.0, step)
    coarse = np.arange(0.0, 31.0, 0.01)
    drags = [np.interp(time, coarse, synthetic(random, 31.0)) for _ in range(2)]
    own = {"file": "force.csv", "column": "fx_kn", "sign": -1, "starts_at_s": 2.0,
           "low_pass_hz": 20.0}  # fmt: skip
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

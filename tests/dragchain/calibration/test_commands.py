"""The command of a calibration, as far as it needs no engine."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_study import Made
from paths import ROOT

from dragchain.calibration.measured_impacts import measure_impacts
from dragchain.cli import main
from dragdeck.study.force_record import read_record

EXAMPLE = ROOT / "studies/droptest/record.csv"


def test_the_shipped_record_says_that_it_is_synthetic_and_can_be_used() -> None:
    assert EXAMPLE.read_text().startswith("# SYNTHETIC: no measurement.")
    measured = measure_impacts(read_record(EXAMPLE), fall_time_s=0.04515)
    assert [impact.impact for impact in measured.impacts] == [1, 2, 3]
    assert measured.interval_s == pytest.approx(4e-6)
    assert measured.noise_n == pytest.approx(0.1, rel=0.02)  # as its own head says
    assert measured.offset_n == pytest.approx(3.0, abs=0.01)


def test_a_record_is_refused_before_any_run(
    small: dict[str, Any], made: Made, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    small["calibration"] = {"record": "bad.csv"}
    file = made().file
    time = np.arange(2000) * 1e-5
    rows = [f"{t:.6f},{f:.3f}" for t, f in zip(time[::-1], np.zeros(2000), strict=True)]
    (file.parent / "bad.csv").write_text("\n".join(["time_s,force_n", *rows]))
    monkeypatch.chdir(file.parents[2])
    assert main(["step", "calibrate", file.parent.name, "--out", "calibration"]) == 1
    said = capsys.readouterr().err
    assert "cannot be used (time): time runs backwards" in said
    assert "remedy:" in said
    assert not Path("calibration").exists()

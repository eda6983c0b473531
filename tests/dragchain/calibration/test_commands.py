"""The commands of a calibration that need no engine."""

import json
from pathlib import Path

import numpy as np
import pytest

from dragchain.cli import main

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "studies/droptest/record.csv"


def record(out: Path, file: Path) -> int:
    return main(["step", "record", str(file), "--fall-time", "0.04515", "--out", str(out)])


def test_the_shipped_record_says_that_it_is_synthetic_and_can_be_used(tmp_path: Path) -> None:
    assert EXAMPLE.read_text().startswith("# SYNTHETIC: no measurement.")
    out = tmp_path / "record.json"
    assert record(out, EXAMPLE) == 0
    found = json.loads(out.read_text())
    assert [impact["impact"] for impact in found["impacts"]] == [1, 2, 3]
    assert found["interval_s"] == pytest.approx(4e-6)
    assert found["noise_n"] == pytest.approx(0.1, rel=0.02)  # as its own head says
    assert found["offset_n"] == pytest.approx(3.0, abs=0.01)


def test_a_refusal_names_the_reason_and_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time = np.arange(2000) * 1e-5
    rows = [f"{t:.6f},{f:.3f}" for t, f in zip(time[::-1], np.zeros(2000), strict=True)]
    bad = tmp_path / "bad.csv"
    bad.write_text("\n".join(["time_s,force_n", *rows]))
    assert record(tmp_path / "record.json", bad) == 1
    said = capsys.readouterr().err
    assert "cannot be used (time): time runs backwards" in said
    assert "remedy:" in said
    assert not (tmp_path / "record.json").exists()


def test_a_missing_sweep_is_told_with_what_makes_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drops = str(tmp_path / "drops.json")
    words = ["step", "calibrate", str(EXAMPLE), "--drops", drops, "--out", "x"]
    assert main(words) == 1
    assert "./run calibrate" in capsys.readouterr().err

"""The synthetic record that comes with the study of a drop test."""

from pathlib import Path

import pytest
from make_record import synthetic_record
from paths import ROOT

from dragchain.calibration.simulated_drops import read_drops
from dragchain.calibration.trials import Sensor
from dragdeck.cli import main


@pytest.mark.engine
def test_the_shipped_record_is_made_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    words = ["trials", "--count", "1", "--seed", "2015", "--out", str(tmp_path)]
    assert main(["step", "drops", "droptest", *words]) == 0
    (run,) = read_drops(tmp_path / "drops.json").runs
    sensor = Sensor(250e3, 0.1, offset_n=3.0, drift_n_per_s=0.5, resolution_n=0.01)
    shipped = (ROOT / "studies/droptest/record.csv").read_text()
    assert synthetic_record(run, sensor, 2015) == shipped

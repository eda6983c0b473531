"""The synthetic record that comes with the study of a drop test."""

import re
from pathlib import Path

import pytest
from paths import ROOT

from evidence.__main__ import main

COMMAND = re.compile(r"^python -m evidence make-record build/example record.csv (.*)$", re.M)


@pytest.mark.engine
def test_the_shipped_record_is_made_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    (options,) = COMMAND.findall((ROOT / "docs/evidence/calibration.md").read_text())
    record = tmp_path / "record.csv"
    assert main(["make-record", str(tmp_path), str(record), *options.split()]) == 0
    assert record.read_text() == (ROOT / "studies/droptest/record.csv").read_text()

"""The synthetic record that comes with the study of a drop test."""

import re
import sys
from pathlib import Path

import make_record
import pytest
from paths import ROOT

COMMAND = re.compile(
    r"^python studies/droptest/make_record.py build/example record.csv (.*)$", re.M
)


@pytest.mark.engine
def test_the_shipped_record_is_made_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    (options,) = COMMAND.findall((ROOT / "docs/evidence/calibration.md").read_text())
    words = [str(tmp_path), str(tmp_path / "record.csv"), *options.split()]
    monkeypatch.setattr(sys, "argv", ["make_record.py", *words])
    make_record.main()
    shipped = (ROOT / "studies/droptest/record.csv").read_text()
    assert (tmp_path / "record.csv").read_text() == shipped

"""Intervals of removal contain the true value as often as they say."""

import pandas as pd
from paths import ROOT

from benchmarks.removal_coverage import coverage

RECORD = pd.read_csv(ROOT / "docs/data/loading/removal_coverage.csv")


def test_the_recorded_coverage_is_that_of_a_95_percent_interval() -> None:
    assert len(RECORD) == 15
    assert (RECORD["trials"] >= 1000).all()
    assert RECORD["coverage"].between(0.93, 0.97).all()


def test_a_small_repetition_agrees_with_the_record() -> None:
    """All set-ups together have 1800 intervals, of which 95 % should contain the true value."""
    found = coverage(120, seed=7)
    assert found["quantity"].tolist() == RECORD["quantity"].tolist()
    assert found["coverage"].min() >= 0.88
    assert 0.93 <= found["coverage"].mean() <= 0.97

"""Intervals of removal contain the true value as often as they say."""

import pandas as pd
from paths import ROOT

from benchmarks.removal_coverage import coverage, settings

RECORD = pd.read_csv(ROOT / "docs/data/loading/removal_coverage.csv", keep_default_na=False)


def test_the_recorded_coverage_is_that_of_a_95_percent_interval() -> None:
    named = RECORD[["packings", "weighed_trials", "setting"]].drop_duplicates()
    assert named.to_dict("records") == [key for key, _ in settings()]
    known = RECORD[(RECORD["available"] >= 0.1) & (RECORD["setting"] != "even removal")]
    mean = known.groupby("quantity")["coverage"].apply(lambda one: pd.to_numeric(one).mean())
    assert mean.between(0.93, 0.97).all()
    assert set(RECORD.loc[RECORD["available"] < 1, "quantity"]) <= {
        "5th percentile", "95th percentile"
    }  # fmt: skip


def test_a_small_repetition_agrees_with_the_record() -> None:
    """About 65 quantities, 8 times each; what is not available is known to be so."""
    found = coverage(8, seed=7)
    assert found["quantity"].tolist() == RECORD["quantity"].tolist()
    assert 0.90 <= found["coverage"].mean() <= 0.985
    always = RECORD["available"] > 0.99
    assert (found["available"][always] == 1).mean() > 0.9

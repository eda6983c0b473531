"""Intervals of removal contain the true value as often as they say."""

import pandas as pd
from paths import ROOT
from scipy.stats import binomtest

from benchmarks.removal_coverage import removal_coverage, removal_settings

RECORD = pd.read_csv(ROOT / "docs/data/loading/removal_coverage.csv", keep_default_na=False)


PERCENTILES = {"5th percentile", "95th percentile"}


def test_each_recorded_coverage_is_that_of_a_95_percent_interval() -> None:
    """By binomial intervals that contain all true coverages in 95 % of records (Bonferroni).

    More than 95 % is allowed for percentiles, whose interval spans those of two distributions, for
    the radius of an edge that is not rounded, which cannot be negative, and with two packings,
    whose interval is not narrower than by their scatter alone.
    """
    named = RECORD[["packings", "weighed_trials", "setting"]].drop_duplicates()
    assert named.to_dict("records") == [key for key, _ in removal_settings()]
    known = RECORD[RECORD["available"] >= 0.1]
    rare, frequent = [], []
    for row in known.itertuples():
        cases = round(row.trials * row.available)
        hits = binomtest(round(float(row.coverage) * cases), cases)
        covers = hits.proportion_ci(1 - 0.05 / len(known), method="wilson")
        conservative = row.quantity in PERCENTILES or row.setting == "even removal"
        conservative |= row.packings == 2
        if covers.high < 0.95:
            rare.append(row)
        if covers.low > 0.95 and not conservative:
            frequent.append(row)
    assert not rare and not frequent


def test_only_percentiles_are_ever_not_available() -> None:
    """Where the path is too short; with four times as many events they are."""
    lacking = RECORD[RECORD["available"] < 1]
    assert set(lacking["quantity"]) <= PERCENTILES
    assert (lacking.loc[lacking["setting"].str.contains("120"), "available"] > 0.85).all()


def test_a_small_repetition_agrees_with_the_record() -> None:
    """About 80 quantities, 8 times each; what is not available is known to be so."""
    few = removal_coverage(8, seed=7)
    assert few["quantity"].tolist() == RECORD["quantity"].tolist()
    assert 0.90 <= few["coverage"].mean() <= 0.985
    always = RECORD["available"] > 0.99
    assert (few["available"][always] == 1).mean() > 0.9

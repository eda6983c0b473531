"""Intervals of every kind contain the true value as often as they say, on simulated data."""

import pandas as pd
import pytest
from scipy.stats import binomtest

from benchmarks.interval_coverage import KINDS, RECORD, Simulated, simulate

TRIALS = 100

SHORT = {
    ("mean of a run", 5),
    ("mean of a run", 10),
    ("mean of a run, skewed", 20),
    ("mean of a run, a fifth of it slow", 20),
    ("mean of a run, a fifth of it slow", 80),
    ("mean of a run, a fifth of it slow", 200),
    ("ratio", 10),
    ("drag from windows, scene unlike others", 20),
}
"""Lengths at which a series does not show how short it is, and scenes that do not show how unlike
others they are; the page on statistics says so."""


@pytest.mark.parametrize("case", KINDS, ids=lambda case: case.name)
def test_an_interval_contains_the_true_value(case: Simulated) -> None:
    row = simulate(case, case.lengths[-1], TRIALS)
    held = round(float(str(row["coverage"])) * TRIALS)
    assert binomtest(held, TRIALS, 0.95, alternative="less").pvalue > 1e-3, row


def test_the_record_has_every_kind_and_meets_the_target_where_it_is_not_short() -> None:
    """93 to 97 %: a row fails if its own interval lies outside."""
    rows = pd.read_csv(RECORD)
    assert rows.trials.min() >= 1000
    of_kinds = [(case.name, length) for case in KINDS for length in case.lengths]
    assert list(zip(rows.kind, rows.length, strict=True)) == of_kinds
    unflagged = rows[rows.reliable_coverage.notna()]
    low = {(row.kind, row.length) for row in unflagged.itertuples() if row.reliable_coverage < 0.93}
    assert low <= SHORT

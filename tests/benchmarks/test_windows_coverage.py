"""What windows say contains the truth as often as it should, and is not biased."""

import numpy as np
import pandas as pd
import pytest
from paths import ROOT

from benchmarks.windows_coverage import windows_coverage, windows_settings

RECORD = pd.read_csv(ROOT / "docs/data/windows/coverage.csv")


def test_the_record_is_of_these_settings() -> None:
    names = list(next(windows_settings())[0])
    assert RECORD[names].to_dict("records") == [dict(named) for named, _ in windows_settings()]


def test_intervals_contain_the_truth_and_values_are_not_biased() -> None:
    """Within the binomial uncertainty of the record, and with the drift on the safe side."""
    error = 3.0 * np.sqrt(0.95 * 0.05 / RECORD["trials"])
    assert (RECORD["coverage"] > 0.93 - error).all()
    plain = RECORD[RECORD["drift"] == 0.0]
    assert 0.94 <= plain["coverage"].mean() <= 0.98
    assert (RECORD["bias"].abs() < 0.005 + 3.0 * RECORD["bias_se"]).all()


def test_a_small_repetition_agrees_with_the_record() -> None:
    few = windows_coverage(4, seed=7)
    assert 0.90 <= few["coverage"].mean() <= 0.995
    assert few["cost"].mean() == pytest.approx(RECORD["cost"].mean(), rel=0.2)

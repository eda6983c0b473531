"""Numbers with their intervals."""

import math

import pytest

from dragchain.statistics.estimate import Estimate, mean_of


def test_the_mean_leaves_out_what_is_no_number() -> None:
    both = mean_of([1.0, float("nan"), 3.0])
    assert both.value == 2.0
    assert both.ci95_high - both.value == pytest.approx(12.706, rel=1e-4)  # t of 1 degree, s.e. 1
    assert mean_of([1.0]).value == 1.0 and not mean_of([1.0]).known
    assert math.isnan(mean_of([]).value)


def test_an_estimate_over_a_negative_number_keeps_its_ends_in_order() -> None:
    assert Estimate(2.0, 1.0, 4.0).over(-2.0) == Estimate(-1.0, -2.0, -0.5)

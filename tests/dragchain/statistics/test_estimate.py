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


def test_what_was_expected_is_confirmed_if_the_interval_contains_it() -> None:
    assert Estimate(1.5, 1.0, 2.0).agrees_with(2.0) == "confirmed"
    assert Estimate(1.5, 1.0, 2.0).agrees_with(2.1) == "contradicted"


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (1.1, 1.5, "confirmed"),
        (0.5, 0.9, "contradicted"),
        (0.9, 1.5, "not confirmed"),
        (math.nan, math.nan, "not confirmed"),
    ],
)
def test_an_excess_is_the_interval_against_no_effect(low: float, high: float, verdict: str) -> None:
    assert Estimate((low + high) / 2, low, high).exceeds(1.0) == verdict

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


@pytest.mark.parametrize("values", [(0.97, 0.99), (0.6, 0.9, 1.0), (0.001, 0.02), (0.5, 0.52)])
def test_the_interval_of_a_fraction_ends_in_it(values: tuple[float, ...]) -> None:
    """It has the value, nearly the width where there is room, and stays within 0 to 1."""
    plain = mean_of(values)
    found = plain.within_one
    assert found.value == plain.value
    assert 0.0 < found.ci95_low < found.value < found.ci95_high < 1.0
    if plain.ci95_low > 0.2 and plain.ci95_high < 0.8:
        assert found.half_width == pytest.approx(plain.half_width, rel=0.1)


@pytest.mark.parametrize("values", [(1.0, 1.0), (0.0, 0.0), (0.4,), ()])
def test_a_fraction_without_room_or_interval_stays_as_it_is(values: tuple[float, ...]) -> None:
    plain = mean_of(values)
    assert repr(plain.within_one) == repr(plain)

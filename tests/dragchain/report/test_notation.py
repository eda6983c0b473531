"""Numbers as text."""

import pytest

from dragchain.report.notation import (
    MINUS,
    fixed,
    fraction,
    interval,
    measured,
    number,
    percent,
    with_interval,
)
from dragchain.statistics.estimate import Estimate


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-2.626, "\N{MINUS SIGN}2.63"), (0.0, "0"), (1234.5, "1234"),
        (160000, "160\N{NARROW NO-BREAK SPACE}000"),
        (2727567.0, "2\N{NARROW NO-BREAK SPACE}727\N{NARROW NO-BREAK SPACE}567"),
        (1.66e-5, "1.66 \N{MULTIPLICATION SIGN} 10⁻⁵"), (None, "\N{EN DASH}"),
        (float("nan"), "\N{EN DASH}"),
        (float("inf"), "\N{EN DASH}"), ("draft", "draft"), (True, "True"),
    ],
)  # fmt: skip
def test_numbers_read_well(value: object, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.7, "0.700"), (18.0, "18.0"), (-2.5, "\N{MINUS SIGN}2.50"), (345.6, "346"),
        (4321.0, "4321"), (0.0, "0"), (4, "4"), (None, "\N{EN DASH}"),
    ],
)  # fmt: skip
def test_measured_numbers_keep_their_zeros(value: object, text: str) -> None:
    assert measured(value) == text


@pytest.mark.parametrize(
    ("ends", "text"),
    [
        ((-2.641, -2.784, -2.502), f"{MINUS}2.64 N ({MINUS}2.78 to {MINUS}2.50)"),
        ((23.31, 18.5, 29.36), "23.3 N (18.5 to 29.4)"),
        ((0.0231234, 0.0231233, 0.0231235), "0.02312 N (0.02312 to 0.02312)"),
        ((1.713e-5, 1.288e-5, 2.279e-5), "1.71 (1.29 to 2.28) \N{MULTIPLICATION SIGN} 10⁻⁵ N"),
        ((38094.5, 33627.0, 42455.0), "38\u202f094 N (33\u202f627 to 42\u202f455)"),
        ((0.7, float("nan"), float("nan")), "0.700 N"), ((4.0, 4.0, 4.0), "4.00 N"),
    ],
)  # fmt: skip
def test_a_value_has_the_decimals_of_its_interval(
    ends: tuple[float, float, float], text: str
) -> None:
    assert with_interval(Estimate(*ends), "N") == text


def test_percent_carries_its_sign() -> None:
    assert percent(1.26) == "+1.3 %"
    assert percent(-23.17) == "\N{MINUS SIGN}23.2 %"
    assert percent(None) == "\N{EN DASH}"
    assert fraction(-0.034) == "\N{MINUS SIGN}3.4 %"


def test_fixed_decimals_may_carry_their_sign() -> None:
    assert fixed(-0.25, 1) == "\N{MINUS SIGN}0.2"
    assert fixed(0.0146, 4) == "0.0146" and fixed(0.5, 2, sign=True) == "+0.50"
    assert fixed(None, 2) == "\N{EN DASH}"


def test_an_estimate_shows_its_interval() -> None:
    estimate = {"value": 2.0, "ci95_low": 1.5, "ci95_high": None}
    assert interval(estimate, 2) == "2.0 (1.5 to \N{EN DASH})"

"""Numbers as text."""

import pytest

from dragchain.report.notation import fixed, fraction, interval, measured, number, percent


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-2.626, "\N{MINUS SIGN}2.63"), (0.0, "0"), (1234.5, "1234"), (160000, "160 000"),
        (2.5e-5, "2.5e-05"), (None, "\N{EN DASH}"), (float("nan"), "\N{EN DASH}"),
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

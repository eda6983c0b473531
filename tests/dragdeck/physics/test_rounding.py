"""Limits in messages are accepted themselves."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dragdeck.physics.rounding import limit_of


@given(st.floats(1e-12, 1e12), st.booleans())
def test_a_limit_is_never_beyond_what_is_accepted(value: float, up: bool) -> None:
    shown = float(limit_of(value, up=up))
    assert shown == pytest.approx(value, rel=1.1e-3)
    assert shown >= value * (1 - 1e-9) if up else shown <= value * (1 + 1e-9)


def test_what_is_not_positive_is_shown() -> None:
    assert limit_of(-0.0125) == "-0.0125" and limit_of(0.0) == "0"

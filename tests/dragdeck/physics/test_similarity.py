"""Carrying settings from the measured scene to another."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dragdeck.cases.case import Case
from dragdeck.physics.contact_mechanics import SOLID_FRACTION_ESTIMATE
from dragdeck.physics.rounding import rounded
from dragdeck.physics.similarity import carried_scale, carried_speed, softest_scale
from dragdeck.scenes.dimensionless import describe
from dragdeck.sweep.cases import load_cases

LEVELS = (1e-3, 2e-3, 0.01, 0.03, 0.1, 0.3, 1.0)
FACTORS = (1.0, 1.5, 2.0, 4.0, 10.0)
RATIO = st.floats(0.02, 50.0)


def test_numbers_of_a_scene_by_hand(case: Case) -> None:
    found = describe(case)
    pressure = SOLID_FRACTION_ESTIMATE * 2656 * 9.81 * 0.015
    modulus = 77e9 / (1 - 0.19**2)
    assert found["stiffness_number"] == pytest.approx((modulus / pressure) ** (2 / 3), rel=1e-12)
    assert found["inertial_number"] == pytest.approx(0.02 / math.sqrt(pressure / 2656), rel=1e-12)
    assert found["depth_to_particle"] == pytest.approx(0.015 / 6.54e-3)
    assert found["bowl_to_particle"] == pytest.approx(0.05 / 6.54e-3)
    assert found["workpiece_to_particle"] == pytest.approx(0.008 / 6.54e-3, rel=0.05)
    assert (found["particle_friction"], found["workpiece_friction"]) == (0.34, 0.28)
    assert found["lowest_restitution"] == 0.68


def test_denser_particles_are_softer_and_slower_in_these_numbers(
    small: dict[str, Any], write_study: Callable[..., Path], case: Case
) -> None:
    small["materials"]["ceramic"]["density_kg_m3"] *= 8
    (heavy,) = load_cases(write_study(small))
    before, after = describe(case), describe(heavy)
    assert after["stiffness_number"] == pytest.approx(before["stiffness_number"] / 4)
    assert after["inertial_number"] == pytest.approx(before["inertial_number"])


@pytest.mark.parametrize("level", LEVELS)
def test_the_measured_scene_gets_exactly_the_measured_level(level: float) -> None:
    assert carried_scale(level, 1.0) == carried_scale(level, 1.011) == level
    assert carried_speed(1 / level, 1.0) == carried_speed(1 / level, 0.99) == 1 / level


@given(st.sampled_from(LEVELS), RATIO)
def test_the_stiffness_number_is_never_below_the_measured_one(level: float, ratio: float) -> None:
    scale = carried_scale(level, ratio)
    assert 0 < scale <= 1
    if scale < 1 and abs(ratio - 1) > 0.02:
        assert ratio * scale ** (2 / 3) >= level ** (2 / 3) * (1 - 1e-6)
        # nor is more elasticity given away than was in the measurement
        given_away = (scale ** (-2 / 3) - 1) / ratio
        assert given_away <= (level ** (-2 / 3) - 1) * (1 + 1e-6)


@given(st.sampled_from(FACTORS), RATIO)
def test_the_inertial_number_is_never_above_the_measured_one(factor: float, ratio: float) -> None:
    carried = carried_speed(factor, ratio)
    assert 1 <= carried <= 100
    if carried > 1 and abs(ratio - 1) > 0.02:
        assert carried / ratio <= factor * (1 + 1e-6)
        assert (carried - 1) / ratio <= (factor - 1) * (1 + 1e-6)


@given(st.sampled_from(LEVELS), st.sampled_from(FACTORS), RATIO, RATIO)
def test_carrying_is_monotonic(level: float, factor: float, one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert carried_scale(level, low) >= carried_scale(level, high)
    assert carried_speed(factor, low) <= carried_speed(factor, high)


@given(RATIO)
def test_the_reference_stays_the_reference(ratio: float) -> None:
    assert carried_scale(1.0, ratio) == carried_speed(1.0, ratio) == 1.0


@pytest.mark.parametrize(
    ("value", "up", "down"),
    [(0.0123, 0.013, 0.012), (0.01, 0.01, 0.01), (3.16, 3.2, 3.1), (99.5, 100.0, 99.0)],
)
def test_two_digits_up_and_down(value: float, up: float, down: float) -> None:
    assert rounded(value, up=True) == up
    assert rounded(value, up=False) == down


def test_the_engine_limits_how_soft(case: Case) -> None:
    assert softest_scale(case.study) == 6.5e-5  # 5e6 / 77e9 is 6.494e-5

"""The dimensionless numbers of a scene, rounded limits, and how soft particles may be."""

import math
from typing import Any

import pytest
from made_study import Made

from dragdeck.cases.bed import softest_scale
from dragdeck.cases.case import Case
from dragdeck.physics.estimates import SOLID_FRACTION_ESTIMATE
from dragdeck.physics.rounding import rounded
from dragdeck.scenes.numbers import describe


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
    small: dict[str, Any], case: Case, made: Made
) -> None:
    small["materials"]["ceramic"]["density_kg_m3"] *= 8
    heavy = made()
    before, after = describe(case), describe(heavy)
    assert after["stiffness_number"] == pytest.approx(before["stiffness_number"] / 4)
    assert after["inertial_number"] == pytest.approx(before["inertial_number"])


@pytest.mark.parametrize(
    ("value", "up", "down"),
    [(0.0123, 0.013, 0.012), (0.01, 0.01, 0.01), (3.16, 3.2, 3.1), (99.5, 100.0, 99.0)],
)
def test_two_digits_up_and_down(value: float, up: float, down: float) -> None:
    assert rounded(value, up=True) == up
    assert rounded(value, up=False) == down


def test_the_engine_limits_how_soft(case: Case) -> None:
    assert softest_scale(case.study) == 6.5e-5  # 5e6 / 77e9 is 6.494e-5

"""Effective moduli, masses and the contact time of Hertz."""

import pytest

from dragchain.contact_law.hertz import (
    Elastic,
    contact_time,
    effective_modulus,
    sphere_mass,
)
from evidence.verification.law import CONTACT_TIME, ContactPair, Particle, largest_overlap

STEEL = Elastic(2e11, 0.3)


def test_moduli_of_two_equal_bodies() -> None:
    assert effective_modulus(STEEL, STEEL) == pytest.approx(2e11 / 0.91 / 2)


def test_the_contact_time_is_that_of_the_largest_overlap() -> None:
    mass = sphere_mass(0.0025, 2500.0)
    plane = ContactPair(Particle(mass, 0.0025), None, 6e10, 1.3e10, 1.0, 0.0, True)
    exact = CONTACT_TIME * largest_overlap(plane, 0.5) / 0.5
    assert contact_time(mass, 0.0025, 6e10, 0.5) == pytest.approx(exact, rel=1e-3)

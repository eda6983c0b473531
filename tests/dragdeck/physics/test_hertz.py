"""Effective moduli, masses and the contact time of Hertz."""

import pytest

from dragdeck.physics.contact_mechanics import (
    Elastic,
    effective_modulus,
    effective_shear,
    hertz_contact_time,
    sphere_mass,
)
from evidence.verification.law import ContactPair, Particle, elastic_time

STEEL = Elastic(2e11, 0.3)


def test_moduli_of_two_equal_bodies() -> None:
    assert effective_modulus(STEEL, STEEL) == pytest.approx(2e11 / 0.91 / 2)
    assert effective_shear(STEEL, STEEL) == pytest.approx(2e11 / (4 * 1.7 * 1.3))


def test_the_contact_time_is_that_of_the_largest_overlap() -> None:
    mass = sphere_mass(0.0025, 2500.0)
    plane = ContactPair(Particle(mass, 0.0025), None, 6e10, 1.3e10, 1.0, 0.0, True)
    exact = elastic_time(plane, 0.5)
    assert hertz_contact_time(mass, 0.0025, 6e10, 0.5) == pytest.approx(exact, rel=1e-3)

"""The exact formulae of an impact against oracles of their own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from evidence.contact_law import impact as law
from evidence.contact_law.impact import Contact, Motion, Particle

PARTICLE = Particle(1.74e-4, 0.0025)
PLANE = Contact(PARTICLE, None, 6e10, 1.3e10, 0.7, 0.3, True)
PAIR = replace(PLANE, partner=Particle(3.0e-4, 0.003))


def test_the_constant_of_the_contact_time_is_its_integral() -> None:
    half, _ = quad(lambda x: 1 / math.sqrt(1 - x**2.5), 0, 1)
    assert pytest.approx(2 * half, rel=1e-7) == law.CONTACT_TIME


def test_the_largest_overlap_stores_the_whole_energy() -> None:
    deepest = law.largest_overlap(PLANE, 0.5)
    work, _ = quad(lambda overlap: float(law.hertz_force(PLANE, overlap)), 0, deepest)
    assert work == pytest.approx(0.5 * PLANE.mass_kg * 0.5**2, rel=1e-9)


def test_overlap_and_force_are_each_others_inverse() -> None:
    assert law.hertz_overlap(PLANE, float(law.hertz_force(PLANE, 3e-6))) == pytest.approx(3e-6)


def test_effective_mass_and_radius_of_equal_particles_are_half() -> None:
    pair = replace(PLANE, partner=PARTICLE)
    assert pair.mass_kg == pytest.approx(PARTICLE.mass_kg / 2)
    assert pair.radius_m == pytest.approx(PARTICLE.radius_m / 2)


def linear_rebound(restitution: float) -> float:
    """Rebound of a linear spring and dashpot that cannot pull, by its own closed motion."""
    damping, frequency = -math.log(restitution) / math.pi, 1.0
    times = np.linspace(1e-6, math.pi, 400_001)
    decay = np.exp(-damping * times)
    place = decay * np.sin(frequency * times)
    speed = decay * (frequency * np.cos(frequency * times) - damping * np.sin(frequency * times))
    force = (damping**2 + frequency**2) * place + 2 * damping * speed
    return float(-speed[np.argmax(force < 0)])


@pytest.mark.parametrize("restitution", [0.06, 0.3, 0.68, 0.9])
def test_the_limited_rebound_is_that_of_a_linear_contact(restitution: float) -> None:
    expected = linear_rebound(restitution)
    assert law.limited_restitution(restitution) == pytest.approx(expected, abs=1e-5)


def test_the_limit_changes_nothing_when_nothing_is_damped() -> None:
    assert law.limited_restitution(1.0) == 1.0


@pytest.mark.parametrize("contact", [PLANE, PAIR])
def test_a_rigid_slide_keeps_the_angular_momentum_about_the_contact(contact: Contact) -> None:
    before = Motion(0.5, 3.0, 20.0, -10.0)
    after = law.sliding_impact(contact, before)
    assert after is not None
    impulse = contact.mass_kg * (before.tangential_m_s - after.tangential_m_s)
    assert impulse == pytest.approx(0.3 * contact.mass_kg * (1 + contact.rebound) * 0.5)
    turned = contact.particle.inertia_kg_m2 * (before.spin_rad_s - after.spin_rad_s)
    assert turned == pytest.approx(contact.particle.radius_m * impulse)


def test_a_rigid_slide_ends_where_the_surfaces_stop() -> None:
    limit = 3.5 * 0.3 * (1 + PLANE.rebound) * 0.5
    just = law.sliding_impact(PLANE, Motion(0.5, 1.0001 * limit))
    assert just is not None
    assert just.patch_m_s(PLANE) == pytest.approx(0.0, abs=1e-3 * limit)
    assert law.sliding_impact(PLANE, Motion(0.5, 0.999 * limit)) is None

"""The exact formulae of an impact, and the law integrated, against oracles of their own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from dragdeck.physics.contact_mechanics import hertz_overlap
from evidence.verification import law
from evidence.verification.law import (
    ContactPair,
    HertzLaw,
    Particle,
    RelativeMotion,
    integrated_impact,
)

PARTICLE = Particle(1.74e-4, 0.0025)
PLANE = ContactPair(PARTICLE, None, 6e10, 1.3e10, 0.7, 0.3, True)
ELASTIC = replace(PLANE, restitution=1.0)
PAIR = replace(PLANE, partner=Particle(3.0e-4, 0.003))


def test_the_constant_of_the_contact_time_is_its_integral() -> None:
    half, _ = quad(lambda x: 1 / math.sqrt(1 - x**2.5), 0, 1)
    assert pytest.approx(2 * half, rel=1e-7) == law.CONTACT_TIME


def test_the_largest_overlap_stores_the_whole_energy() -> None:
    deepest = law.largest_overlap(PLANE, 0.5)
    work, _ = quad(lambda overlap: float(law.hertz_force(PLANE, overlap)), 0, deepest)
    assert work == pytest.approx(0.5 * PLANE.mass_kg * 0.5**2, rel=1e-9)


def test_overlap_and_force_are_each_others_inverse() -> None:
    force = float(law.hertz_force(PLANE, 3e-6))
    assert hertz_overlap(force, PLANE.radius_m, PLANE.modulus_pa) == pytest.approx(3e-6)


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
def test_a_rigid_slide_keeps_the_angular_momentum_about_the_contact(contact: ContactPair) -> None:
    before = RelativeMotion(0.5, 3.0, 20.0, -10.0)
    after = law.sliding_impact(contact, before)
    assert after is not None
    impulse = contact.mass_kg * (before.tangential_m_s - after.tangential_m_s)
    assert impulse == pytest.approx(0.3 * contact.mass_kg * (1 + contact.rebound) * 0.5)
    turned = contact.particle.inertia_kg_m2 * (before.spin_rad_s - after.spin_rad_s)
    assert turned == pytest.approx(contact.particle.radius_m * impulse)


def test_a_rigid_slide_ends_where_the_surfaces_stop() -> None:
    limit = 3.5 * 0.3 * (1 + PLANE.rebound) * 0.5
    just = law.sliding_impact(PLANE, RelativeMotion(0.5, 1.0001 * limit))
    assert just is not None
    assert just.patch_m_s(PLANE) == pytest.approx(0.0, abs=1e-3 * limit)
    assert law.sliding_impact(PLANE, RelativeMotion(0.5, 0.999 * limit)) is None


@pytest.mark.parametrize("contact", [ELASTIC, replace(PAIR, restitution=1.0)])
def test_an_elastic_impact_is_hertzian(contact: ContactPair) -> None:
    found = integrated_impact(contact, RelativeMotion(0.5))
    deepest = law.largest_overlap(contact, 0.5)
    assert found.overlap_m == pytest.approx(deepest, rel=1e-3)  # read at steps, not at the peak
    assert found.duration_s == pytest.approx(law.elastic_time(contact, 0.5), rel=1e-4)
    assert found.after.normal_m_s == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("restitution", [0.06, 0.3, 0.68, 0.98])
@pytest.mark.parametrize("speed", [0.01, 4.0])
@pytest.mark.parametrize("limit", [True, False])
def test_the_integrated_rebound_is_the_exact_one(
    restitution: float, speed: float, limit: bool
) -> None:
    contact = replace(PLANE, restitution=restitution, limit_force=limit)
    found = integrated_impact(contact, RelativeMotion(speed)).after.normal_m_s / speed
    assert found == pytest.approx(contact.rebound, rel=1e-5)


def test_the_rate_of_the_spring_limit_is_a_derivative() -> None:
    model = HertzLaw(replace(PLANE, limit_force=False))
    state = np.array([2e-6, 0.3, 0.0, 0.0, 0.0, 0.0])
    rates = np.array(model.rates(1, 0.0, state))
    ahead, behind = (model.spring_limit(state + way * 1e-9 * rates) for way in (1, -1))
    assert model.spring_limit_rate(state) == pytest.approx((ahead - behind) / 2e-9, rel=1e-5)


def test_an_elastic_slide_has_coulombs_impulse() -> None:
    before = RelativeMotion(0.5, 4.0)
    after = integrated_impact(ELASTIC, before).after
    rigid = law.sliding_impact(ELASTIC, before)
    assert rigid is not None
    assert after.tangential_m_s == pytest.approx(rigid.tangential_m_s, rel=1e-6)
    arm = law.largest_overlap(ELASTIC, 0.5) / PARTICLE.radius_m
    assert abs(after.spin_rad_s) == pytest.approx(abs(rigid.spin_rad_s), rel=arm)
    assert abs(after.spin_rad_s) < abs(rigid.spin_rad_s)


def test_a_damped_slide_exceeds_coulombs_impulse() -> None:
    before = RelativeMotion(0.5, 4.0)
    after = integrated_impact(PLANE, before).after
    rigid = law.sliding_impact(PLANE, before)
    assert rigid is not None
    assert after.tangential_m_s < rigid.tangential_m_s - 1e-3


@pytest.mark.parametrize("speed", [0.05, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("limit", [True, False])
def test_a_mirrored_impact_is_the_mirror_image(speed: float, limit: bool) -> None:
    contact = replace(PLANE, limit_force=limit)
    one = integrated_impact(contact, RelativeMotion(0.5, speed)).after
    other = integrated_impact(contact, RelativeMotion(0.5, -speed)).after
    assert other.tangential_m_s == pytest.approx(-one.tangential_m_s, rel=1e-6)
    assert other.spin_rad_s == pytest.approx(-one.spin_rad_s, rel=1e-6)


def test_a_huge_partner_is_a_plane() -> None:
    huge = replace(PLANE, partner=Particle(1e6, 1e6))
    before = RelativeMotion(0.5, 0.4)
    on_plane, on_particle = (integrated_impact(c, before).after for c in (PLANE, huge))
    assert on_particle.tangential_m_s == pytest.approx(on_plane.tangential_m_s, rel=1e-5)
    assert on_particle.spin_rad_s == pytest.approx(on_plane.spin_rad_s, rel=1e-5)


def explicit_impact(contact: ContactPair, before: RelativeMotion, steps: int) -> RelativeMotion:
    """The law in the engine's own steps: small, explicit, with the spring cut back."""
    model = HertzLaw(contact)
    state = np.array([0.0, before.normal_m_s, 0.0, before.tangential_m_s, before.spin_rad_s, 0.0])
    dt = law.elastic_time(contact, before.normal_m_s) / steps
    while state[0] >= 0.0 and state[1] > -2 * before.normal_m_s:
        state[0] += dt * state[1]
        if state[0] <= 0.0:
            break
        patch = model.patch(state)
        state[2] += dt * patch
        limit = model.spring_limit(state)
        way = int(math.copysign(1, state[2])) if abs(state[2]) > limit else 0
        state[2] = way * limit if way else state[2]
        rates = np.array(model.rates(way, 0.0, state))
        state[[1, 3, 4]] += dt * rates[[1, 3, 4]]
    return RelativeMotion(-float(state[1]), float(state[3]), float(state[4]))


@pytest.mark.parametrize("tangential", [0.1, 0.6, 3.0])
@pytest.mark.parametrize("limit", [True, False])
def test_events_find_the_same_motion_as_small_steps(tangential: float, limit: bool) -> None:
    contact, before = replace(PLANE, limit_force=limit), RelativeMotion(0.5, tangential)
    exact = integrated_impact(contact, before).after
    stepped = explicit_impact(contact, before, 20_000)
    assert stepped.normal_m_s == pytest.approx(exact.normal_m_s, rel=1e-3)
    assert stepped.tangential_m_s == pytest.approx(exact.tangential_m_s, rel=2e-3)
    assert stepped.spin_rad_s == pytest.approx(exact.spin_rad_s, rel=1e-2)

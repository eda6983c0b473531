"""The integrated contact law against oracles of its own."""

import math
from dataclasses import replace

import numpy as np
import pytest

from evidence.contact_law import impact as law
from evidence.contact_law.impact import Contact, Motion, Particle
from evidence.contact_law.integrated_impact import HertzLaw, integrated_impact

PARTICLE = Particle(1.74e-4, 0.0025)
PLANE = Contact(PARTICLE, None, 6e10, 1.3e10, 0.7, 0.3, True)
ELASTIC = replace(PLANE, restitution=1.0)
PAIR = replace(PLANE, partner=Particle(3.0e-4, 0.003))


@pytest.mark.parametrize("contact", [ELASTIC, replace(PAIR, restitution=1.0)])
def test_an_elastic_impact_is_hertzian(contact: Contact) -> None:
    found = integrated_impact(contact, Motion(0.5))
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
    found = integrated_impact(contact, Motion(speed)).after.normal_m_s / speed
    assert found == pytest.approx(contact.rebound, rel=1e-5)


def test_the_rate_of_the_spring_limit_is_a_derivative() -> None:
    model = HertzLaw(replace(PLANE, limit_force=False))
    state = np.array([2e-6, 0.3, 0.0, 0.0, 0.0, 0.0])
    rates = np.array(model.rates(1, 0.0, state))
    ahead, behind = (model.spring_limit(state + way * 1e-9 * rates) for way in (1, -1))
    assert model.spring_limit_rate(state) == pytest.approx((ahead - behind) / 2e-9, rel=1e-5)


def test_an_elastic_slide_has_coulombs_impulse() -> None:
    before = Motion(0.5, 4.0)
    after = integrated_impact(ELASTIC, before).after
    rigid = law.sliding_impact(ELASTIC, before)
    assert rigid is not None
    assert after.tangential_m_s == pytest.approx(rigid.tangential_m_s, rel=1e-6)
    arm = law.largest_overlap(ELASTIC, 0.5) / PARTICLE.radius_m
    assert abs(after.spin_rad_s) == pytest.approx(abs(rigid.spin_rad_s), rel=arm)
    assert abs(after.spin_rad_s) < abs(rigid.spin_rad_s)


def test_a_damped_slide_exceeds_coulombs_impulse() -> None:
    before = Motion(0.5, 4.0)
    after = integrated_impact(PLANE, before).after
    rigid = law.sliding_impact(PLANE, before)
    assert rigid is not None
    assert after.tangential_m_s < rigid.tangential_m_s - 1e-3


@pytest.mark.parametrize("speed", [0.05, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("limit", [True, False])
def test_a_mirrored_impact_is_the_mirror_image(speed: float, limit: bool) -> None:
    contact = replace(PLANE, limit_force=limit)
    one = integrated_impact(contact, Motion(0.5, speed)).after
    other = integrated_impact(contact, Motion(0.5, -speed)).after
    assert other.tangential_m_s == pytest.approx(-one.tangential_m_s, rel=1e-6)
    assert other.spin_rad_s == pytest.approx(-one.spin_rad_s, rel=1e-6)


def test_a_huge_partner_is_a_plane() -> None:
    huge = replace(PLANE, partner=Particle(1e6, 1e6))
    before = Motion(0.5, 0.4)
    on_plane, on_particle = (integrated_impact(c, before).after for c in (PLANE, huge))
    assert on_particle.tangential_m_s == pytest.approx(on_plane.tangential_m_s, rel=1e-5)
    assert on_particle.spin_rad_s == pytest.approx(on_plane.spin_rad_s, rel=1e-5)


def explicit_impact(contact: Contact, before: Motion, steps: int) -> Motion:
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
    return Motion(-float(state[1]), float(state[3]), float(state[4]))


@pytest.mark.parametrize("tangential", [0.1, 0.6, 3.0])
@pytest.mark.parametrize("limit", [True, False])
def test_events_find_the_same_motion_as_small_steps(tangential: float, limit: bool) -> None:
    contact, before = replace(PLANE, limit_force=limit), Motion(0.5, tangential)
    exact = integrated_impact(contact, before).after
    stepped = explicit_impact(contact, before, 20_000)
    assert stepped.normal_m_s == pytest.approx(exact.normal_m_s, rel=1e-3)
    assert stepped.tangential_m_s == pytest.approx(exact.tangential_m_s, rel=2e-3)
    assert stepped.spin_rad_s == pytest.approx(exact.spin_rad_s, rel=1e-2)

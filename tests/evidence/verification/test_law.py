"""The exact formulae of an impact, and the law integrated, against oracles of their own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from evidence.verification import law
from evidence.verification.law import ContactPair, Particle, RelativeMotion

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


def integrated(contact: ContactPair, *before: RelativeMotion) -> list[RelativeMotion]:
    return law.integrated_impacts([contact] * len(before), before)


@pytest.mark.parametrize("partner", [None, PAIR.partner])
def test_the_integrated_rebound_is_the_exact_one(partner: Particle | None) -> None:
    contacts = [
        replace(PLANE, partner=partner, restitution=restitution, limit_force=limit)
        for restitution in (0.06, 0.3, 0.68, 1.0)
        for limit in (True, False)
    ]
    ends = law.integrated_impacts(contacts, [RelativeMotion(0.5)] * len(contacts))
    for contact, after in zip(contacts, ends, strict=True):
        assert after.normal_m_s / 0.5 == pytest.approx(contact.rebound, abs=2e-4)


def test_an_elastic_slide_has_coulombs_impulse_and_a_damped_one_more() -> None:
    before = RelativeMotion(0.5, 4.0)
    for contact in (ELASTIC, PLANE):
        (after,), rigid = integrated(contact, before), law.sliding_impact(contact, before)
        assert rigid is not None
        if contact is PLANE:
            assert after.tangential_m_s < rigid.tangential_m_s - 1e-3
            continue
        assert after.tangential_m_s == pytest.approx(rigid.tangential_m_s, rel=1e-4)
        arm = law.largest_overlap(ELASTIC, 0.5) / PARTICLE.radius_m
        assert abs(after.spin_rad_s) == pytest.approx(abs(rigid.spin_rad_s), rel=arm)
        assert abs(after.spin_rad_s) < abs(rigid.spin_rad_s)


def test_impacts_end_as_the_law_integrated_with_an_adaptive_step() -> None:
    """Values of a solution whose steps end at each change of sticking and sliding (1912e1d)."""
    contacts = [replace(PLANE, limit_force=limit) for limit in (True, False)]
    before = [RelativeMotion(0.5, speed) for speed in (0.1, 0.6, 3.0)]
    known = (
        (0.359101, 0.081076, -18.920319), (0.359101, 0.396251, -203.665061),
        (0.3591, 2.736749, -263.147308),
        (0.35, 0.078925, -21.071105), (0.35, 0.401915, -198.001456), (0.35, 2.73303, -266.866056),
    )  # fmt: skip
    ends = [after for contact in contacts for after in integrated(contact, *before)]
    for after, (normal, along, spin) in zip(ends, known, strict=True):
        assert after.normal_m_s == pytest.approx(normal, abs=1e-4)
        assert after.tangential_m_s == pytest.approx(along, abs=5e-4)
        assert after.spin_rad_s == pytest.approx(spin, abs=0.15)


def test_a_huge_partner_is_a_plane_and_a_mirrored_impact_the_mirror_image() -> None:
    huge = replace(PLANE, partner=Particle(1e6, 1e6))
    before = RelativeMotion(0.5, 0.4), RelativeMotion(0.5, -0.4)
    (first, second), (on_huge, _) = integrated(PLANE, *before), integrated(huge, *before)
    assert on_huge.tangential_m_s == pytest.approx(first.tangential_m_s, rel=1e-5)
    assert (second.tangential_m_s, second.spin_rad_s) == (-first.tangential_m_s, -first.spin_rad_s)

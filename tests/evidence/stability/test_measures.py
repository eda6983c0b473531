"""What is measured of a run: its contacts, and networks whose frequencies are known."""

import math

import numpy as np
import pytest

from dragdeck.physics.contact_mechanics import ContactConstants, sphere_mass
from dragdeck.records.case import CaseOfRun, MediaOfRun
from evidence.stability.measures import (
    BOWL,
    PARTICLE,
    WORKPIECE,
    Contacts,
    critical_step,
    damped_fraction,
    hertz_stiffness,
    largest_frequency,
    network_frequency,
    touching,
)

MASS, NORMAL, TANGENTIAL = 4e-4, 1e5, 8e4


def frequency(
    a: list[int], b: list[int], normal: list[list[float]], tangential: float = TANGENTIAL
) -> float:
    mass = np.full(max([*a, *b]) + 1, MASS)
    stiffness = np.full(len(a), NORMAL), np.full(len(a), tangential)
    return largest_frequency(mass, np.array(a), np.array(b), np.array(normal), stiffness)


TILTED = [0.6, 0.0, 0.8]


@pytest.mark.parametrize("normal", [[0.0, 0.0, -1.0], TILTED])
def test_a_particle_on_a_wall_rolls_and_slides(normal: list[float]) -> None:
    """Sliding and rolling together: k_t (1/m + R^2/I) = 3.5 k_t/m."""
    found = frequency([0], [-1], [normal])
    assert found == pytest.approx(np.sqrt(3.5 * TANGENTIAL / MASS), rel=1e-12)


def test_without_friction_only_the_normal_counts() -> None:
    on_wall = frequency([0], [-1], [TILTED], tangential=0.0)
    assert on_wall == pytest.approx(np.sqrt(NORMAL / MASS), rel=1e-12)
    pair = frequency([0], [1], [TILTED], tangential=0.0)
    assert pair == pytest.approx(np.sqrt(2 * NORMAL / MASS), rel=1e-12)


def test_two_particles_double_it() -> None:
    found = frequency([0], [1], [TILTED])
    assert found == pytest.approx(np.sqrt(7 * TANGENTIAL / MASS), rel=1e-12)


@pytest.mark.parametrize("count", [5, 60])
def test_a_chain_between_walls_has_the_frequency_of_the_textbook(count: int) -> None:
    """N masses, N + 1 springs, fixed ends: 2 sqrt(k/m) sin(N pi / (2 (N + 1)))."""
    a = [*range(count), 0]
    b = [*range(1, count), -1, -1]
    normals = [[1.0, 0.0, 0.0]] * count + [[-1.0, 0.0, 0.0]]
    found = frequency(a, b, normals, tangential=0.0)
    known = 2 * np.sqrt(NORMAL / MASS) * np.sin(count * np.pi / (2 * (count + 1)))
    assert found == pytest.approx(known, rel=1e-9)


def test_no_contact_has_no_limit() -> None:
    none, nowhere = np.zeros(0, int), np.zeros((0, 3))
    found = largest_frequency(np.ones(2), none, none, nowhere, (np.zeros(0), np.zeros(0)))
    assert critical_step(found) == np.inf


def test_hertz_stiffness_is_the_slope_of_the_force() -> None:
    overlap, radius, modulus, shear = (np.array([v]) for v in (1e-6, 0.002, 4e10, 9e9))
    normal, tangential = hertz_stiffness(overlap, radius, modulus, shear)

    def force(d: float) -> float:
        return float(4 / 3 * modulus[0] * np.sqrt(radius[0]) * d**1.5)

    slope = (force(1.0001e-6) - force(0.9999e-6)) / 2e-10
    assert normal[0] == pytest.approx(slope, rel=1e-6)
    assert tangential[0] == pytest.approx(4 * shear[0] / modulus[0] * normal[0], rel=1e-12)
    assert hertz_stiffness(-overlap, radius, modulus, shear)[0][0] == 0.0


def test_damping_makes_the_step_smaller() -> None:
    assert damped_fraction(1.0) == 1.0
    assert damped_fraction(0.06) < damped_fraction(0.5) < damped_fraction(0.86) < 1.0


def test_the_critical_step_of_central_differences_with_lagging_damping() -> None:
    """The engine's own order of things: half a kick, a move, the force with that speed, a kick."""
    restitution, omega = 0.3, 1.0
    log = abs(np.log(restitution))
    ratio = np.sqrt(5 / 6) * log / np.hypot(log, np.pi)

    def grows(step: float) -> bool:
        x, v, a = 1.0, 0.0, -1.0
        for _ in range(4000):
            v += 0.5 * step * a
            x += step * v
            a = -(omega**2) * x - 2 * ratio * omega * v
            v += 0.5 * step * a
        return abs(x) > 1.0

    limit = critical_step(omega) * damped_fraction(restitution)
    assert not grows(0.99 * limit)
    assert grows(1.01 * limit)


def test_particles_that_touch_are_found_with_their_overlaps() -> None:
    centre = np.array([[0.0, 0.0, 0.9], [1.9, 0.0, 1.0], [1.9, 0.0, 3.1]])
    found = touching(centre, np.ones(3), bowl_radius_m=2.7)
    rows = sorted(zip(found.a.tolist(), found.b.tolist(), found.overlap_m.tolist(), strict=True))
    assert [row[:2] for row in rows] == [(0, -1), (0, 1), (1, -1), (2, -1)]
    gap = math.hypot(1.9, 0.1)
    assert [row[2] for row in rows] == pytest.approx([0.1, 2 - gap, 0.2, 0.2])
    assert found.partner.tolist() == [BOWL if b < 0 else PARTICLE for b in found.b]


@pytest.mark.parametrize(("partner", "modulus"), [(BOWL, 1e9), (WORKPIECE, 4e9)])
def test_each_contact_has_the_moduli_of_its_partner(partner: int, modulus: float) -> None:
    """One particle on a plane without friction: the root of 2 E* sqrt(R d) / m."""
    moduli = {
        name: ContactConstants(modulus_pa=own, shear_pa=1.0, restitution=0.9, friction=0.3)
        for name, own in (("particle", 7e9), ("bowl", 1e9), ("workpiece", 4e9))
    }
    media = MediaOfRun(count=1, radius_mean_m=1e-3, radius_std_m=0.0, density_kg_m3=2500.0)
    case = CaseOfRun.model_construct(contact_moduli=moduli, media=media)
    plane = Contacts(
        a=np.array([0]),
        b=np.array([-1]),
        partner=np.array([partner]),
        normal=np.array([[0.0, 0.0, -1.0]]),
        overlap_m=np.array([1e-6]),
    )
    stiffness = 2 * modulus * math.sqrt(1e-3 * 1e-6)
    found = network_frequency(case, False, np.array([1e-3]), plane)
    assert found == pytest.approx(math.sqrt(stiffness / sphere_mass(1e-3, 2500.0)))

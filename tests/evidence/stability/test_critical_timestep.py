"""The critical step: networks whose frequencies are known in closed form."""

import numpy as np
import pytest

from evidence.stability.critical_timestep import (
    critical_step,
    damped_fraction,
    hertz_stiffness,
    largest_frequency,
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

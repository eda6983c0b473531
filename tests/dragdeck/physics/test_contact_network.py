"""The stability number: networks whose frequencies are known in closed form."""

import math

import numpy as np
import pytest

from dragdeck.physics.contact_mechanics import ContactConstants
from dragdeck.physics.contact_network import stability_number
from dragdeck.physics.walls import round_container

RADIUS, DENSITY, BOWL, OVERLAP = 3e-3, 2500.0, round_container(0.05), 1e-5
MASS = 4 / 3 * math.pi * RADIUS**3 * DENSITY
STEP = 1e-5
ELASTIC = ContactConstants(modulus_pa=4e7, shear_pa=1e7, restitution=1.0, friction=0.3)
SMOOTH = ContactConstants(modulus_pa=4e7, shear_pa=1e7, restitution=1.0, friction=0.0)
DAMPED = ContactConstants(modulus_pa=4e7, shear_pa=1e7, restitution=0.3, friction=0.0)

ON_FLOOR = [[0.0, 0.0, RADIUS - OVERLAP]]
AT_SIDE = [[0.0, 0.05 - RADIUS + OVERLAP, 0.1]]
PAIR = [[0.0, 0.0, 0.1], [0.0, 1.2 * (RADIUS - OVERLAP / 2), 0.1 + 1.6 * (RADIUS - OVERLAP / 2)]]


def number(centres: list[list[float]], constants: ContactConstants, step: float = STEP) -> float:
    radii = np.full(len(centres), RADIUS)
    return stability_number(np.array(centres), radii, DENSITY, BOWL, [[constants] * 2], step)


def stiffness(curvature_radius: float) -> tuple[float, float]:
    """Normal and tangential stiffness of a contact of the overlap."""
    contact_radius = math.sqrt(curvature_radius * OVERLAP)
    return 2 * ELASTIC.modulus_pa * contact_radius, 8 * ELASTIC.shear_pa * contact_radius


@pytest.mark.parametrize("centres", [ON_FLOOR, AT_SIDE])
def test_a_particle_at_the_bowl(centres: list[list[float]]) -> None:
    normal, tangential = stiffness(RADIUS)
    bounces, rolls = math.sqrt(normal / MASS), math.sqrt(3.5 * tangential / MASS)
    assert number(centres, SMOOTH) == pytest.approx(bounces * STEP / 2, rel=1e-9)
    assert number(centres, ELASTIC) == pytest.approx(rolls * STEP / 2, rel=1e-9)


def test_two_particles() -> None:
    normal, tangential = stiffness(RADIUS / 2)
    bounce, roll = math.sqrt(2 * normal / MASS), math.sqrt(7 * tangential / MASS)
    assert number(PAIR, SMOOTH) == pytest.approx(bounce * STEP / 2, rel=1e-9)
    assert number(PAIR, ELASTIC) == pytest.approx(roll * STEP / 2, rel=1e-9)


def test_nothing_that_touches_limits_no_step() -> None:
    assert number([[0.0, 0.0, 0.1]], ELASTIC) == 0.0
    assert number([[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]], ELASTIC) == 0.0


def test_it_is_one_where_a_damped_particle_begins_to_gain_energy() -> None:
    """The order of things in LIGGGHTS: half a kick, a move, the force with that speed, a kick."""
    normal, _ = stiffness(RADIUS)
    log = -math.log(DAMPED.restitution)
    damping = 2 * math.sqrt(5 / 6) * log / math.hypot(log, math.pi) * math.sqrt(normal * MASS)

    def grows(step: float) -> bool:
        x, v, a = 1.0, 0.0, -normal / MASS
        for _ in range(4000):
            v += 0.5 * step * a
            x += step * v
            a = -(normal * x + damping * v) / MASS
            v += 0.5 * step * a
        return abs(x) > 1.0

    low, high = 1e-6, 1e-3
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if number(ON_FLOOR, DAMPED, middle) > 1 else (middle, high)
    assert low < 0.8 * 2 / math.sqrt(normal / MASS)  # damping matters here
    assert not grows(0.99 * low)
    assert grows(1.01 * low)

"""What is measured of a run: its contacts, and networks whose frequencies are known."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dragdeck.physics.contact_mechanics import ContactConstants, sphere_mass
from dragdeck.physics.contact_network import largest_eigenvalue
from dragdeck.records.bed import MediaOfRun
from dragdeck.records.case import CaseOfRun
from evidence.stability.network import critical_step, damped_fraction, network_frequency


@pytest.mark.parametrize("count", [5, 60])
def test_a_chain_between_walls_has_the_frequency_of_the_textbook(count: int) -> None:
    """N masses, N + 1 springs, fixed ends: 2 sqrt(k/m) sin(N pi / (2 (N + 1)))."""
    bodies = np.array([[*range(count), 0], [*range(1, count), count, count]])
    normals = np.array([[1.0, 0.0, 0.0]] * count + [[-1.0, 0.0, 0.0]])
    weights = np.array([[1e5], [0.0]]) * np.ones(count + 1)
    largest = largest_eigenvalue(bodies, normals, weights, np.append(np.full(count, 1 / 4e-4), 0.0))
    known = 2 * np.sqrt(1e5 / 4e-4) * np.sin(count * np.pi / (2 * (count + 1)))
    assert math.sqrt(largest) == pytest.approx(known, rel=1e-9)


def single_on_a_plane(plane: int, overlap_m: Sequence[float]) -> float:
    """Frequency of a particle without friction on a plane: 1 is the bowl, 2 the workpiece."""
    moduli = {
        name: ContactConstants(modulus_pa=own, shear_pa=1e9, restitution=0.9, friction=0.0)
        for name, own in (("particle", 7e9), ("bowl", 1e9), ("workpiece", 4e9))
    }
    media = MediaOfRun(count=1, radius_mean_m=1e-3, radius_std_m=0.0, density_kg_m3=2500.0)
    case = CaseOfRun.model_construct(contact_moduli=moduli, media=media)
    count = len(overlap_m)
    bodies, normal = np.repeat([[0], [plane]], count, axis=1), np.tile([0.0, 0.0, -1.0], (count, 1))
    return network_frequency(case, np.array([1e-3]), (bodies, normal, np.array(overlap_m)))


@pytest.mark.parametrize(("plane", "modulus"), [(1, 1e9), (2, 4e9)])
def test_each_contact_has_the_moduli_of_its_partner(plane: int, modulus: float) -> None:
    """The root of 2 E* sqrt(R d) / m."""
    stiffness = 2 * modulus * math.sqrt(1e-3 * 1e-6)
    expected = math.sqrt(stiffness / sphere_mass(1e-3, 2500.0))
    assert single_on_a_plane(plane, [1e-6]) == pytest.approx(expected)


def test_no_contact_has_no_limit() -> None:
    assert critical_step(single_on_a_plane(1, [])) == np.inf


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

"""The limit of friction."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from dragdeck.physics.coulomb import within_friction
from dragdeck.study.contact_law import FrictionLimit

Z = np.array([[0.0, 0.0, 1.0]])


def test_a_force_below_the_limit_is_left_to_the_last_bit() -> None:
    force = np.array([[0.1, 0.2, 1.0]])
    cut, removed = within_friction(force, Z, 0.3)
    np.testing.assert_array_equal(cut, force)
    assert removed.tolist() == [0.0]


def test_only_the_tangential_part_is_cut_and_keeps_its_direction() -> None:
    force = np.array([[3.0, 4.0, -2.0]])
    cut, removed = within_friction(force, Z, 0.5)
    np.testing.assert_allclose(cut, [[0.6, 0.8, -2.0]])
    np.testing.assert_allclose(removed, [4.0])


def test_every_contact_may_have_its_own_coefficient() -> None:
    force = np.array([[1.0, 0.0, 1.0]] * 2)
    cut, _ = within_friction(force, np.repeat(Z, 2, axis=0), np.array([0.25, 0.5]))
    np.testing.assert_allclose(cut[:, 0], [0.25, 0.5])


@given(
    force=arrays.arrays(np.float64, (5, 3), elements=st.floats(-1e3, 1e3)),
    friction=st.floats(0.0, 2.0),
)
def test_no_force_is_above_the_limit_and_the_normal_part_stays(force, friction) -> None:
    cut, removed = within_friction(force, np.repeat(Z, 5, axis=0), friction)
    np.testing.assert_allclose(cut[:, 2], force[:, 2], rtol=1e-12)
    size = np.linalg.norm(cut[:, :2], axis=1)
    assert (size <= friction * np.abs(force[:, 2]) * (1 + 1e-9) + 1e-9).all()
    np.testing.assert_allclose(size + removed, np.linalg.norm(force[:, :2], axis=1), atol=1e-9)


def test_each_pair_of_classes_has_its_own_limit() -> None:
    """Particles 1 to 3 are of the first class, 4 and 5 of the second."""
    friction = np.array([[0.1, 0.2], [0.2, 0.3]])
    limit = FrictionLimit(friction, {"cohesion_j_m3": 1e5 * friction}, False, (1, 4))
    found = limit.at(np.array([1, 3, 4, 5]), np.array([2, 4, 3, 4]))
    np.testing.assert_array_equal(found.friction, [0.1, 0.2, 0.2, 0.3])
    area = 4 * np.pi * 1e-3 * 1e-6
    attraction = found.attraction_n(np.full(4, 1e-3), np.full(4, 1e-6))
    np.testing.assert_allclose(attraction, 1e5 * area * np.array([0.1, 0.2, 0.2, 0.3]))
    wall = FrictionLimit(np.array([0.1, 0.2]), first_ids=(1, 4))
    np.testing.assert_array_equal(wall.at(np.array([3, 4]), np.zeros(2, int)).friction, [0.1, 0.2])

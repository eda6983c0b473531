import numpy as np
import pytest
from made_frames import frame, wall

from dragchain.errors import TableError
from dragchain.tables.network_contacts import KINDS, contact_rows
from dragdeck.physics.walls import round_container
from dragdeck.study.contact_law import FrictionLimit

PARTICLES = (
    *("particle_id", "x_m", "y_m", "z_m", "radius_m"),
    *(f"{wall}_force_{axis}_n" for wall in ("floor", "side") for axis in "xyz"),
)
CONTACTS = ("particle1_id", "particle2_id", "force_x_n", "force_y_n", "force_z_n", "overlap_m")
CALM = [0.0] * 6


def rows_of(particles, contacts=(), workpiece=None, bowl=None, radius=10.0, friction=10.0):
    frames = frame(PARTICLES, particles), frame(CONTACTS, contacts)
    walls, limit = round_container(radius).walls, FrictionLimit(friction, wall=False)
    return contact_rows(*frames, workpiece or wall(), bowl or wall(), walls, limit)


def test_two_unequal_particles_along_x() -> None:
    """Radii 2 and 1, centres 2.9 apart: the point is 2 - 0.05 from the larger one's centre."""
    particles = [[1, 0, 0, 5, 2, *CALM], [2, 2.9, 0, 5, 1, *CALM]]
    rows = rows_of(particles, [[1, 2, -3, 0, 4, 0.1]])
    assert KINDS[rows.kind[0]] == "particle-particle"
    np.testing.assert_allclose(rows.point_m, [[1.95, 0, 5]])
    np.testing.assert_allclose(rows.normal_force_n, [3])
    np.testing.assert_allclose(rows.tangential_force_n, [4])
    np.testing.assert_array_equal(rows.force_n, [[-3, 0, 4]])


def test_the_force_between_particles_is_cut_to_the_limit_of_friction() -> None:
    """The pull of the second contact has a limit too: that of its magnitude."""
    particles = [[1, 0, 0, 5, 2, *CALM], [2, 2.9, 0, 5, 1, *CALM], [3, 5.8, 0, 5, 2, *CALM]]
    rows = rows_of(particles, [[1, 2, -3, 0, 4, 0.1], [2, 3, 2, 0.6, 0.8, 0.1]], friction=0.4)
    np.testing.assert_allclose(rows.force_n, [[-3, 0, 1.2], [2, 0.48, 0.64]])
    np.testing.assert_allclose(rows.normal_force_n, [3, -2])
    np.testing.assert_allclose(rows.tangential_force_n, [1.2, 0.8])


def test_the_applied_force_of_a_wall_is_not_cut() -> None:
    rows = rows_of([[7, 1, 2, 0.8, 1, 5, 0, 6, 0, 0, 0]], friction=0.1)
    np.testing.assert_array_equal(rows.force_n, [[5, 0, 6]])


def test_a_contact_seen_from_the_other_particle_is_the_same() -> None:
    particles = [[1, 0, 0, 5, 2, *CALM], [2, 2.9, 0, 5, 1, *CALM]]
    one = rows_of(particles, [[1, 2, -3, 0, 4, 0.1]])
    other = rows_of(particles, [[2, 1, 3, 0, -4, 0.1]])
    np.testing.assert_allclose(one.point_m, other.point_m)
    np.testing.assert_allclose(one.normal_force_n, other.normal_force_n)
    assert (other.a_id[0], other.b_id[0]) == (2, 1)


def test_a_particle_on_the_floor() -> None:
    rows = rows_of([[7, 1, 2, 0.8, 1, 0.3, 0, 6, 0, 0, 0]])
    assert (KINDS[rows.kind[0]], rows.a_id[0], rows.b_id[0]) == ("particle-floor", 7, -1)
    np.testing.assert_allclose(rows.overlap_m, [0.2])
    np.testing.assert_allclose(rows.point_m, [[1, 2, -0.1]])
    np.testing.assert_allclose(rows.normal_force_n, [6])
    np.testing.assert_allclose(rows.tangential_force_n, [0.3])


def test_a_particle_at_the_side() -> None:
    """Centre at distance 9.5 along (0.6, 0.8), radius 1, bowl 10: overlap 0.5."""
    rows = rows_of([[7, 5.7, 7.6, 3, 1, 0, 0, 0, -1.2, -1.6, 0.7]])
    assert (KINDS[rows.kind[0]], rows.b_id[0]) == ("particle-side", -2)
    np.testing.assert_allclose(rows.overlap_m, [0.5])
    np.testing.assert_allclose(rows.point_m, [[5.7 + 0.45, 7.6 + 0.6, 3]])
    np.testing.assert_allclose(rows.normal_force_n, [2])
    np.testing.assert_allclose(rows.tangential_force_n, [0.7])


def test_a_particle_in_the_corner_has_two_contacts() -> None:
    rows = rows_of([[7, 9, 0, 1, 1, 0, 0, 2, -1, 0, 0]])
    assert [KINDS[kind] for kind in rows.kind] == ["particle-floor", "particle-side"]


def test_contacts_with_the_workpiece_that_carry_nothing_are_left_out() -> None:
    workpiece = wall(
        [[2, 0, 1], [0, 0, 0]], [[1, 0, 5], [0, 1, 5]], [[1, 0, 0], [0, 0, 0]], silent=[False, True]
    )
    rows = rows_of([[1, 2, 0, 5, 1, *CALM]], workpiece=workpiece)
    assert KINDS[rows.kind[0]] == "particle-workpiece"
    assert (rows.a_id.tolist(), rows.b_id.tolist()) == ([1], [0])
    assert (rows.normal_force_n[0], rows.tangential_force_n[0]) == (2, 1)


def test_contacts_between_particles_that_carry_nothing_are_left_out() -> None:
    """One definition of a contact for all bodies: four particles in a row, the middle pair idle."""
    particles = [[number, 1.9 * number, 0, 5, 1, *CALM] for number in (1, 2, 3, 4)]
    pairs = [[1, 2, -1, 0, 0, 0.1], [2, 3, 0, 0, 0, 0.1], [3, 4, -1, 0, 0.2, 0.1]]
    rows = rows_of(particles, pairs)
    assert list(zip(rows.a_id.tolist(), rows.b_id.tolist(), strict=True)) == [(1, 2), (3, 4)]
    assert len(rows.normal_force_n) == 2


def test_a_meshed_bowl_is_split_into_floor_and_side() -> None:
    bowl = wall([[0, 0, 3], [-2, 0, 0]], [[1, 0, 0], [10, 0, 1]], [[0, 0, 1], [-1, 0, 0]])
    rows = rows_of([[1, 1, 0, 1, 1, *CALM], [2, 9, 0, 1, 1, *CALM]], bowl=bowl)
    assert [KINDS[kind] for kind in rows.kind] == ["particle-floor", "particle-side"]
    assert rows.normal_force_n.tolist() == [3, 2]


def test_rows_are_sorted_by_kind_and_ids() -> None:
    particles = [
        [3, 0, 0, 5, 1, *CALM],
        [1, 1.9, 0, 5, 1, *CALM],
        [2, 3.8, 0, 1, 1, 0, 0, 1, 0, 0, 0],
    ]
    rows = rows_of(particles, [[3, 1, -1, 0, 0, 0.1], [1, 3, 1, 0, 0, 0.1]])
    assert rows.kind.tolist() == [0, 0, 2]
    assert rows.a_id.tolist() == [1, 3, 2]


@pytest.mark.parametrize("particles", [[], [[1, 0, 0, 5, 2, *CALM]]])
def test_a_contact_of_an_unknown_particle_is_an_error(particles) -> None:
    with pytest.raises(
        TableError, match=r"step 100: particle [12] is in a contact, but missing in particles"
    ):
        rows_of(particles, [[1, 2, -3, 0, 4, 0.1]])


def test_frames_of_different_steps_are_an_error() -> None:
    with pytest.raises(TableError, match="contacts is 9, but that of particles is 100"):
        contact_rows(frame(PARTICLES, []), frame(CONTACTS, [], step=9), wall(), wall(), (), 0.3)


def test_a_particle_that_is_there_twice_is_refused() -> None:
    particles = [[1, 0, 0, 5, 2, *CALM], [2, 2.9, 0, 5, 1, *CALM], [1, 9, 0, 5, 2, *CALM]]
    with pytest.raises(TableError, match="step 100: particles contains particle 1 twice"):
        rows_of(particles)

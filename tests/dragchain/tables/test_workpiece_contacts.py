import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from made_frames import frame

from dragchain.errors import TableError
from dragchain.tables.workpiece_contacts import WallContacts, WorkpieceFrames, join_workpiece_frames
from dragdeck.dumps.frame import Frame
from dragdeck.study.contact_law import FrictionLimit

PARTICLES = ("particle_id", "x_m", "y_m", "z_m", "radius_m", "force_x_n", "force_y_n", "force_z_n")
CONTACTS = (
    *("point_x_m", "point_y_m", "point_z_m", "facet_id", "particle_id"),
    *("force_x_n", "force_y_n", "force_z_n", "overlap_m"),
)


def limits(friction: float) -> tuple[FrictionLimit, FrictionLimit]:
    return FrictionLimit(friction), FrictionLimit(friction)


def joined_of(particles: Frame, contacts: Frame, friction: float = 10.0) -> WorkpieceFrames:
    return join_workpiece_frames([particles], [contacts], limits(friction))


def test_a_single_contact_takes_the_applied_force() -> None:
    particles = frame(PARTICLES, [[5, 3, 0, 0, 1, 2.0, 0.5, 0]])
    contacts = frame(CONTACTS, [[2, 0, 0, 9, 5, 1.9, 0.4, 0, 1e-6]])
    workpiece = joined_of(particles, contacts).workpiece
    np.testing.assert_array_equal(workpiece.force_n, [[2.0, 0.5, 0]])
    np.testing.assert_array_equal(workpiece.normal, [[1, 0, 0]])
    assert workpiece.normal_force_n().tolist() == [2.0]
    assert workpiece.tangential_force_n().tolist() == [0.5]


def test_contacts_of_one_particle_share_the_difference_equally() -> None:
    particles = frame(PARTICLES, [[5, 1, 1, 0, 1, 3.0, 2.0, 0]])
    contacts = frame(CONTACTS, [[1, 0, 0, 2, 5, 0, 1.5, 0, 1e-6], [0, 1, 0, 1, 5, 2.0, 0, 0, 1e-6]])
    workpiece = joined_of(particles, contacts).workpiece
    assert workpiece.facet_id.tolist() == [1, 2]
    np.testing.assert_allclose(workpiece.force_n, [[2.5, 0.25, 0], [0.5, 1.75, 0]])
    np.testing.assert_allclose(workpiece.force_n.sum(axis=0), [3.0, 2.0, 0])


def test_evaluated_forces_are_within_the_limit_of_friction_before_they_are_shared() -> None:
    """The limits are 1 and 0.75 for tangential forces of 4 and 0.9."""
    particles = frame(PARTICLES, [[5, 1, 1, 0, 1, 3.0, 2.0, 0]])
    rows = [[1, 0, 0, 2, 5, 0.9, 1.5, 0, 1e-6], [0, 1, 0, 1, 5, 2.0, 4.0, 0, 1e-6]]
    workpiece = joined_of(particles, frame(CONTACTS, rows), friction=0.5).workpiece
    np.testing.assert_allclose(workpiece.force_n, [[2.125, 0.75, 0], [0.875, 1.25, 0]])


EDGE = [[-0.05, 0, 0, 7, 5, 0.0, 0, 4.0, 0.01], [0, 0, 0, 8, 5, -0.2, 0, 3.0, 0.00874]]
"""A sphere of radius 1 at (-0.05, 0, 0.99) over a roof with its ridge in x = 0: on the flat
facet 7, and on the ridge, which belongs to facet 8."""


def test_a_particle_over_a_convex_edge_has_one_contact() -> None:
    particles = frame(PARTICLES, [[5, -0.05, 0, 0.99, 1, -0.3, 0, 7.5]])
    joined = joined_of(particles, frame(CONTACTS, EDGE))
    workpiece = joined.workpiece
    assert workpiece.facet_id.tolist() == [7]
    np.testing.assert_array_equal(workpiece.force_n, [[-0.3, 0, 7.5]])
    assert workpiece.overlap_m.tolist() == [0.01]
    np.testing.assert_array_equal(workpiece.point_m, [EDGE[0][:3]])
    mean = 0.01**1.5 * np.array([0, 0, 1]) + 0.00874**1.5 * np.array([-0.05, 0, 0.99]) / 0.99126
    np.testing.assert_allclose(workpiece.normal, [mean / np.linalg.norm(mean)], atol=1e-6)


def test_three_contacts_of_a_corner_are_one_and_a_far_one_stays() -> None:
    """The corner is 0.1 from the deepest point, the far wall 1.4; both facets come unsorted."""
    corner = [-0.05, 0.1, 0, 9, 5, 0, 0, 1.0, 0.005]
    far = [0.94, 0, 0.99, 3, 5, -2.0, 0, 0, 0.01]
    particles = frame(PARTICLES, [[5, -0.05, 0, 0.99, 1, -2.2, 0, 8.0]])
    joined = joined_of(particles, frame(CONTACTS, [far, EDGE[1], corner, EDGE[0]]))
    assert joined.workpiece.facet_id.tolist() == [3, 7]
    np.testing.assert_allclose(joined.workpiece.force_n, [[-2.0, 0, 0], [-0.2, 0, 8.0]], atol=1e-12)


def test_contacts_with_different_bodies_or_particles_are_not_merged() -> None:
    names = (*CONTACTS, "mesh_id")
    rows = [[*EDGE[0], 0], [*EDGE[1], 1]]
    particles = [[5, -0.05, 0, 0.99, 1, -0.3, 0, 7.5], [6, -0.05, 0, 0.99, 1, 0, 0, 1.0]]
    joined = joined_of(frame(PARTICLES, particles[:1]), frame(names, rows))
    assert (len(joined.workpiece), len(joined.bowl)) == (1, 1)
    other = [*EDGE[1][:4], 6, *EDGE[1][5:]]
    joined = joined_of(frame(PARTICLES, particles), frame(CONTACTS, [EDGE[0], other]))
    assert joined.workpiece.particle_id.tolist() == [5, 6]


def test_silent_contacts_are_not_merged() -> None:
    joined = joined_of(frame(PARTICLES, []), frame(CONTACTS, EDGE))
    assert joined.workpiece.silent.tolist() == [True, True]


def test_rows_come_back_sorted_whatever_their_order() -> None:
    particles = frame(PARTICLES, [[9, 3, 0, 0, 1, 1, 0, 0], [2, 0, 3, 0, 1, 0, 4, 0]])
    contacts = frame(CONTACTS, [[2, 0, 0, 1, 9, 1, 0, 0, 1e-6], [0, 2, 0, 3, 2, 0, 1, 0, 2e-6]])
    workpiece = joined_of(particles, contacts).workpiece
    assert workpiece.particle_id.tolist() == [2, 9]
    np.testing.assert_array_equal(workpiece.force_n, [[0, 4, 0], [1, 0, 0]])
    assert workpiece.overlap_m.tolist() == [2e-6, 1e-6]


def test_a_contact_without_an_applied_force_carries_none() -> None:
    contacts = frame(CONTACTS, [[2, 0, 0, 9, 5, 0, 0.1, 0, 1e-6]])
    for rows in ([], [[5, 3, 0, 0, 1, 0, 0, 0]]):
        joined = joined_of(frame(PARTICLES, rows), contacts)
        assert joined.workpiece.silent.tolist() == [True]
        np.testing.assert_array_equal(joined.workpiece.force_n, [[0, 0, 0]])
        assert joined.workpiece.normal_force_n().tolist() == [0]
        assert len(joined.unplaced_n) == 0


def test_a_force_without_a_contact_is_kept_apart() -> None:
    joined = joined_of(frame(PARTICLES, [[5, 3, 0, 0, 1, 2, 0, 1]]), frame(CONTACTS, []))
    assert len(joined.workpiece) == 0
    np.testing.assert_array_equal(joined.unplaced_n, [[2, 0, 1]])


def test_an_empty_frame_has_no_contacts() -> None:
    joined = joined_of(frame(PARTICLES, []), frame(CONTACTS, []))
    assert (len(joined.workpiece), len(joined.bowl), len(joined.unplaced_n)) == (0, 0, 0)


def test_contacts_with_a_meshed_bowl_are_told_from_the_tools() -> None:
    particles = frame(PARTICLES, [[5, 3, 0, 0, 1, 2, 0, 0], [6, 0, 3, 0, 1, 0, -1, 0]])
    rows = [[2, 0, 0, 9, 5, 2, 0, 0, 1e-6, 0], [0, 4, 0, 1, 6, 0, -1, 0, 1e-6, 1]]
    joined = joined_of(particles, frame((*CONTACTS, "mesh_id"), rows))
    assert joined.workpiece.particle_id.tolist() == [5]
    assert joined.bowl.particle_id.tolist() == [6]
    assert joined.bowl.normal_force_n().tolist() == [1]


def test_a_batch_has_the_contacts_of_each_of_its_frames() -> None:
    over_edge = frame(PARTICLES, [[5, -0.05, 0, 0.99, 1, -0.3, 0, 7.5], [9, 8, 0, 0, 1, 1, 0, 0]])
    batch = [
        (over_edge, frame(CONTACTS, EDGE)),
        (frame(PARTICLES, []), frame(CONTACTS, EDGE)),
        (frame(PARTICLES, [[6, 3, 0, 0, 1, 2, 0, 1]]), frame(CONTACTS, [])),
        (over_edge, frame(CONTACTS, EDGE[::-1])),
    ]
    joined = join_workpiece_frames(*zip(*batch, strict=True), limits(0.5))
    alone = [joined_of(*pair, friction=0.5) for pair in batch]
    for name in WallContacts.__dataclass_fields__:
        parts = [getattr(one.workpiece, name) for one in alone]
        np.testing.assert_array_equal(getattr(joined.workpiece, name), np.concatenate(parts))
    assert joined.workpiece_at.tolist() == [0, 1, 1, 3]
    assert (joined.unplaced_at.tolist(), joined.unplaced_n[:, 0].tolist()) == ([0, 2, 3], [1, 2, 1])


def test_frames_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(
        TableError, match="workpiece_particles is 100, but that of workpiece_contacts is 200"
    ):
        joined_of(frame(PARTICLES, []), frame(CONTACTS, [], step=200))
    twice = frame(PARTICLES, [[5, 3, 0, 0, 1, 2, 0, 1], [5, 3, 0, 0, 1, 2, 0, 1]])
    with pytest.raises(TableError, match="contains a particle more than once"):
        joined_of(twice, frame(CONTACTS, []))
    same = frame(CONTACTS, [[3, 0, 0, 9, 5, 1, 0, 0, 1e-6]])
    with pytest.raises(TableError, match="coincides with a particle's centre"):
        joined_of(frame(PARTICLES, [[5, 3, 0, 0, 1, 2, 0, 1]]), same)


forces = st.floats(-10, 10, allow_nan=False)


@given(
    owners=st.lists(st.integers(1, 4), max_size=8),
    applied=arrays.arrays(np.float64, (4, 3), elements=forces),
    data=st.data(),
)
@settings(max_examples=80)
def test_contacts_of_a_particle_always_add_up_to_its_force(owners, applied, data) -> None:
    evaluated = data.draw(arrays.arrays(np.float64, (len(owners), 3), elements=forces))
    particles = frame(PARTICLES, [[i + 1, 9, 9, 9, 1, *applied[i]] for i in range(4)])
    rows = [[0, 0, i // 2, i, owner, *evaluated[i], 1e-6] for i, owner in enumerate(owners)]
    joined = joined_of(particles, frame(CONTACTS, rows), friction=0.3)
    for particle in set(owners):
        total = joined.workpiece.force_n[joined.workpiece.particle_id == particle].sum(axis=0)
        np.testing.assert_allclose(total, applied[particle - 1], atol=1e-12)
    placed = joined.workpiece.force_n.sum(axis=0) + joined.unplaced_n.sum(axis=0)
    np.testing.assert_allclose(placed, applied.sum(axis=0), atol=1e-12)

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import RADIUS_M, random_frame, real_frame
from plain_chains import plain_clusters
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dragchain.network.chains import dominant_path, widest_paths
from dragchain.network.clusters import (
    FORCE_FACTORS,
    SPANS,
    cluster_rows,
    find_clusters,
    frame_clusters,
)
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame, frame_of


def frame_with(
    rows: list[tuple[int, int, float]],
    particles: int,
    at: dict[int, tuple[float, float]] | None = None,
) -> NetworkFrame:
    """A frame of (particle, other, normal force) rows; `at` gives x, y of a particle's contact
    points."""
    places = at or {}
    points = [places.get(a, (0.01, 0.0)) for a, _, _ in rows]
    contacts = {
        "a_id": np.array([a for a, _, _ in rows], dtype=np.int64),
        "b_id": np.array([b for _, b, _ in rows], dtype=np.int64),
        "point_x_m": np.array([x for x, _ in points]),
        "point_y_m": np.array([y for _, y in points]),
        "normal_force_n": np.array([force for _, _, force in rows], dtype=np.float64),
    }
    for name in ("point_z_m", "force_x_n", "force_y_n", "force_z_n"):
        contacts[name] = np.zeros(len(rows))
    table = {name: np.full(particles, RADIUS_M) for name in ("x_m", "y_m", "z_m", "radius_m")}
    return frame_of(contacts, table | {"particle_id": np.arange(1, particles + 1)}, 1, 0.1, 0.0)


# 1-2-3-4 with falling force, 5-6, and 7 alone
CHAIN = [(1, 2, 6.0), (2, 3, 5.0), (3, 4, 3.0), (5, 6, 4.0), (7, FLOOR, 9.0)]


def test_sizes_by_hand() -> None:
    found = find_clusters(frame_with(CHAIN, 7), np.array([0.0, 3.0, 4.0, 5.0, 6.0]))
    assert found.strong_contacts.tolist() == [5, 4, 3, 2, 1]
    assert found.clusters.tolist() == [2, 2, 1, 1, 0]
    assert found.clustered_particles.tolist() == [6, 5, 3, 2, 0]
    assert found.largest_cluster.tolist() == [4, 3, 3, 2, 0]
    assert found.squares.tolist() == [20, 13, 9, 4, 0]
    assert found.mean_cluster_size()[:2].tolist() == [2.0, 2.0]
    assert np.isnan(found.mean_cluster_size()[2:]).all()
    assert found.second_moment().tolist() == [4 / 7, 4 / 7, 0.0, 0.0, 0.0]


def test_thresholds_may_come_in_any_order() -> None:
    frame = random_frame(1)
    limits = np.array([2.0, 0.0, 0.5, 1.0, 0.5])
    found = find_clusters(frame, limits)
    for at, limit in enumerate(limits):
        alone = find_clusters(frame, np.array([limit]))
        assert found.squares[at] == alone.squares[0]
        assert found.strong_contacts[at] == alone.strong_contacts[0]


def test_the_weakest_contact_between_workpiece_and_bowl_is_where_they_part() -> None:
    rows = [(1, WORKPIECE, 8.0), *CHAIN[:3], (4, FLOOR, 7.0)]
    found = find_clusters(frame_with(rows, 7), np.array([2.9, 3.0]))
    assert found.percolation_n == {"workpiece_to_bowl": 3.0, "side_to_side": 0.0}
    assert found.spans("workpiece_to_bowl").tolist() == [True, False]


def test_one_particle_on_workpiece_and_bowl_spans() -> None:
    found = find_clusters(frame_with([(1, WORKPIECE, 2.0), (1, SIDE, 4.0)], 2), np.array([1.0]))
    assert found.percolation_n["workpiece_to_bowl"] == 2.0
    assert found.clusters.tolist() == [0]


@pytest.mark.parametrize(
    ("last", "force"),
    [((-0.01, 0.001), 3.0), ((0.0, 0.01), 0.0), ((0.0, -0.01), 0.0), ((0.01, -0.002), 0.0)],
)
def test_side_to_side_is_between_opposite_quarters(last, force) -> None:
    rows = [(1, SIDE, 8.0), *CHAIN[:3], (8, SIDE, 7.0), (4, 8, 9.0)]
    found = find_clusters(frame_with(rows, 8, {8: last}), np.array([1.0]))
    assert found.percolation_n["side_to_side"] == force


def test_a_frame_without_contacts_has_no_cluster() -> None:
    frame = frame_with([], 3)
    rows = cluster_rows(frame, frame_clusters(frame))
    assert rows["clusters"].tolist() == [0] * len(FORCE_FACTORS)
    assert not rows["workpiece_to_bowl"].any()
    assert math.isnan(rows["mean_cluster_size"][0])


@given(
    seed=st.integers(0, 2**32 - 1),
    edge=st.integers(2, 6),
    levels=st.sampled_from([None, 1, 4]),
)
@settings(max_examples=30)
def test_clusters_are_those_of_a_flood(seed: int, edge: int, levels: int | None) -> None:
    frame = random_frame(seed, edge=edge, levels=levels)
    found = frame_clusters(frame)
    for at, least in enumerate(found.force_n):
        sizes, spans = plain_clusters(frame, float(least))
        assert found.clusters[at] == sum(sizes.values())
        assert found.clustered_particles[at] == sum(size * count for size, count in sizes.items())
        assert found.squares[at] == sum(size**2 * count for size, count in sizes.items())
        assert found.largest_cluster[at] == max(sizes, default=0)
        assert {name for name in SPANS if found.spans(name)[at]} == spans


def test_clusters_of_a_real_frame_are_components() -> None:
    frame = real_frame()
    found = frame_clusters(frame)
    for at, least in enumerate(found.force_n):
        strong = frame.between_particles() & (frame.normal_force > least)
        ends = frame.a[strong], frame.b[strong]
        net = coo_array((np.ones(strong.sum()), ends), shape=[frame.particle_id.size] * 2)
        _, label = connected_components(net, directed=False)
        sizes = np.bincount(label)
        sizes = sizes[sizes > 1]
        assert found.clusters[at] == sizes.size
        assert found.largest_cluster[at] == sizes.max(initial=0)
        assert found.squares[at] == (sizes**2).sum()


@pytest.mark.parametrize("frame", [real_frame(), *map(random_frame, range(5))])
def test_workpiece_and_bowl_part_at_the_bottleneck_of_the_dominant_path(
    frame: NetworkFrame,
) -> None:
    path = dominant_path(frame, widest_paths(frame, 0.0))
    assert path is not None
    weakest = frame.normal_force[list(path.contacts)].min()
    assert frame_clusters(frame).percolation_n["workpiece_to_bowl"] == weakest

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from figure_files import case_json
from hypothesis import given, settings
from hypothesis import strategies as st
from made_run import write_documents
from networks import random_frame, real_frame
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dragchain.errors import TableError
from dragchain.network.chains import dominant_path, widest_paths
from dragchain.network.frame import (
    FLOOR,
    SIDE,
    WORKPIECE,
    NetworkFrame,
    counted_range,
    frame_of,
    network_frames,
)
from dragchain.network.statistics import (
    FORCE_FACTORS,
    SPANS,
    cluster_rows,
    find_clusters,
    frame_clusters,
    frame_statistics,
    mechanical_coordination_number,
)
from dragchain.network.write import write_chains

CONTACT_COLUMNS = [
    "step", "time_s", "kind", "a_id", "b_id", "point_x_m", "point_y_m", "point_z_m",
    "force_x_n", "force_y_n", "force_z_n", "normal_force_n", "tangential_force_n", "overlap_m",
]  # fmt: skip
PARTICLE_COLUMNS = ["step", "time_s", "particle_id", "x_m", "y_m", "z_m", "radius_m"]
KIND = {0: "particle-workpiece", -1: "particle-floor", -2: "particle-side"}


def contact_rows(step: int, rows: list[tuple[int, int, float]]) -> pd.DataFrame:
    table = pd.DataFrame(rows, columns=["a_id", "b_id", "normal_force_n"])
    known = {"step": step, "time_s": step * 1e-3, "force_x_n": table["normal_force_n"]}
    kind = table["b_id"].map(lambda other: KIND.get(other, "particle-particle"))
    return table.assign(**known, kind=kind, overlap_m=1e-6).reindex(
        columns=CONTACT_COLUMNS, fill_value=0.0
    )


def particle_rows(step: int, ids: list[int]) -> pd.DataFrame:
    rows = [[step, step * 1e-3, particle, 0.01 * particle, 0.0, 0.03, 0.003] for particle in ids]
    return pd.DataFrame(rows, columns=PARTICLE_COLUMNS)


def a_frame(rows: list[tuple[int, int, float]], ids: list[int]) -> NetworkFrame:
    return frame_of(contact_rows(1, rows), particle_rows(1, ids), 1, 0.001, 0.0)


# particle 7 touches four particles and the workpiece, the others fewer; particle 9 touches nothing
STAR = [(7, 1, 4.0), (2, 7, 3.0), (7, 3, 2.0), (7, 4, 1.0), (7, 0, 5.0), (1, -1, 2.0), (4, -2, 4.0)]
STAR_IDS = [9, 7, 1, 2, 3, 4]


def test_statistics_of_a_star() -> None:
    found = frame_statistics(a_frame(STAR, STAR_IDS))
    expected = {
        "n_particles": 6, "n_contacts": 7, "n_particle_particle_contacts": 4,
        "n_particle_workpiece_contacts": 1, "n_particle_floor_contacts": 1,
        "n_particle_side_contacts": 1, "coordination_number": 11 / 6,
        "mechanical_coordination_number": 5.0, "rattler_fraction": 5 / 6,
        "normal_force_mean_n": 3.0, "normal_force_max_n": 5.0, "above_mean_fraction": 3 / 7,
    }  # fmt: skip
    assert {name: found[name] for name in expected} == pytest.approx(expected)


def test_a_particle_with_four_contacts_carries_load() -> None:
    assert mechanical_coordination_number(np.array([0, 3, 4, 6])) == 5.0


def test_a_frame_without_contacts_is_not_zero_but_unknown() -> None:
    found = frame_statistics(a_frame([], [1, 2]))
    assert found["coordination_number"] == 0.0
    assert math.isnan(found["mechanical_coordination_number"])
    assert math.isnan(found["normal_force_mean_n"])
    assert math.isnan(found["above_mean_fraction"])


def test_a_contact_with_an_unknown_particle_is_refused() -> None:
    with pytest.raises(TableError, match="step 1 contain particle 5"):
        a_frame([(1, 5, 1.0)], [1, 2])


def samples(steps: list[int], counted: list[bool]) -> pd.DataFrame:
    heading = np.linspace(3.0, 3.0 + 0.1 * len(steps), len(steps))
    wrapped = np.angle(np.exp(1j * heading))
    return pd.DataFrame({"step": steps, "direction_rad": wrapped, "in_statistics": counted})


def test_counted_range_is_first_and_last_counted_step() -> None:
    assert counted_range(samples([0, 10, 20, 30], [False, True, True, False])) == (10, 20)


def test_an_uncounted_run_is_refused() -> None:
    with pytest.raises(TableError, match="no sample of the statistics"):
        counted_range(samples([0, 10], [False, False]))


def test_a_gap_in_the_counted_stretch_is_refused() -> None:
    with pytest.raises(TableError, match="not contiguous"):
        counted_range(samples([0, 10, 20], [True, False, True]))


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """Return a run folder with frames at 0, 10, 20 and 30, of which 10 and 20 are counted."""
    own = {"volume_m3": 1e-6, "radius_mean_m": 1e-3, "radius_std_m": 0, "contact_moduli": {}}
    rows = [("fine", 1, 4), ("coarse", 5, 5)]
    classes = [
        {"name": name, "material": name, "first_id": first, "count": n, "density_kg_m3": 2e3, **own}
        for name, first, n in rows
    ]
    tables = write_documents(tmp_path, case_json("process", classes=classes)) / "tables"
    steps = list(range(0, 40, 5))
    samples(steps, [10 <= step <= 25 for step in steps]).to_parquet(
        tables / "workpiece_force.parquet"
    )
    frames = {0: STAR, 10: STAR, 20: [], 30: STAR}
    contacts = [contact_rows(step, rows) for step, rows in frames.items()]
    pd.concat([table for table in contacts if len(table)]).to_parquet(tables / "contacts.parquet")
    particles = [particle_rows(step, STAR_IDS if step != 20 else [1, 2]) for step in frames]
    pd.concat(particles).to_parquet(tables / "particles.parquet")
    return tmp_path


def test_frames_follow_the_count_of_particles_and_may_be_empty(run_dir: Path) -> None:
    frames = list(network_frames(run_dir))
    assert [frame.step for frame in frames] == [10, 20]
    assert [frame.particle_id.size for frame in frames] == [6, 2]
    assert [frame.normal_force.size for frame in frames] == [7, 0]


def test_a_frame_has_the_heading_of_its_step(run_dir: Path) -> None:
    table = pd.read_parquet(run_dir / "tables" / "workpiece_force.parquet")
    for frame in network_frames(run_dir):
        expected = table.loc[table["step"] == frame.step, "direction_rad"].iloc[0]
        assert math.cos(frame.direction_rad - expected) == pytest.approx(1.0)


def test_a_particle_with_two_rows_is_refused() -> None:
    with pytest.raises(TableError, match="particle 2 twice in step 1"):
        a_frame([(1, 2, 1.0)], [2, 1, 3, 2])


def test_write_chains_writes_counted_frames_only(run_dir: Path) -> None:
    write_chains(run_dir)
    network = pd.read_parquet(run_dir / "tables" / "network.parquet")
    chains = pd.read_parquet(run_dir / "tables" / "chains.parquet")
    assert network["step"].tolist() == [10, 20]
    assert network["n_contacts"].tolist() == [7, 0]
    assert set(chains["step"]) == {10}
    path = chains[chains["definition"] == "widest_path"].iloc[0]
    assert list(path["particle_ids"]) == [7, 1] or not path["reaches_bowl"]
    for ids, of_media in zip(chains["particle_ids"], chains["classes"], strict=True):
        assert list(of_media) == ["fine" if one < 5 else "coarse" for one in ids]
    clusters = pd.read_parquet(run_dir / "tables" / "clusters.parquet")
    assert clusters["step"].tolist() == [10] * len(FORCE_FACTORS) + [20] * len(FORCE_FACTORS)
    # above the mean of 3 N: particle 7 with particle 1 and on the workpiece, and particle 4 on the
    # side
    at_mean = clusters[(clusters["step"] == 10) & (clusters["force_factor"] == 1.0)].iloc[0]
    assert at_mean["strong_contacts"] == 3
    assert at_mean["largest_cluster"] == 2
    assert not at_mean["workpiece_to_bowl"]
    assert network["workpiece_to_bowl_n"].tolist() == [2.0, 0.0]
    assert not np.signbit(network["workpiece_to_bowl_n"]).any()
    assert not list((run_dir / "tables").glob("*.part"))


def test_a_stretch_without_frames_is_refused(run_dir: Path) -> None:
    tables = run_dir / "tables"
    samples([11, 15], [True, True]).to_parquet(tables / "workpiece_force.parquet")
    with pytest.raises(TableError, match="no frame of the contact network"):
        write_chains(run_dir)


# 1-2-3-4 with falling force, 5-6, and 7 alone
CHAIN = [(1, 2, 6.0), (2, 3, 5.0), (3, 4, 3.0), (5, 6, 4.0), (7, FLOOR, 9.0)]


def test_sizes_by_hand() -> None:
    found = find_clusters(a_frame(CHAIN, [*range(1, 8)]), np.array([0.0, 3.0, 4.0, 5.0, 6.0]))
    assert found.strong_contacts.tolist() == [5, 4, 3, 2, 1]
    assert found.clusters.tolist() == [2, 2, 1, 1, 0]
    assert found.clustered_particles.tolist() == [6, 5, 3, 2, 0]
    assert found.largest_cluster.tolist() == [4, 3, 3, 2, 0]
    assert found.squares.tolist() == [20, 13, 9, 4, 0]
    assert found.mean_cluster_size()[:2].tolist() == [2.0, 2.0]
    assert np.isnan(found.mean_cluster_size()[2:]).all()
    assert found.second_moment().tolist() == [4 / 7, 4 / 7, 0.0, 0.0, 0.0]


def test_a_frame_without_contacts_has_no_cluster() -> None:
    frame = a_frame([], [1, 2, 3])
    rows = cluster_rows(frame, frame_clusters(frame))
    assert rows["clusters"].tolist() == [0] * len(FORCE_FACTORS)
    assert not rows["workpiece_to_bowl"].any()
    assert math.isnan(rows["mean_cluster_size"][0])


def flooded(frame: NetworkFrame, least: float) -> tuple[np.ndarray, set[str]]:
    """Sizes of the clusters above a force, and the ways in which one spans."""
    strong = frame.normal_force > max(least, 0.0)
    inner, size = strong & frame.between_particles(), frame.particle_id.size
    graph = coo_array((np.ones(inner.sum()), (frame.a[inner], frame.b[inner])), (size, size))
    _, cluster = connected_components(graph, directed=False)
    x, y = frame.point[:, :2].T
    on_side, east_west = frame.other == SIDE, np.abs(x) > np.abs(y)
    workpiece, bowl, east, west, north, south = (
        set(cluster[frame.a[strong & where]].tolist())
        for where in (
            frame.other == WORKPIECE, frame.other < WORKPIECE,
            on_side & east_west & (x > 0), on_side & east_west & (x < 0),
            on_side & ~east_west & (y > 0), on_side & ~east_west & (y < 0),
        )
    )  # fmt: skip
    found = {"workpiece_to_bowl": workpiece & bowl, "side_to_side": (east & west) | (north & south)}
    sizes = np.bincount(cluster)
    return sizes[sizes > 1], {name for name, spanning in found.items() if spanning}


@given(seed=st.integers(0, 2**32 - 1), edge=st.integers(2, 6), levels=st.sampled_from([None, 1, 4]))
@settings(max_examples=30)
def test_clusters_are_those_of_a_flood(seed: int, edge: int, levels: int | None) -> None:
    frame = random_frame(seed, edge=edge, levels=levels)
    found = frame_clusters(frame)
    for at, least in enumerate(found.force_n):
        sizes, spans = flooded(frame, float(least))
        assert found.clusters[at] == len(sizes)
        assert found.clustered_particles[at] == sizes.sum()
        assert found.squares[at] == (sizes**2).sum()
        assert found.largest_cluster[at] == max(sizes, default=0)
        assert {name for name in SPANS if found.spans(name)[at]} == spans


@pytest.mark.parametrize("frame", [real_frame(), *map(random_frame, range(5))])
def test_workpiece_and_bowl_part_at_the_bottleneck_of_the_dominant_path(
    frame: NetworkFrame,
) -> None:
    path = dominant_path(frame, widest_paths(frame))
    assert path is not None
    weakest = frame.normal_force[list(path.contacts)].min()
    assert frame_clusters(frame).percolation_n["workpiece_to_bowl"] == weakest

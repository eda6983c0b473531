import math
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import RADIUS_M, random_frame, real_frame
from plain_chains import plain_clusters

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
    contact_counts,
    find_clusters,
    frame_clusters,
    frame_statistics,
    mechanical_coordination_number,
)
from dragchain.network.write import write_chains
from dragchain.tables.parquet import table_writer

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


def test_counts_of_a_star() -> None:
    frame = a_frame(STAR, STAR_IDS)
    assert dict(zip(frame.particle_id.tolist(), contact_counts(frame).tolist(), strict=True)) == {
        1: 2, 2: 1, 3: 1, 4: 2, 7: 5, 9: 0,
    }  # fmt: skip


def test_statistics_of_a_star() -> None:
    found = frame_statistics(a_frame(STAR, STAR_IDS))
    assert found["n_particles"] == 6
    assert found["n_contacts"] == 7
    assert found["n_particle_particle_contacts"] == 4
    assert found["n_particle_workpiece_contacts"] == 1
    assert found["n_particle_floor_contacts"] == 1
    assert found["n_particle_side_contacts"] == 1
    assert found["coordination_number"] == pytest.approx(11 / 6)
    assert found["mechanical_coordination_number"] == pytest.approx(5.0)
    assert found["rattler_fraction"] == pytest.approx(5 / 6)
    assert found["normal_force_mean_n"] == pytest.approx(3.0)
    assert found["normal_force_max_n"] == 5.0
    assert found["above_mean_fraction"] == pytest.approx(3 / 7)


def test_least_of_two_is_the_formula_of_thornton() -> None:
    # N = 6, N0 = 1 and N1 = 2 by hand; 11 ends of contacts
    counts = contact_counts(a_frame(STAR, STAR_IDS))
    assert mechanical_coordination_number(counts, least=2) == pytest.approx((11 - 2) / (6 - 1 - 2))


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
    tables = tmp_path / "tables"
    tables.mkdir()
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


def grouped(run_dir: Path, rows: int) -> None:
    """Write contacts and particles again in row groups of few rows."""
    for name in ("contacts", "particles"):
        file = run_dir / "tables" / f"{name}.parquet"
        pd.read_parquet(file).to_parquet(file, row_group_size=rows)


def test_row_groups_are_read_when_their_frames_are_due(run_dir: Path, monkeypatch) -> None:
    read: list[int] = []
    plain = pq.ParquetFile.read_row_group

    def noted(file, number, **options):
        read.append(number)
        return plain(file, number, **options)

    monkeypatch.setattr(pq.ParquetFile, "read_row_group", noted)
    grouped(run_dir, 2)
    frames = network_frames(run_dir, (10, 30))
    next(frames)
    # rows 7 to 13 of contacts and 6 to 11 of particles are step 10, and a row beyond shows their
    # ends
    assert sorted(set(read)) == [3, 4, 5, 6, 7]
    list(frames)
    assert len(read) == 8 + 7
    assert sorted(set(read)) == [3, 4, 5, 6, 7, 8, 9, 10]


def test_a_particle_with_two_rows_is_refused() -> None:
    with pytest.raises(TableError, match="particle 2 twice in step 1"):
        a_frame([(1, 2, 1.0)], [2, 1, 3, 2])


def test_a_table_in_parts_is_the_whole_table(tmp_path: Path) -> None:
    parts = [contact_rows(step, STAR[:step]) for step in (1, 2, 4, 1)]
    parts.insert(2, parts[0].iloc[:0])
    with table_writer(tmp_path / "t.parquet", group_rows=3) as table:
        for part in parts:
            table.write(part)
            assert not (tmp_path / "t.parquet").exists()
    whole = pd.concat(parts, ignore_index=True)
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "t.parquet"), whole)
    assert pq.ParquetFile(tmp_path / "t.parquet").num_row_groups == 3
    whole.to_parquet(tmp_path / "w.parquet", index=False)
    schemas = [pq.read_schema(tmp_path / f"{name}.parquet") for name in "tw"]
    assert schemas[0].equals(schemas[1], check_metadata=True)


def test_write_chains_writes_counted_frames_only(run_dir: Path) -> None:
    write_chains(run_dir)
    network = pd.read_parquet(run_dir / "tables" / "network.parquet")
    chains = pd.read_parquet(run_dir / "tables" / "chains.parquet")
    assert network["step"].tolist() == [10, 20]
    assert network["n_contacts"].tolist() == [7, 0]
    assert set(chains["step"]) == {10}
    path = chains[chains["definition"] == "widest_path"].iloc[0]
    assert list(path["particle_ids"]) == [7, 1] or not path["reaches_bowl"]
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


@pytest.mark.parametrize("frame", [real_frame(), *map(random_frame, range(5))])
def test_workpiece_and_bowl_part_at_the_bottleneck_of_the_dominant_path(
    frame: NetworkFrame,
) -> None:
    path = dominant_path(frame, widest_paths(frame, 0.0))
    assert path is not None
    weakest = frame.normal_force[list(path.contacts)].min()
    assert frame_clusters(frame).percolation_n["workpiece_to_bowl"] == weakest

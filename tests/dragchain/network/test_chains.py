import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import R, make_frame, random_frame, row
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from dragchain.network.chains import (
    dominant_path,
    major_stress,
    particle_stress,
    peters_rows,
    split_chains,
    widest_paths,
)
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame
from dragchain.network.write import chain_table

# a weak contact of two far particles brings the mean of the frame down
WEAK = {91: (0.5, 0.5, 0.03), 92: (0.5, 0.5 + 2 * R, 0.03), 93: (0.5, 0.5 + 4 * R, 0.03)}
WEAK_CONTACTS = [(91, 92, 0.001), (92, 93, 0.001)] + [(91, FLOOR, 0.001)] * 60


def paths_of(frame: NetworkFrame) -> pd.DataFrame:
    table = chain_table(frame)
    return table[table["definition"] == "widest_path"].reset_index(drop=True)


def test_straight_chain_gives_exactly_its_path() -> None:
    contacts = [(1, WORKPIECE, 4.0), (1, 2, 3.0), (2, 3, 5.0), (3, SIDE, 6.0), *WEAK_CONTACTS]
    paths = paths_of(make_frame(row(3) | WEAK, contacts, direction_rad=math.pi / 2))
    assert len(paths) == 1
    path = paths.iloc[0]
    assert path["particle_ids"] == [1, 2, 3]
    assert path["n_particles"] == 3
    assert path["bottleneck_n"] == 3.0
    assert path["mean_force_n"] == pytest.approx(4.5)
    assert path["length_m"] == pytest.approx(6 * R)
    assert path["azimuth_rad"] == pytest.approx(-math.pi / 2)
    assert path["inclination_rad"] == pytest.approx(0.0)
    assert path["altitude_m"] == pytest.approx(0.03)
    assert path["reaches_bowl"] and path["dominant"]
    assert path["end_kind"] == "side"


def test_downward_path_has_its_inclination() -> None:
    centres = {1: (0.0, 0.0, 3 * R), 2: (0.0, 0.0, R)}
    contacts = [(1, WORKPIECE, 4.0), (1, 2, 3.0), (2, FLOOR, 2.0), *WEAK_CONTACTS]
    paths = paths_of(make_frame(centres | WEAK, contacts))
    # from (-R, 0, 3R) on the workpiece to (0, 0, 0) on the floor
    assert paths["inclination_rad"][0] == pytest.approx(-math.atan(3.0))
    assert paths["length_m"][0] == pytest.approx(4 * R)
    assert paths["end_kind"][0] == "floor"
    assert paths["altitude_m"][0] == pytest.approx(2 * R)


def test_the_stronger_of_two_chains_is_dominant() -> None:
    centres = row(3) | row(3, first=11, y=0.05) | WEAK
    contacts = [(1, WORKPIECE, 9.0), (1, 2, 2.0), (2, 3, 9.0), (3, SIDE, 9.0)]
    contacts += [(11, WORKPIECE, 4.0), (11, 12, 4.0), (12, 13, 4.0), (13, SIDE, 3.0)]
    paths = paths_of(make_frame(centres, contacts + WEAK_CONTACTS))
    assert paths["particle_ids"].tolist() == [[1, 2, 3], [11, 12, 13]]
    assert paths["bottleneck_n"].tolist() == [2.0, 3.0]
    assert paths["dominant"].tolist() == [False, True]


def test_a_cut_path_does_not_reach_the_bowl() -> None:
    contacts = [(1, WORKPIECE, 4.0), (1, 2, 3.0), (2, 3, 0.0005), (3, SIDE, 6.0), *WEAK_CONTACTS]
    paths = paths_of(make_frame(row(3) | WEAK, contacts))
    assert paths["particle_ids"].tolist() == [[1]]
    assert not paths["reaches_bowl"][0] and not paths["dominant"][0]
    assert paths["end_kind"][0] == "none"
    assert math.isnan(paths["bottleneck_n"][0]) and math.isnan(paths["azimuth_rad"][0])


def test_an_empty_frame_has_no_chain_but_keeps_its_columns() -> None:
    table = chain_table(make_frame(row(3), []))
    assert table.empty
    assert table["dominant"].dtype == bool
    assert dominant_path(make_frame(row(3), []), []) is None


def test_stress_of_a_squeezed_particle_is_force_over_area() -> None:
    # two opposite contacts: sigma = 2 F R / V = 3 F / (2 pi R^2)
    frame = make_frame(row(3), [(1, 2, 2.0), (2, 3, 2.0)])
    stress, axis = major_stress(particle_stress(frame))
    assert stress[1] == pytest.approx(3 * 2.0 / (2 * math.pi * R**2))
    assert stress[0] == pytest.approx(stress[1] / 2)
    assert abs(axis[1]) == pytest.approx([1.0, 0.0, 0.0])


def test_wall_contacts_count_in_the_stress() -> None:
    frame = make_frame({1: (0.0, 0.0, R)}, [(1, FLOOR, 2.0)])
    stress, axis = major_stress(particle_stress(frame))
    assert stress[0] == pytest.approx(2.0 * R / (4 / 3 * math.pi * R**3))
    assert abs(axis[0]) == pytest.approx([0.0, 0.0, 1.0])


def squeezed_row(bend_rad: float = 0.0) -> NetworkFrame:
    """Return three particles between two walls, the third turned away by `bend_rad`, and
    rattlers."""
    turn = np.array([math.cos(bend_rad), math.sin(bend_rad), 0.0])
    centres = row(2) | {3: tuple(np.array([2 * R, 0, 0.03]) + 2 * R * turn)} | WEAK
    contacts = [(1, WORKPIECE, 5.0), (1, 2, 5.0), (2, 3, 5.0), (3, SIDE, 5.0), *WEAK_CONTACTS]
    return make_frame(centres, contacts, walls={SIDE: tuple(turn)})


def chain_ids(frame: NetworkFrame) -> list[list[int]]:
    chains = peters_rows(frame).particle_lists()
    return [frame.particle_id[chain].tolist() for chain in chains]


def test_a_squeezed_row_is_one_peters_chain() -> None:
    frame = squeezed_row()
    assert [sorted(ids) for ids in chain_ids(frame)] == [[1, 2, 3]]
    assert chain_ids(frame)[0][1] == 2
    table = chain_table(frame)
    peters = table[table["definition"] == "peters"].iloc[0]
    assert peters["length_m"] == pytest.approx(4 * R)
    assert peters["bottleneck_n"] == 5.0
    assert peters["major_stress_mean_pa"] == pytest.approx(3 * 5.0 / (2 * math.pi * R**2))
    assert peters["reaches_bowl"]


@pytest.mark.parametrize(("bend_deg", "chained"), [(80.0, True), (100.0, False)])
def test_a_bend_beyond_twice_alpha_breaks_a_chain(bend_deg: float, chained: bool) -> None:
    # the middle particle's axis halves the bend, so either link is bend / 2 off the axis
    assert bool(chain_ids(squeezed_row(math.radians(bend_deg)))) is chained


def test_a_branch_keeps_the_stronger_link() -> None:
    centres = row(3) | {4: (2 * R + 2 * R * math.cos(0.7), 2 * R * math.sin(0.7), 0.03)} | WEAK
    contacts = [(1, WORKPIECE, 9.0), (1, 2, 9.0), (2, 3, 7.0), (3, SIDE, 7.0), (2, 4, 4.0)]
    contacts += [(4, SIDE, 4.0), *WEAK_CONTACTS]
    assert [sorted(ids) for ids in chain_ids(make_frame(centres, contacts))] == [[1, 2, 3]]


def test_a_ring_is_not_closed() -> None:
    angles = np.arange(8) * math.pi / 4
    centres = {
        k + 1: (float(R * math.cos(a)), float(R * math.sin(a)), 0.03) for k, a in enumerate(angles)
    }
    contacts = [(k + 1, (k + 1) % 8 + 1, 5.0 + 0.1 * k) for k in range(8)]
    chains = chain_ids(make_frame(centres | WEAK, contacts + WEAK_CONTACTS))
    assert [sorted(ids) for ids in chains] == [list(range(1, 9))]
    # the weakest link, between particles 1 and 2, is where the ring stays open
    assert {chains[0][0], chains[0][-1]} == {1, 2}


def test_a_chain_is_listed_from_its_higher_end() -> None:
    centres = {k: (0.0, 0.0, R + 2 * R * k) for k in (0, 1, 2)}
    centres = {k + 1: centre for k, centre in centres.items()}
    contacts = [(1, FLOOR, 5.0), (1, 2, 5.0), (2, 3, 5.0), (3, WORKPIECE, 5.0), *WEAK_CONTACTS]
    frame = make_frame(centres | WEAK, contacts, walls={WORKPIECE: (0.0, 0.0, 1.0)})
    assert chain_ids(frame) == [[3, 2, 1]]


# --- random networks -------------------------------------------------------------------------

frames = st.builds(
    random_frame,
    st.integers(0, 2**32 - 1),
    edge=st.integers(2, 6),
    levels=st.sampled_from([None, 1, 2, 5]),
)


def joined(frame: NetworkFrame, contact: int) -> set[int]:
    return {int(frame.a[contact]), int(frame.b[contact])}


@given(frames)
@settings(max_examples=30)
def test_a_path_is_the_shortest_of_the_widest(frame: NetworkFrame) -> None:
    """Against the search of scipy, where a link is shorter the stronger it is."""
    force, bowl, long = frame.normal_force, frame.particle_id.size, 1e6
    strong = force > frame.mean_force_n()

    def distance(start: int, least: float) -> float:
        used = np.flatnonzero(strong & (frame.other != WORKPIECE) & (force >= least))
        lengths = np.full((bowl + 1, bowl + 1), np.inf)
        ends = frame.a[used], np.where(frame.b[used] >= 0, frame.b[used], bowl)
        np.minimum.at(lengths, ends, long - force[used])
        graph = csgraph_from_dense(np.minimum(lengths, lengths.T), null_value=np.inf)
        return float(dijkstra(graph, indices=start)[bowl])

    paths = widest_paths(frame)
    assert len(paths) == (strong & (frame.other == WORKPIECE)).sum()
    for path in paths:
        (first, *links), start = path.contacts, path.particles[0]
        assert (frame.other[first], frame.a[first]) == (WORKPIECE, start)
        if path.end is None:
            assert not links and distance(start, 0.0) == np.inf
            continue
        weakest = force[links].min()
        least = min(weakest, force[first])
        assert distance(start, least) == pytest.approx((long - force[links]).sum(), rel=1e-12)
        if weakest < force[first]:
            assert distance(start, np.nextafter(least, np.inf)) == np.inf
        for pair, link in zip(pairwise(path.particles), links[:-1], strict=True):
            assert set(pair) == joined(frame, link)
        assert frame.a[links[-1]] == path.particles[-1] and frame.other[links[-1]] == path.end


@given(frames)
@settings(max_examples=30)
def test_peters_chains_go_along_the_axes_of_stressed_particles(frame: NetworkFrame) -> None:
    tensor = particle_stress(frame)
    np.testing.assert_allclose(tensor, tensor.transpose(0, 2, 1))
    stress, axis = major_stress(tensor)
    chains = peters_rows(frame)
    assert len(set(chains.particles.tolist())) == len(chains.particles)
    assert (stress[chains.particles] > stress.mean()).all()
    links = split_chains(chains.contacts, chains.contact_starts)
    for particles, contacts in zip(chains.particle_lists(), links, strict=True):
        assert len(particles) >= 3
        for pair, contact in zip(pairwise(particles), contacts, strict=True):
            assert set(pair) == joined(frame, contact)
            line = np.subtract(*frame.centre[list(pair)])
            cosines = axis[list(pair)] @ line / np.linalg.norm(line)
            assert (np.abs(cosines) > math.sqrt(0.5) - 1e-9).all()


@given(st.builds(random_frame, st.integers(0, 2**32 - 1), edge=st.integers(2, 5)))
@settings(max_examples=20)
def test_numbering_and_order_change_nothing(frame: NetworkFrame) -> None:
    random = np.random.default_rng(frame.step)
    place = random.permutation(frame.particle_id.size)
    order = random.permutation(frame.a.size)
    swap = frame.between_particles() & (random.random(frame.a.size) < 0.5)
    mixed = replace(
        frame,
        centre=frame.centre[np.argsort(place)],
        a=place[np.where(swap, frame.b, frame.a)][order],
        b=np.where(frame.b >= 0, place[np.where(swap, frame.a, frame.b)], -1)[order],
        other=frame.other[order],
        point=frame.point[order],
        force=np.where(swap[:, None], -frame.force, frame.force)[order],
        normal_force=frame.normal_force[order],
    )
    plain, other = chain_table(frame), chain_table(mixed)
    plain["particle_ids"] = plain["particle_ids"].map(
        lambda ids: [int(place[one - 1]) + 1 for one in ids]
    )
    keys = ["definition", "mean_force_n", "altitude_m"]
    pd.testing.assert_frame_equal(
        plain.sort_values(keys, ignore_index=True), other.sort_values(keys, ignore_index=True)
    )

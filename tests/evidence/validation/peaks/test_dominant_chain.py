"""Dominant chains of frames made by hand or at random."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from networks import R, make_frame, row

from dragchain.network.chain_table import chain_table
from dragchain.network.chains import dominant_path, peters_rows, widest_paths
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame
from dragchain.network.write import write_chains
from dragchain.tables.write import write_tables
from evidence.validation.peaks.dominant_chain import (
    ChainNumbers,
    around_workpiece,
    chains_of,
    describe,
    frame_table,
    path_chain,
)
from evidence.validation.peaks.settings import DEFAULTS, FORCE_FACTORS, SETTINGS, Setting


def by_setting(frame: NetworkFrame) -> list[tuple[Setting, ChainNumbers]]:
    return list(zip(SETTINGS, chains_of(frame, around_workpiece(frame)), strict=True))


def straight_chain(first: float = 4.0) -> NetworkFrame:
    """Return a chain along x from the workpiece to the side, and weak contacts."""
    contacts = [(1, WORKPIECE, first), (1, 2, 3.0), (2, 3, 5.0), (3, SIDE, 6.0)]
    return make_frame(row(3) | {9: (0.5, 0.5, R)}, [*contacts, (9, FLOOR, 0.01)])


def test_numbers_of_a_straight_chain() -> None:
    frame = straight_chain()
    around = around_workpiece(frame)
    assert around.resistance_n == pytest.approx(4.0)
    assert around.mean_n == pytest.approx(18.01 / 5)
    assert around.shell_n == pytest.approx(3.0)
    found = describe(frame, around, path_chain(frame, with_workpiece=True))
    assert found.bottleneck_n == 3.0
    assert found.outer_over_mean == pytest.approx(5.0 / around.mean_n)
    assert found.bottleneck_over_drag == pytest.approx(0.75)
    assert found.workpiece_fraction == pytest.approx(1.0)
    assert found.stands_out == pytest.approx(1.0)
    assert found.particles == 3.0 and found.straightness == pytest.approx(1.0)
    assert found.angle_rad == pytest.approx(0.0)
    assert found.altitude_m == pytest.approx(0.03)


def test_the_force_on_the_workpiece_plays_no_part_in_the_free_path() -> None:
    numbers = []
    for first in (2.0, 40.0):
        frame = straight_chain(first)
        chain = path_chain(frame, with_workpiece=False)
        assert chain is not None
        numbers.append(frame.normal_force[chain.contacts].min())
    assert numbers == [3.0, 3.0]
    weakened = path_chain(straight_chain(2.0), with_workpiece=True)
    assert weakened is not None and weakened.contacts[0] == 0


def tangle(seed: int) -> NetworkFrame:
    """Return particles at random with contacts and forces at random."""
    rng = np.random.default_rng(seed)
    count = 40
    centres = {particle: tuple(rng.uniform(0, 0.05, 3)) for particle in range(1, count + 1)}
    force = lambda: float(rng.lognormal(0.0, 1.2))  # noqa: E731
    pairs = {tuple(sorted(rng.choice(count, 2, replace=False) + 1)) for _ in range(120)}
    contacts = [(int(a), int(b), force()) for a, b in sorted(pairs)]
    contacts += [(particle, WORKPIECE, force()) for particle in range(1, 7)]
    contacts += [(particle, SIDE, force()) for particle in range(30, 36)]
    contacts += [(particle, FLOOR, force()) for particle in range(36, 41)]
    return make_frame(centres, contacts)


def lattice(seed: int) -> NetworkFrame:
    """Return 6 x 6 particles in contact with their neighbours, forces at random, workpiece on the
    left."""
    rng = np.random.default_rng(seed)
    ids = np.arange(1, 37).reshape(6, 6)
    centres = {int(ids[i, j]): (2 * R * i, 2 * R * j, 0.03) for i in range(6) for j in range(6)}
    pairs = [*zip(ids[:-1].ravel(), ids[1:].ravel(), strict=True)]
    pairs += zip(ids[:, :-1].ravel(), ids[:, 1:].ravel(), strict=True)
    pairs += [(particle, WORKPIECE) for particle in ids[0]] + [
        (particle, SIDE) for particle in ids[-1]
    ]
    return make_frame(centres, [(int(a), int(b), float(rng.lognormal())) for a, b in pairs])


@pytest.mark.parametrize("seed", range(12))
def test_every_threshold_has_the_path_that_the_search_at_it_finds(seed: int) -> None:
    frame = tangle(seed)
    for setting, found in by_setting(frame):
        if not setting.is_path:
            continue
        with_workpiece = setting.definition == "widest_path"
        paths = widest_paths(frame, setting.force_factor, with_workpiece=with_workpiece)
        path = dominant_path(frame, paths, with_workpiece=with_workpiece)
        expected = [] if path is None else frame.particle_id[list(path.particles)].tolist()
        assert list(found.particle_ids) == expected
        assert found.exists == float(path is not None)
    factors = [setting.force_factor for setting in SETTINGS if setting.definition == "widest_path"]
    assert factors == list(FORCE_FACTORS)


def test_the_default_chain_by_peters_is_the_strongest_of_the_table() -> None:
    seen = 0
    for seed in range(80):
        frame = lattice(seed)
        table = chain_table(frame)
        pushed = set(frame.particle_id[frame.a[frame.other == WORKPIECE]].tolist())
        touching = np.array(
            [not pushed.isdisjoint(ids) for ids in table["particle_ids"]], dtype=bool
        )
        peters = table[(table["definition"] == "peters") & touching]
        for setting, ours in by_setting(frame):
            if not setting.default or setting.is_path:
                continue
            chains = (
                peters
                if setting.definition == "peters_workpiece"
                else peters[peters["reaches_bowl"]]
            )
            assert ours.exists == float(len(chains) > 0)
            if len(chains):
                best = chains.loc[chains["bottleneck_n"].idxmax()]
                assert set(ours.particle_ids) == set(best["particle_ids"])
                assert ours.bottleneck_n == best["bottleneck_n"]
                seen += 1
    assert seen > 10


def test_chains_on_the_workpiece_alone_are_told_from_chains_on_workpiece_and_bowl() -> None:
    contacts = [(1, WORKPIECE, 5.0), (1, 2, 5.0), (2, 3, 5.0), (3, 4, 5.0), (4, 5, 0.1)]
    weak = {91: (0.5, 0.5, R), 92: (0.5, 0.6, R)}
    frame = make_frame(row(5) | weak, [*contacts, (91, FLOOR, 0.01), (92, FLOOR, 0.01)])
    assert len(peters_rows(frame)) > 0
    of_default = {setting.definition: row for setting, row in by_setting(frame) if setting.default}
    assert of_default["peters"].exists == 0.0
    # stresses go as the sums of forces: 10, 10, 10, 5.1, 0.1, 0.01 and 0.01, with a mean of 5.03
    assert of_default["peters_workpiece"].particle_ids == [1, 2, 3, 4]


def test_the_defaults_reproduce_the_table_of_chains(tiny_run: Path) -> None:
    write_tables(tiny_run)
    write_chains(tiny_run)
    chains = pd.read_parquet(tiny_run / "tables" / "chains.parquet")
    dominant = chains[chains["dominant"]].reset_index(drop=True)
    table = frame_table(tiny_run)
    ours = table[(table["setting"] == DEFAULTS["widest_path"]) & (table["exists"] > 0)].reset_index(
        drop=True
    )
    assert len(ours) > 1
    assert ours["step"].tolist() == dominant["step"].tolist()
    assert [list(ids) for ids in ours["particle_ids"]] == [
        list(ids) for ids in dominant["particle_ids"]
    ]
    for name in ("bottleneck_n", "azimuth_rad", "inclination_rad", "altitude_m"):
        assert ours[name].tolist() == dominant[name].tolist()

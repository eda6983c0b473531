"""Network and chains from dumps of another script: those of our own tables, or what is missing."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from networks import REAL, real_frame

from dragchain.errors import TableError
from dragchain.network.foreign import network_of_dump
from dragchain.network.statistics import frame_clusters, frame_statistics
from dragchain.network.write import chain_table
from dragdeck.dumps.frame import Frame

NAMES = {"a_id": "c_p[7]", "b_id": "c_p[8]", "force_x_n": "c_p[10]", "force_y_n": "c_p[11]",
         "force_z_n": "c_p[12]", "point_x_m": "c_p[13]", "point_y_m": "c_p[14]",
         "point_z_m": "c_p[15]"}  # fmt: skip
WALLS = {"workpiece": 0, "floor": -1, "side": -2}


def dumped(table: pd.DataFrame, sign: float = 1.0, without: str = "none") -> Frame:
    turned = {name: sign if "force" in name else 1.0 for name in NAMES}
    columns: Any = {
        name: turned[ours] * table[ours].to_numpy()
        for ours, name in NAMES.items()
        if not ours.startswith(without)
    }
    return Frame(int(table["step"].iloc[0]), columns)


def particles(**other: Any) -> Frame:
    table = pd.read_parquet(REAL / "particles.parquet").sample(frac=1, random_state=1)
    columns: Any = {axis: table[f"{axis}_m"].to_numpy() for axis in "xyz"}
    columns |= {"id": table["particle_id"].to_numpy(), "radius": table["radius_m"].to_numpy()}
    return Frame(int(table["step"].iloc[0]), columns | other)


def contacts() -> tuple[pd.DataFrame, dict[str, tuple[Frame, dict[str, str]]]]:
    """Contacts of two particles, and those with walls as frames."""
    table = pd.read_parquet(REAL / "contacts.parquet")
    walls = {name: (dumped(table[table["b_id"] == b]), NAMES) for name, b in WALLS.items()}
    return table[table["b_id"] > 0], walls


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_dumps_with_all_give_what_our_tables_give(sign: float) -> None:
    pairs, walls = contacts()
    network, chains, missing = network_of_dump(
        particles(), dumped(pairs, sign), NAMES, walls, direction_rad=0.7
    )
    frame = real_frame()
    ours = frame_statistics(frame, frame_clusters(frame))
    assert missing == (() if sign > 0 else missing[:1])
    assert all("were turned" in text for text in missing)
    for name in ours.keys() - {"time_s"}:
        assert network[name] == pytest.approx(ours[name], rel=1e-4, nan_ok=True), name
    wanted = chain_table(frame)
    assert len(chains) == pytest.approx(len(wanted), abs=2)
    best = chains[chains["dominant"]].iloc[0], wanted[wanted["dominant"]].iloc[0]
    assert [*best[0]["particle_ids"]] == [*best[1]["particle_ids"]]


def test_what_is_missing_is_said_and_the_rest_is_known() -> None:
    pairs, _ = contacts()
    bare = particles()
    del bare.columns["radius"]
    network, chains, missing = network_of_dump(bare, dumped(pairs, without="point"), NAMES)
    assert [text.split(":")[0] for text in missing] == [
        "radius", "contact points", "contacts with workpiece, floor, side",
    ]  # fmt: skip
    assert chains.empty
    assert network["n_contacts"] == len(pairs)
    sized, by_diameter = (
        network_of_dump(frame, dumped(pairs, without="point"), NAMES)
        for frame in (particles(), Frame(bare.step, {**bare.columns, "diameter":
                                                    2 * particles().columns["radius"]}))
    )  # fmt: skip
    assert len(sized.chains) > 10
    assert set(sized.chains["definition"]) == {"peters"}
    pd.testing.assert_frame_equal(sized.chains, by_diameter.chains)


def test_contacts_across_a_border_are_left_out() -> None:
    pairs, _ = contacts()
    table = pairs.copy()
    ids = particles().columns["id"]
    centres = np.column_stack([particles().columns[axis] for axis in "xyz"])
    first = int(np.argmin(centres[:, 0]))
    other = int(np.argmax(centres[:, 0]))
    table.loc[table.index[0], ["a_id", "b_id"]] = ids[first], ids[other]
    found = network_of_dump(particles(), dumped(table), NAMES)
    assert any("1 of" in text and "periodic border" in text for text in found.missing)
    assert found.network["n_contacts"] == len(pairs) - 1


@pytest.mark.parametrize(
    ("change", "words"),
    [({"a_id": "id1"}, "no column 'id1'; it has c_p"), ({"b_id": "c_p[10]"}, "not in the dump")],
)
def test_wrong_columns_are_named(change: dict[str, str], words: str) -> None:
    pairs, _ = contacts()
    with pytest.raises(TableError) as caught:
        network_of_dump(particles(), dumped(pairs), NAMES | change)
    assert words in str(caught.value)

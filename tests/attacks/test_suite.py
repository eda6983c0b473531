"""The suite itself: it sees what differs, and does not take one outcome for another."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from attack.calls import Said, refused
from attack.checked import commands
from attack.fuzz import prefix
from attack.ground import differences
from made_run import Raw
from plain_dumps import binary_frames, text_frames

_VALUES = {"step": [1, 2, 3], "force_n": [0.1, np.nan, None], "ids": [[1], [2, 3], []]}


@pytest.fixture
def tables(tmp_path: Path) -> tuple[Path, Path]:
    for name in ("found", "wanted"):
        (tmp_path / name).mkdir()
        pq.write_table(pa.table(_VALUES), tmp_path / name / "a.parquet")
        (tmp_path / name / "a.json").write_text('{"value": 1.0, "wall_time_s": 3}')
    return tmp_path / "found", tmp_path / "wanted"


def test_the_same_tables_are_the_same(tables: tuple[Path, Path]) -> None:
    (tables[0] / "a.json").write_text('{"value": 1.0, "wall_time_s": 4}')
    assert differences(*tables) == []


@pytest.mark.parametrize(
    "changed",
    [
        {**_VALUES, "force_n": [0.1, np.nan, 0.0]},
        {**_VALUES, "force_n": [0.10000000000000002, np.nan, None]},
        {**_VALUES, "ids": [[1], [2], [3]]},
        {name: values[:2] for name, values in _VALUES.items()},
        {name: _VALUES[name] for name in ("step", "force_n")},
    ],
    ids=["null", "last bit", "list", "row", "column"],
)
def test_a_table_that_differs_is_found(tables: tuple[Path, Path], changed) -> None:
    pq.write_table(pa.table(changed), tables[0] / "a.parquet")
    assert differences(*tables)


@pytest.mark.parametrize(
    "text", ['{"value": 2.0, "wall_time_s": 3}', '{"wall_time_s": 3}', '{"va', None]
)
def test_a_document_that_differs_or_misses_is_found(tables: tuple[Path, Path], text) -> None:
    file = tables[0] / "a.json"
    file.unlink() if text is None else file.write_text(text)
    assert differences(*tables)


def test_a_message_that_names_what_is_wrong_is_a_refusal() -> None:
    assert refused(Said(1, "a.yaml: speed_m_s: too fast"), "speed_m_s")
    assert not refused(Said(0, "speed_m_s"), "speed_m_s")


@pytest.mark.parametrize(
    ("status", "text"),
    [
        (1, "something is wrong"),
        (1, "Traceback (most recent call last):\n speed_m_s"),
        (-11, "speed_m_s"),
        (None, "speed_m_s"),
    ],
)
def test_no_other_end_is_a_refusal(status: int | None, text: str) -> None:
    with pytest.raises(AssertionError):
        refused(Said(status, text), "speed_m_s")


@pytest.mark.parametrize(
    ("deck", "found"),
    [
        ("# a\nshell b", ["shell b"]),
        ("# a\rshell b", ["shell b"]),
        ("# a &\nshell b", []),
        ("run 1 # shell b", ["run 1"]),
        ("run &\n 1", ["run  1"]),
    ],
)
def test_commands_of_an_input_script_are_seen_as_the_engine_sees_them(deck: str, found) -> None:
    assert commands(deck) == found


def test_the_plain_readers_read_what_is_whole() -> None:
    rows = [[3, 0.5, -1e-30], [1, 0.25, 2e8]]
    names = ("id", "x", "c_f[1]")
    text = Raw.text(5, rows, names, "custom")
    binary = Raw.binary(5, rows, 3, 1)
    frame = (5, {"id": [3, 1], "x": [0.5, 0.25], "c_f[1]": [-1e-30, 2e8]})
    assert prefix(text_frames(text)) == ([frame], True)
    assert prefix(text_frames(text + text[:-1])) == ([frame], False)
    assert prefix(text_frames(text.replace(b"0.5", b"nan"))) == ([], False)
    assert prefix(binary_frames(binary, names)) == ([frame], True)
    assert prefix(binary_frames(binary + binary[:-1], names)) == ([frame], False)

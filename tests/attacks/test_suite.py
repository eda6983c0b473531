"""The suite itself: it sees what differs, and does not take one outcome for another."""

import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from attack.calls import REFUSED, UNNAMED, Said, judged
from attack.case import SECONDS, Attack, Got, Row, sample
from attack.damage import checkpoint_attacks, input_attacks, result_attacks
from attack.disks import disk_attacks
from attack.fuzz import binary_frames, prefix, text_frames
from attack.ground import differences
from attack.kills import PHASES, kill_attacks
from attack.meshes import mesh_attacks
from attack.studies import commands, study_attacks
from attack.table import as_page
from attack.templates import template_attacks
from attack.workflow import workflow_attacks
from tiny_run_files import Raw


def every(seed: int) -> list[Attack]:
    made = (kill_attacks, disk_attacks, checkpoint_attacks, input_attacks, result_attacks,
            study_attacks, template_attacks, mesh_attacks, workflow_attacks)  # fmt: skip
    return [attack for make in made for attack in make(seed)]


def test_the_whole_is_as_large_as_promised() -> None:
    attacks = every(1)
    of_phase = {
        (kind, phase): sum(a.kind == kind and a.name.startswith(f"{phase}: ") for a in attacks)
        for kind in ("kill", "disk")
        for phase in PHASES
    }
    assert sum(number for (kind, _), number in of_phase.items() if kind == "kill") >= 50
    assert all(number >= 10 for (kind, _), number in of_phase.items() if kind == "disk")
    assert all(number >= 1 for number in of_phase.values())
    assert {attack.kind for attack in attacks} | {"dump"} == set(SECONDS)


def test_no_two_attacks_have_the_same_name() -> None:
    names = [str(attack) for attack in every(1)]
    assert len(set(names)) == len(names)


def test_the_seed_and_nothing_else_decides() -> None:
    def names(seed: int) -> list[str]:
        return [str(attack) for attack in sample(every(seed), seed)]

    assert names(1) == names(1) != names(2)


def test_a_sample_has_every_kind_and_fits_into_two_minutes() -> None:
    chosen = sample(every(1), 1)
    assert sum(SECONDS.values()) <= 85  # the study that is attacked is made besides
    for kind, seconds in SECONDS.items():
        of_kind = [attack.seconds for attack in chosen if attack.kind == kind]
        assert sum(of_kind) <= seconds
        assert of_kind or kind in ("workflow", "dump")


@pytest.fixture
def tables(tmp_path: Path) -> tuple[Path, Path]:
    values = pa.table({"step": [1, 2, 3], "force_n": [0.1, np.nan, None], "ids": [[1], [2, 3], []]})
    for name in ("found", "wanted"):
        (tmp_path / name).mkdir()
        pq.write_table(values, tmp_path / name / "a.parquet")
        (tmp_path / name / "a.json").write_text('{"value": 1.0, "wall_time_s": 3}')
    return tmp_path / "found", tmp_path / "wanted"


def test_the_same_tables_are_the_same(tables: tuple[Path, Path]) -> None:
    (tables[0] / "a.json").write_text('{"value": 1.0, "wall_time_s": 4}')
    assert differences(*tables) == []


_NEXT = 0.10000000000000002


@pytest.mark.parametrize(
    "changed",
    [
        {"step": [1, 2, 3], "force_n": [0.1, np.nan, 0.0], "ids": [[1], [2, 3], []]},
        {"step": [1, 2, 3], "force_n": [_NEXT, np.nan, None], "ids": [[1], [2, 3], []]},
        {"step": [1, 2, 3], "force_n": [0.1, np.nan, None], "ids": [[1], [2], [3]]},
        {"step": [1, 2], "force_n": [0.1, np.nan], "ids": [[1], [2, 3]]},
        {"step": [1, 2, 3], "force_n": [0.1, np.nan, None]},
    ],
    ids=["null", "last bit", "list", "row", "column"],
)  # fmt: skip
def test_a_table_that_differs_is_found(tables: tuple[Path, Path], changed) -> None:
    pq.write_table(pa.table(changed), tables[0] / "a.parquet")
    assert differences(*tables)


def test_documents_that_differ_miss_or_are_cut_are_found(tables: tuple[Path, Path]) -> None:
    file = tables[0] / "a.json"
    for text in ('{"value": 2.0, "wall_time_s": 3}', '{"wall_time_s": 3}', '{"va'):
        file.write_text(text)
        assert differences(*tables)
    file.unlink()
    assert differences(*tables) == ["a.json is missing"]


def test_messages_are_judged_by_what_they_name() -> None:
    assert judged(Said(1, "a.yaml: speed_m_s: too fast", 1.0), "speed_m_s").outcome == REFUSED
    assert judged(Said(1, "something is wrong", 1.0), "speed_m_s").outcome == UNNAMED
    trace = "Traceback (most recent call last):\n speed_m_s"
    assert judged(Said(1, trace, 1.0), "speed_m_s").outcome == "traceback"
    assert judged(Said(-11, "speed_m_s", 1.0), "speed_m_s").outcome == "died of signal 11"
    assert judged(Said(None, "speed_m_s", 9.0), "speed_m_s").outcome == "no answer in 9 s"
    assert judged(Said(0, "speed_m_s", 1.0), "speed_m_s").outcome == "accepted"


def test_what_is_not_expected_stands_first_in_the_table() -> None:
    attack = Attack("study", "a | b\nc", lambda: Got(""), (REFUSED,))
    rows = [Row.of(attack, Got(outcome)) for outcome in (REFUSED, "accepted", "not run: no root")]
    assert [row.state for row in rows] == ["as expected", "unexpected", "not run"]
    page = as_page(rows, 1)
    lines = [line for line in page.splitlines() if line.startswith("| ") and "study" in line]
    assert [re.split(r" *\| *", line)[1] for line in lines] == [
        "unexpected",
        "not run",
        "as expected",
    ]


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

"""What tells a whole output file from one that was cut short."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from dragdeck.gates import check_run, last_frame

PRINT = {"kind": "print", "binary": False, "columns": ["step", "force_n"]}
LOCAL = {"kind": "local", "binary": False, "columns": ["a_id", "force_n"]}
CUSTOM = {"kind": "custom", "binary": True, "columns": ["a_id", "force_n"]}


def text_frame(step: int, rows: list[str]) -> str:
    box = "ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
    head = (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ENTRIES\n{len(rows)}\n{box}ITEM: ENTRIES a b \n"
    )
    return head + "".join(row + "\n" for row in rows)


def binary_frame(step: int, chunks: list[list[float]]) -> bytes:
    rows = sum(len(chunk) for chunk in chunks) // 2
    head = struct.pack("<qqi6i6d2i", step, rows, 0, *[1] * 6, *[0.0] * 6, 2, len(chunks))
    return head + b"".join(struct.pack(f"<i{len(c)}d", len(c), *c) for c in chunks)


@pytest.mark.parametrize(
    ("output", "content", "step"),
    [
        (PRINT, b"step force_n\n10 1.5\n20 1.6\n", 20),
        (PRINT, b"step force_n\n10 1.5\n20 1", None),
        (PRINT, b"step force_n\n10 1.5\n20\n", None),
        (PRINT, b"step force_n\n", None),
        (LOCAL, (text_frame(5, ["1 2"]) + text_frame(9, ["1 2", "3 4"])).encode(), 9),
        (LOCAL, text_frame(7, []).encode(), 7),
        (LOCAL, text_frame(9, ["1 2", "3 4"])[:-3].encode(), None),
        (LOCAL, text_frame(9, ["1 2", "3 4"])[:-4].encode(), None),
        (LOCAL, b"", None),
        (CUSTOM, binary_frame(3, [[1, 2], []]) + binary_frame(6, [[1, 2, 3, 4]]), 6),
        (CUSTOM, binary_frame(3, [[]]), 3),
        (CUSTOM, binary_frame(3, [[1, 2]])[:-1], None),
        (CUSTOM, (binary_frame(3, [[1, 2]]) * 2)[:-70], None),
        (CUSTOM, b"", None),
    ],
)
def test_the_last_frame_counts_only_if_whole(
    tmp_path: Path, output: dict, content: bytes, step: int | None
) -> None:
    file = tmp_path / "output"
    file.write_bytes(content)
    assert last_frame(file, output) == step


CASE = {"scene": "process", "media": {"count": 2}}
THERMO = {
    "kind": "print",
    "binary": False,
    "pattern": "thermo.{part}.txt",
    "columns": [
        "step",
        "time_s",
        "balls",
        "kinetic_energy_j",
        "rotational_energy_j",
        "fastest_ball_m_s",
    ],
    "last_step": 20,
}
HEAD = "step time_s balls kinetic_energy_j rotational_energy_j fastest_ball_m_s\n"
GOOD = HEAD + "10 0.1 2 1e-9 0 0.1\n20 0.2 2 1e-9 0 0.1\n"


@pytest.mark.parametrize(
    ("screen", "thermo", "status", "fails"),
    [
        ("DRAGDECK END\n", GOOD, 0, set()),
        ("DRAGDECK END\n", GOOD, 1, {"ended by itself"}),
        ("", GOOD, 0, {"ended by itself"}),
        ("ERROR: Bad\nDRAGDECK END\n", GOOD, 0, {"no engine error"}),
        ("Dangerous builds = 3\nDRAGDECK END\n", GOOD, 0, {"no dangerous neighbour builds"}),
        ("DRAGDECK END\n", GOOD.replace(" 2 ", " 1 "), 0, {"every ball kept"}),
        ("DRAGDECK END\n", GOOD.replace("1e-9", "nan"), 0, {"finite numbers"}),
        ("DRAGDECK END\n", GOOD.replace("20 0.2", "15 0.2"), 0, {"thermo whole"}),
        ("DRAGDECK END\n", HEAD, 0, {"every ball kept", "finite numbers", "thermo whole"}),
    ],
)
def test_each_gate_sees_its_own_fault(
    tmp_path: Path, screen: str, thermo: str, status: int, fails: set[str]
) -> None:
    (tmp_path / "screen.1.txt").write_text(screen)
    (tmp_path / "thermo.1.txt").write_text(thermo)
    gates = check_run(tmp_path, CASE, {"outputs": {"thermo": THERMO}}, status, 1)
    assert {gate.name for gate in gates if not gate.passed} == fails


def test_a_bed_that_did_not_settle_fails(tmp_path: Path) -> None:
    (tmp_path / "screen.1.txt").write_text("DRAGDECK NOT SETTLED: energy ratio 0.1\n")
    gates = check_run(tmp_path, {**CASE, "scene": "fill"}, {"outputs": {}}, 0, 1)
    assert {gate.name for gate in gates if not gate.passed} == {"ended by itself", "bed at rest"}


@pytest.mark.parametrize("cut", [0, 1, 30])
def test_a_frame_longer_than_the_first_look_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: int
) -> None:
    monkeypatch.setattr("dragdeck.gates.TAIL_BYTES", 16)
    content = (text_frame(5, ["1 2"]) + text_frame(9, ["3 4"] * 50)).encode()
    file = tmp_path / "output"
    file.write_bytes(content[: len(content) - cut])
    assert last_frame(file, LOCAL) == (None if cut else 9)

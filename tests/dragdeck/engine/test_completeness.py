"""Which steps the parts of a run hold."""

import math
import re
import struct
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from made_run import Raw, output_of_run
from spoilt_dumps import NAMES, ROWS, SPOILT, binary, text

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.dumps.grammar import whole_frames
from dragdeck.dumps.reader import read_frames
from dragdeck.engine.completeness import coverage, cut_outputs, first_gap, some_frames
from dragdeck.errors import DumpError
from dragdeck.records.run import RunPart

FORCE = output_of_run("force", "print", ["step", "force_n"], 10, 10, 60, pattern="force.{part}.txt")
HEAD = "step force_n\n"


def rows(*steps: int) -> str:
    return HEAD + "".join(f"{step} 1.5\n" for step in steps)


def parts(*from_steps: int) -> list[RunPart]:
    return [
        RunPart(part=number, checkpoint=None, from_step=step)
        for number, step in enumerate(from_steps, 1)
    ]


@pytest.mark.parametrize(
    ("texts", "starts", "gap"),
    [
        ([rows(10, 20, 30, 40, 50, 60)], [0], None),
        ([rows(10, 20, 30)], [0], 40),
        ([rows(10, 30, 40, 50, 60)], [0], 20),
        ([rows(10, 20, 30), rows(40, 50, 60)], [0, 30], None),
        ([rows(10, 20, 30, 40), rows(30, 40, 50, 60)], [0, 25], None),
        ([rows(10, 20), rows(40, 50, 60)], [0, 30], 30),
        # what a later part begins before does not count: it must write it again
        ([rows(10, 20, 30, 40), rows(40, 50, 60)], [0, 20], 30),
        ([HEAD + "10 1.5\n2" + rows(30, 40, 50, 60)], [0], 20),
        ([HEAD + "10 1.5\n20 1.5\n30 1." + rows()], [0], 30),
    ],
)
def test_the_first_missing_step_is_found(
    tmp_path: Path, texts: list[str], starts: list[int], gap: int | None
) -> None:
    for number, content in enumerate(texts, 1):
        (tmp_path / f"force.{number}.txt").write_text(content)
    assert coverage(tmp_path, FORCE, parts(*starts)).gap == gap
    wanted = math.inf if gap is None else gap
    assert first_gap(tmp_path, {"force": FORCE}, parts(*starts)) == wanted


def test_what_follows_a_hole_is_cut(tmp_path: Path) -> None:
    file = tmp_path / "force.1.txt"
    file.write_text(rows(10, 20) + "30 1.\x00\x00\n40 1.5\n")
    (damage,) = cut_outputs(tmp_path, {"force": FORCE}, parts(0), 60)
    assert damage == r"force.1.txt, row 2, byte 27: found b'30 1.\x00\x00\n', expected 2 numbers"
    assert file.read_text() == rows(10, 20)
    assert cut_outputs(tmp_path, {"force": FORCE}, parts(0), 60) == []


def test_what_the_next_part_writes_again_is_cut(tmp_path: Path) -> None:
    file = tmp_path / "force.1.txt"
    file.write_text(rows(10, 20) + rows(30))
    assert cut_outputs(tmp_path, {"force": FORCE}, parts(0), 20) == []
    assert file.read_text() == rows(10, 20) + HEAD
    cut_outputs(tmp_path, {"force": FORCE}, parts(0), -1)
    assert file.read_text() == HEAD


def test_an_output_that_the_engine_decides_on_has_no_gap(tmp_path: Path) -> None:
    decided = FORCE.model_copy(update={"last_step": None, "period_steps": 1})
    (tmp_path / "force.1.txt").write_text(rows(17, 18, 40))
    assert coverage(tmp_path, decided, parts(0)).gap is None


def dump(name: str) -> OutputOfRun:
    """The entry in ``columns.json`` of a spoilt dump."""
    made = output_of_run(
        "dump", "custom", NAMES, 7, 0, 21, binary=name.endswith(".bin"), engine_columns=NAMES
    )
    return made.model_copy(update={"pattern": name})


NUMBERS = re.compile(r"row \d+: |(id|x|c_f\[1\]) is |as numbers|are not text|names the columns")
"""What only a reader of every number and name can say."""


def read(file: Path) -> tuple[list[int], DumpError | None]:
    """The steps that the reader reads, and the error that ends them."""
    steps: list[int] = []
    try:
        steps.extend(frame.step for frame in read_frames([file], dump(file.name)))
    except DumpError as error:
        return steps, error
    return steps, None


def agrees_with_the_reader(file: Path) -> None:
    """The same frames are whole, and what follows them begins at the same byte."""
    found = whole_frames(file, dump(file.name))
    steps, error = read(file)
    if error is None:
        assert (found.steps, found.problem) == (steps, "")
    elif NUMBERS.search(str(error)):
        assert found.steps[: len(steps)] == steps
    else:
        assert found.steps == steps
        assert found.problem.startswith(f"frame {len(steps)}, byte {error.offset}: ")


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("what", SPOILT)
def test_the_whole_frames_of_a_damaged_dump_are_those_of_the_reader(
    tmp_path: Path, what: str, goes_on: bool
) -> None:
    name, content, _ = SPOILT[what]
    write = binary if name == "a.bin" else text
    (tmp_path / name).write_bytes(write([0, 7]) + content + (write([21]) if goes_on else b""))
    agrees_with_the_reader(tmp_path / name)


def damages(content: bytes) -> Iterator[tuple[int, bytes]]:
    """A file cut at every byte, and with another value in every byte; and where."""
    for place in range(len(content)):
        yield place, content[:place]
        for byte in (0, 0x39, 0xFF):
            yield place, content[:place] + bytes([byte]) + content[place + 1 :]


@pytest.mark.parametrize("name", ["a.bin", "a.dump"])
def test_a_damaged_byte_leaves_the_frames_before_it(tmp_path: Path, name: str) -> None:
    file, write = tmp_path / name, binary if name == "a.bin" else text
    ends = [len(write([0, 7, 14][:number])) for number in (1, 2, 3)]
    for place, damaged in damages(write([0, 7, 14])):
        file.write_bytes(damaged)
        found = whole_frames(file, dump(name))
        steps, error = read(file)
        assert len(found.steps) >= min(len(steps), sum(end <= place for end in ends))
        if error is None or not NUMBERS.search(str(error)):
            assert found.steps == steps[: len(found.steps)]
            assert found.problem or (len(found.steps) == len(steps) and error is None)


def test_frames_in_a_tilted_box_are_whole(tmp_path: Path) -> None:
    frames = [Raw.binary(step, ROWS[step], 3, 2) for step in (0, 14)]
    tilted = [
        frame[:16] + struct.pack("<i", 1) + frame[20:92] + bytes(24) + frame[92:]
        for frame in frames
    ]
    (tmp_path / "a.bin").write_bytes(b"".join(tilted))
    agrees_with_the_reader(tmp_path / "a.bin")
    (start, first), (end, last) = some_frames(tmp_path, dump("a.bin"), parts(0), 20)
    assert (start, end) == (0, 14)
    assert sorted(first.tolist()) == sorted(ROWS[0])
    np.testing.assert_array_equal(last, ROWS[14])


@pytest.mark.parametrize("name", ["a.bin", "a.dump"])
def test_the_size_of_a_dump_needs_no_memory(tmp_path: Path, name: str) -> None:
    rows = [[n, 0.5, -0.25] for n in range(1, 20_001)]
    binary = name.endswith(".bin")
    frame = Raw.binary(7, rows, 3) if binary else Raw.text(7, rows, NAMES, "custom")
    (tmp_path / name).write_bytes(frame * 20)
    tracemalloc.start()
    try:
        found = whole_frames(tmp_path / name, dump(name))
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()
    assert [end for _, end in found.ends] == [len(frame) * n for n in range(1, 21)]

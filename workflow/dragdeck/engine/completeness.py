"""Which frames of an output are whole, and whether all parts together hold every promised step."""

import math
import mmap
import os
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.physics.contact_network import Floats
from dragdeck.records.run import RunPart

_HEAD = struct.Struct("<qqi6i")
"""Of a binary frame: step, number of rows, whether the box is triclinic, its boundaries."""

_BOX_BYTES, _TILT_BYTES = 48, 24
_TAIL = struct.Struct("<2i")
"""Number of columns and of ranks, after the box."""

_CHUNK = struct.Struct("<i")
_TEXT_HEAD = re.compile(
    rb"ITEM: TIMESTEP\n(\d{1,18})\nITEM: NUMBER OF [^\n]*\n(\d{1,18})\nITEM: BOX BOUNDS[^\n]*\n"
    rb"(?:[^\n]*\n){3}ITEM: (?:ATOMS|ENTRIES)[^\n]*\n"
)
_MARK = b"ITEM: TIMESTEP\n"
_ROW_BEGINS = [bytes([byte]) for byte in b"0123456789+-. "]
_LONGEST_STEP = 18
"""Digits that fit into 64 bits, whatever they are."""

_NEW_FRAME = "a frame of this run was expected"


class _Damage(Exception):
    """Why the rest of a file is no whole frame."""


@dataclass(frozen=True)
class WholeFrames:
    """The frames of an output file up to the first that is not whole.

    Attributes
    ----------
    ends : tuple of (int or None, int)
        The step of each and where it ends, bytes; None for a line of titles.
    problem : str
        Place and kind of the damage that follows them; empty where nothing does.
    """

    ends: tuple[tuple[int | None, int], ...] = ()
    problem: str = ""

    @property
    def steps(self) -> list[int]:
        """Their steps, in the order of the file."""
        return [step for step, _ in self.ends if step is not None]

    def length_to(self, last: float) -> int:
        """Where the frames up to a step end, bytes."""
        kept = takewhile(lambda end: end[0] is None or end[0] <= last, self.ends)
        return max((end for _, end in kept), default=0)


def whole_frames(file: Path, output: OutputOfRun) -> WholeFrames:
    """Look at every frame of an output file: at its structure, not at its numbers.

    Parameters
    ----------
    file : Path
    output : OutputOfRun
        Its entry in ``columns.json``.
    """
    if file.stat().st_size == 0:
        return WholeFrames()
    ends: list[tuple[int | None, int]] = []
    place, problem = 0, ""
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        try:
            while place < len(text):
                step, place = _frame(text, place, output)
                ends.append((step, place))
        except _Damage as damage:
            number = sum(step is not None for step, _ in ends)
            problem = f"{'row' if output.kind == 'print' else 'frame'} {number}, byte {place}: "
            problem += str(damage)
    return WholeFrames(tuple(ends), problem)


def _frame(text: mmap.mmap, place: int, output: OutputOfRun) -> tuple[int | None, int]:
    """Step and end of the frame that begins at a byte; None for a line of titles."""
    if output.kind == "print":
        return _row(text, place, output.columns)
    if not output.binary:
        return _text_frame(text, place, len(output.columns))
    step, chunks = _binary_frame(text, place, len(output.columns))
    return step, chunks[-1][0] + 8 * chunks[-1][1]


def _row(text: mmap.mmap, place: int, columns: Sequence[str]) -> tuple[int | None, int]:
    """Step and end of a row; None for the line of titles."""
    end = text.find(b"\n", place) + 1
    if not end:
        raise _Damage("the file ends within a row")
    words = text[place:end].split()
    if words == [name.encode() for name in columns]:
        return None, end
    if len(words) != len(columns) or not _numbers(words):
        found = text[place : min(end, place + 60)]
        raise _Damage(f"found {found!r}, expected {len(columns)} numbers")
    return int(words[0]), end


def _numbers(words: list[bytes]) -> bool:
    try:
        [float(word) for word in words]
    except ValueError:
        return False
    return words[0].isdigit() and len(words[0]) <= _LONGEST_STEP


def _text_frame(text: mmap.mmap, place: int, width: int) -> tuple[int, int]:
    """Step and end of a frame of a text dump."""
    head = _TEXT_HEAD.match(text, place)
    if head is None:
        raise _Damage(f"found {text[place : place + 60]!r}, {_NEW_FRAME}")
    step, rows = map(int, head.groups())
    end = text.find(_MARK, head.end())
    lines = text[head.end() : len(text) if end < 0 else end]
    found = lines.count(b"\n")
    if found < rows:
        raise _Damage(f"{found} complete rows, but its header says {rows}")
    if found > rows or (lines and not lines.endswith(b"\n")):
        # what follows is not the next frame: more of its own rows, or something else
        size = sum(map(len, lines.split(b"\n")[:rows])) + rows
        if lines[size : size + 1] in _ROW_BEGINS:
            raise _Damage(f"more rows than the {rows} that its header says")
        lines = lines[:size]
    if rows and len(lines[:-1].rpartition(b"\n")[2].split()) != width:
        raise _Damage(f"its last row does not have {width} numbers")
    return step, head.end() + len(lines)


def _binary_frame(text: mmap.mmap, place: int, width: int) -> tuple[int, list[tuple[int, int]]]:
    """Step of a frame of a binary dump; where the numbers of each rank begin, and how many."""
    step, rows, triclinic, *_ = _unpacked(_HEAD, text, place)
    if step < 0 or rows < 0 or triclinic not in (0, 1):
        raise _Damage(f"its header is not that of a binary dump; {_NEW_FRAME}")
    place += _HEAD.size + _BOX_BYTES + triclinic * _TILT_BYTES
    found, ranks = _unpacked(_TAIL, text, place)
    if found != width or ranks < 1:
        raise _Damage(f"{found} columns from {ranks} ranks, expected {width} columns")
    place += _TAIL.size
    if place + _CHUNK.size * ranks + 8 * width * rows > len(text):
        raise _Damage(f"the file ends within its {rows} rows")
    chunks = []
    for _ in range(ranks):
        (count,) = _unpacked(_CHUNK, text, place)
        if count < 0 or count % width:
            raise _Damage(f"a rank wrote {count} numbers, not a multiple of {width} columns")
        chunks.append((place + _CHUNK.size, count))
        place += _CHUNK.size + 8 * count
    if sum(count for _, count in chunks) != rows * width or place > len(text):
        raise _Damage(f"the ranks did not write the {rows} rows that its header says")
    return step, chunks


def _unpacked(form: struct.Struct, text: mmap.mmap, place: int) -> tuple[int, ...]:
    if place + form.size > len(text):
        raise _Damage("the file ends within a frame")
    return form.unpack_from(text, place)


@dataclass(frozen=True)
class Coverage:
    """What the parts of a run hold of an output.

    Attributes
    ----------
    steps : frozenset of int
        Of whole frames that count: no later part begins before them.
    gap : int or None
        The first promised step that is missing, of those up to the last one written or promised.
    problem : str
        Place and kind of the damage in the file of the last part; empty without.
    """

    steps: frozenset[int]
    gap: int | None
    problem: str

    @property
    def last(self) -> int | None:
        """The last step."""
        return max(self.steps, default=None)


def part_files(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart]
) -> list[Path]:
    """The files that parts of a run write, there or not."""
    return [_file(folder, output, part) for output in outputs.values() for part in parts]


def _file(folder: Path, output: OutputOfRun, part: RunPart) -> Path:
    return folder / output.pattern.format(part=part.part)


def coverage(folder: Path, output: OutputOfRun, parts: Sequence[RunPart]) -> Coverage:
    """What the parts hold of an output; what a later part has written again counts once."""
    steps: set[int] = set()
    frames = WholeFrames()
    for part in parts:
        file = _file(folder, output, part)
        frames = whole_frames(file, output) if file.is_file() else WholeFrames()
        steps = {step for step in steps if step <= part.from_step}.union(frames.steps)
    return Coverage(frozenset(steps), _gap(steps, output), frames.problem)


def some_frames(
    folder: Path, output: OutputOfRun, parts: Sequence[RunPart], most: int
) -> Iterator[Floats]:
    """The rows of so many frames of a binary dump at most, spread evenly, the last one included."""
    files = [file for file in part_files(folder, {"": output}, parts) if file.is_file()]
    ends = [(file, (0, *(end for _, end in whole_frames(file, output).ends))) for file in files]
    begins = [(file, begin) for file, places in ends for begin in places[:-1]]
    for number in np.linspace(0, len(begins) - 1, min(most, len(begins))).astype(int):
        file, begin = begins[number]
        yield _rows_of_frame(file, begin, len(output.columns))


def _rows_of_frame(file: Path, begin: int, width: int) -> Floats:
    """The rows of the frame that begins at a byte, from all ranks."""
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        _, chunks = _binary_frame(text, begin, width)
        rows = [np.frombuffer(text[place : place + 8 * count], "<f8") for place, count in chunks]
    return np.concatenate(rows).reshape(-1, width)


def _gap(steps: set[int], output: OutputOfRun) -> int | None:
    last = output.last_step
    if last is None and output.period_steps == 1:  # the engine decides which steps it writes
        return None
    end = max(steps, default=output.first_step) if last is None else last
    wanted = range(output.first_step, end + 1, output.period_steps)
    return next((step for step in wanted if step not in steps), None)


def first_gap(folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart]) -> float:
    """The first step that some output lacks: a run can only go on from before it.

    Infinite where nothing is missing.
    """
    gaps = [coverage(folder, output, parts).gap for output in outputs.values()]
    return min((gap for gap in gaps if gap is not None), default=math.inf)


def cut_outputs(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart], last: int
) -> list[str]:
    """Cut from each output what the next part will write again: all after a step, and damage.

    Returns
    -------
    list of str
        File, place and kind of each damage.
    """
    damaged = []
    for output in outputs.values():
        for part in parts:
            file = _file(folder, output, part)
            if file.is_file():
                frames = whole_frames(file, output)
                os.truncate(file, frames.length_to(last))
                damaged += [f"{file.name}, {frames.problem}"] if frames.problem else []
    return damaged

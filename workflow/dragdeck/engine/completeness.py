"""Which frames of an output are whole, and whether all parts together hold every promised step."""

import math
import mmap
import os
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.record import RunPart
from dragdeck.physics.contact_network import Floats

_HEADER = struct.Struct("<qqi6i6d2i")
_CHUNK = struct.Struct("<i")
_MARK = b"ITEM: TIMESTEP\n"
_HEAD_LINES = 8
"""Lines of a text frame between its mark and its rows."""


@dataclass(frozen=True)
class WholeFrames:
    """The frames of an output file up to the first that is not whole.

    Attributes
    ----------
    ends : tuple of (int or None, int)
        The step of each and where it ends, bytes; None for a line of titles.
    size : int
        Of the file, bytes.
    """

    ends: tuple[tuple[int | None, int], ...]
    size: int

    @property
    def steps(self) -> list[int]:
        """Their steps, in the order of the file."""
        return [step for step, _ in self.ends if step is not None]

    @property
    def damaged(self) -> bool:
        """Whether something else follows them: the file was cut short, or has a hole."""
        return self.length_to(math.inf) < self.size

    def length_to(self, last: float) -> int:
        """Where the frames up to a step end, bytes."""
        kept = takewhile(lambda end: end[0] is None or end[0] <= last, self.ends)
        return max((end for _, end in kept), default=0)


def whole_frames(file: Path, output: OutputOfRun) -> WholeFrames:
    """Look at every frame of an output file.

    Parameters
    ----------
    file : Path
    output : OutputOfRun
        Its entry in ``columns.json``.
    """
    size = file.stat().st_size
    if size == 0:
        return WholeFrames((), 0)
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        if output.kind == "print":
            found = _rows(text, output)
        elif output.binary:
            found = _binary(text)
        else:
            found = _text(text, len(output.columns))
        return WholeFrames(tuple(found), size)


def _rows(text: mmap.mmap, output: OutputOfRun) -> Iterator[tuple[int | None, int]]:
    """Step and end of each row; None for the line of titles."""
    titles = " ".join(output.columns).encode()
    for line in iter(text.readline, b""):
        words = line.split()
        if line.rstrip() == titles and line.endswith(b"\n"):
            yield None, text.tell()
        elif line.endswith(b"\n") and len(words) == len(output.columns) and _numbers(words):
            yield int(words[0]), text.tell()
        else:
            return


def _numbers(words: list[bytes]) -> bool:
    try:
        [float(word) for word in words]
    except ValueError:
        return False
    return words[0].isdigit()


def _text(text: mmap.mmap, width: int) -> Iterator[tuple[int, int]]:
    """Step and end of each frame of a text dump."""
    place = 0
    while text[place : place + len(_MARK)] == _MARK:
        begin = place + len(_MARK)
        place = text.find(_MARK, begin)
        place = len(text) if place < 0 else place
        frame = text[begin:place]
        head = frame.split(b"\n", 3)
        if len(head) < 4 or not (head[0].isdigit() and head[2].isdigit()):
            return
        rows = int(head[2])
        if not frame.endswith(b"\n") or frame.count(b"\n") != _HEAD_LINES + rows:
            return
        if rows and len(frame[:-1].rpartition(b"\n")[2].split()) != width:
            return
        yield int(head[0]), place


def _binary(text: mmap.mmap) -> Iterator[tuple[int, int]]:
    """Step and end of each frame of a binary dump."""
    place = 0
    while place + _HEADER.size <= len(text):
        step, *_, width, ranks = _HEADER.unpack_from(text, place)
        place += _HEADER.size
        for _ in range(ranks):
            if place + _CHUNK.size > len(text):
                return
            (values,) = _CHUNK.unpack_from(text, place)
            if values < 0 or values % width:
                return
            place += _CHUNK.size + 8 * values
        if place > len(text):
            return
        yield step, place


@dataclass(frozen=True)
class Coverage:
    """What the parts of a run hold of an output.

    Attributes
    ----------
    steps : frozenset of int
        Of whole frames that count: no later part begins before them.
    gap : int or None
        The first promised step that is missing, of those up to the last one written or promised.
    damaged : bool
        Whether the file of the last part was cut short, or has a hole.
    """

    steps: frozenset[int]
    gap: int | None
    damaged: bool

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
    frames = WholeFrames((), 0)
    for part in parts:
        file = _file(folder, output, part)
        frames = whole_frames(file, output) if file.is_file() else WholeFrames((), 0)
        steps = {step for step in steps if step <= part.from_step}.union(frames.steps)
    return Coverage(frozenset(steps), _gap(steps, output), frames.damaged)


def some_frames(
    folder: Path, output: OutputOfRun, parts: Sequence[RunPart], most: int
) -> Iterator[Floats]:
    """The rows of so many frames of a binary dump at most, evenly spread over all parts."""
    files = [file for file in part_files(folder, {"": output}, parts) if file.is_file()]
    ends = [(file, (0, *(end for _, end in whole_frames(file, output).ends))) for file in files]
    begins = [(file, begin) for file, places in ends for begin in places[:-1]]
    for number in np.linspace(0, len(begins) - 1, min(most, len(begins))).astype(int):
        yield _rows_of_frame(*begins[number])


def _rows_of_frame(file: Path, begin: int) -> Floats:
    """The rows of the frame that begins at a byte, from all ranks."""
    with file.open("rb") as stream:
        stream.seek(begin)
        *_, width, ranks = _HEADER.unpack(stream.read(_HEADER.size))
        counts = (_CHUNK.unpack(stream.read(_CHUNK.size))[0] for _ in range(ranks))
        rows = [np.fromfile(stream, count=count) for count in counts]
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
        The files that were damaged.
    """
    damaged = []
    for output in outputs.values():
        for part in parts:
            file = _file(folder, output, part)
            if file.is_file():
                frames = whole_frames(file, output)
                os.truncate(file, frames.length_to(last))
                damaged += [file.name] if frames.damaged else []
    return damaged

"""Which frames of an output file are whole."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dragdeck.decks.outputs import OutputOfRun

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
    steps : tuple of int
        Their steps, in the order of the file.
    length : int
        Where the last of them ends, bytes.
    size : int
        Of the file, bytes: larger than `length` where it was cut short or has a hole.
    """

    steps: tuple[int, ...]
    length: int
    size: int

    @property
    def damaged(self) -> bool:
        """Whether something stands in the file that is no whole frame."""
        return self.length < self.size


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
        return WholeFrames((), 0, 0)
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        if output.kind == "print":
            found = _rows(text, output)
        elif output.binary:
            found = _binary(text)
        else:
            found = _text(text, len(output.columns))
        ends = list(found)
    steps = tuple(step for step, _ in ends if step is not None)
    return WholeFrames(steps, ends[-1][1] if ends else 0, size)


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

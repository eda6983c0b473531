"""Whether the last frame of an output file is whole."""

from __future__ import annotations

import struct
from pathlib import Path

from dragdeck.decks.outputs import OutputOfRun

_TAIL_BYTES = 4_000_000
"""How much of a text output's end is looked at first; a dump's frame can be longer."""

_HEADER = struct.Struct("<qqi6i6d2i")
_CHUNK = struct.Struct("<i")


def last_frame(file: Path, output: OutputOfRun, *, tail_bytes: int = _TAIL_BYTES) -> int | None:
    """Step of a file's last frame, or None where that frame is not whole.

    Parameters
    ----------
    file : Path
    output : OutputOfRun
        Its entry in ``columns.json``.
    tail_bytes : int
        How much of the file's end is looked at first.
    """
    if output.kind == "print":
        return _last_row(_tail(file, tail_bytes), len(output.columns))
    if output.binary:
        return _last_binary(file)
    return _last_text(_from_last(file, b"ITEM: TIMESTEP\n", tail_bytes), len(output.columns))


def _from_last(file: Path, mark: bytes, length: int) -> bytes | None:
    """What follows the last mark in a file; None where there is none."""
    size = file.stat().st_size
    with file.open("rb") as stream:
        while True:
            stream.seek(max(0, size - length))
            _, mark_read, rest = stream.read().rpartition(mark)
            if mark_read:
                return rest
            if length >= size:
                return None
            length *= 4


def _tail(file: Path, length: int) -> str:
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - length))
        return stream.read().decode("ascii", errors="replace")


def _last_row(text: str, width: int) -> int | None:
    if not text.endswith("\n"):
        return None
    words = text.splitlines()[-1].split()
    return int(words[0]) if len(words) == width and words[0].isdigit() else None


def _last_text(frame: bytes | None, width: int) -> int | None:
    if frame is None or not frame.endswith(b"\n"):
        return None
    lines = frame.count(b"\n")
    head = frame.split(b"\n", 3)
    if lines < 8 or lines != 8 + int(head[2]):
        return None
    last_row = frame[:-1].rpartition(b"\n")[2]
    return int(head[0]) if lines == 8 or len(last_row.split()) == width else None


def _last_binary(file: Path) -> int | None:
    size, place, step = file.stat().st_size, 0, None
    with file.open("rb") as stream:
        while place < size:
            header = stream.read(_HEADER.size)
            if len(header) < _HEADER.size:
                return None
            step, *_, processes = _HEADER.unpack(header)
            for _ in range(processes):
                chunk = stream.read(_CHUNK.size)
                if len(chunk) < _CHUNK.size:
                    return None
                stream.seek(8 * _CHUNK.unpack(chunk)[0], 1)
            place = stream.tell()
    return step if place == size else None

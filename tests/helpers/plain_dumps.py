"""What a dump says, by readers that know no shortcut and share no code with the packages."""

import struct
from collections.abc import Iterator, Sequence

WholeFrame = tuple[int, dict[str, list[float]]]
"""Step and columns."""


def text_frames(content: bytes) -> Iterator[WholeFrame]:
    """Frames of a text dump, as far as they are whole; `ValueError` where they are not.

    The last row need not have a line end.
    """
    lines = content.split(b"\n")
    place = 0
    while place < len(lines) and lines[place:] != [b""]:
        if not lines[place].startswith(b"ITEM: TIMESTEP"):
            raise ValueError(lines[place])
        step, count = int(lines[place + 1]), int(lines[place + 3])
        names = [name.decode("latin-1") for name in lines[place + 8].split()[2:]]
        rows = [line.split() for line in lines[place + 9 : place + 9 + count]]
        if len(rows) < count or any(len(row) != len(names) for row in rows):
            raise ValueError("rows")
        values = {name: [_number(row[n]) for row in rows] for n, name in enumerate(names)}
        place += 9 + count
        yield step, values


def _number(word: bytes) -> float:
    if b"_" in word:
        raise ValueError(word)
    return float(word)


def binary_frames(content: bytes, names: Sequence[str]) -> Iterator[WholeFrame]:
    """Frames of a binary dump, as far as they are whole."""
    place = 0
    while place < len(content):
        step, rows, triclinic, *_ = struct.unpack_from("<qqi", content, place)
        head = "<qqi6i6d" + ("3d" if triclinic else "") + "ii"
        *_, width, ranks = struct.unpack_from(head, content, place)
        place += struct.calcsize(head)
        numbers: list[float] = []
        for _ in range(ranks):
            (count,) = struct.unpack_from("<i", content, place)
            numbers += struct.unpack_from(f"<{count}d", content, place + 4)
            place += 4 + 8 * count
        if width != len(names) or len(numbers) != rows * width:
            raise ValueError("rows")
        yield step, {name: numbers[n::width] for n, name in enumerate(names)}

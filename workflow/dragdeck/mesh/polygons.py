"""Surfaces of flat polygons, and what the texts of surface files have in common.

Of STL, OBJ and PLY files only nodes and facets are read. Normals, textures, colours, groups and
other elements stand beside them in a user's file and are passed over. What could be read in two
ways is refused with its line or byte.
"""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.mesh.surface import Floats, Integers

_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.I)
_GROUPED = r"[-+]?[1-9]\d{0,2}(,\d{3})+(?!\S)"
_C_NUMBERS = str.maketrans(",Dd", ".ee")

_PIECE, _LONGEST = 1 << 19, 4 << 20
"""Characters of a text that are read at a time, and of the longest line or facet."""

_PADDING = "\0\x1a \t\n"
"""What may stand behind the last line of a text: some programs fill up blocks."""


class Polygons(NamedTuple):
    """A surface of flat polygons.

    Attributes
    ----------
    points : (N, 3) array
    cells : sequence of (M, k) arrays
        Nodes of the polygons with k corners, for each k.
    """

    points: Floats
    cells: Sequence[Integers]


def numbers(words: Sequence[str], line: int | None = None) -> Floats:
    """Numbers as text, of decimal points or commas, with the exponents of C or Fortran.

    Raises
    ------
    InputError
        One of them is no number, or a comma may stand for thousands.
    """
    joined = " ".join(words)
    if "," in joined and "." in joined:
        raise InputError(
            "decimal commas beside decimal points",
            line=line,
            value=joined[:60],
            limit="one of both",
        )
    try:
        values = [*map(float, joined.translate(_C_NUMBERS).split())]
    except ValueError:
        values = []
    if len(values) != len(words) or "_" in joined:
        wrong = next(word for word in words if not _NUMBER.fullmatch(word))
        raise InputError("not a number", line=line, value=wrong[:60], limit="such as 1.5 or 2e-3")
    return np.array(values)


def refuse_two_marks(text: str, before: str, lines: int = 0) -> None:
    """Refuse decimal points beside commas, and commas that may all be marks of thousands.

    `before` matches what stands before a number; so many lines stand before the text.

    Raises
    ------
    InputError
        It names the line of a comma.
    """
    if "," not in text:
        return
    comma, point, sure = (
        re.search(f"{before}{mark}", text, re.I | re.M)
        for mark in (r"\S*,\S*", r"\S*\.", rf"(?!{_GROUPED})\S*,")
    )
    if comma and (point or not sure):
        problem = "decimal commas beside decimal points"
        limit = "one of both"
        if point:
            limit += f"; line {lines + text.count(chr(10), 0, point.end()) + 1} has a point"
        else:
            problem = "a comma may be a decimal comma or a mark of thousands"
            limit = "a comma with other than three digits behind it, or decimal points"
        raise InputError(
            problem,
            line=lines + text.count("\n", 0, comma.end()) + 1,
            value=comma[0].split("\n")[-1].strip()[-60:],
            limit=limit,
        )


def by_size(corners: Sequence[int] | Integers, sizes: Sequence[int] | Integers) -> list[Integers]:
    """Polygons one after the other as an (M, k) array for each number of corners k."""
    nodes, counts = np.asarray(corners, dtype=np.int64), np.asarray(sizes, dtype=np.int64)
    first = np.cumsum(counts) - counts
    return [
        nodes[first[counts == size][:, None] + np.arange(size)]
        for size in np.unique(counts)
        if size
    ]


def no_such_node(number: int, nodes: range, line: int | None = None) -> InputError:
    """Of a facet that names a node beyond those of the file."""
    return InputError(
        "a facet names a node that is not there",
        line=line,
        value=number,
        limit=f"{nodes.start} to {nodes.stop - 1}",
    )


def no_polygons(count: int, kind: object) -> InputError:
    """Of cells of a kind that is no polygon."""
    return InputError(
        "the mesh contains cells that are no polygons",
        value=f"{count} of type {kind}",
        limit="triangles, quadrilaterals, polygons",
        remedy="export the surface alone",
    )


def mesh_text(content: bytes) -> str:
    """The text of a surface file, without what fills it up."""
    return text_of(content).rstrip(_PADDING)


def pieces(text: str, end: re.Pattern[str], what: str) -> Iterator[tuple[int, str]]:
    """A text in pieces that end where one may end, each with the number of its first line.

    Raises
    ------
    InputError
        There is no end for too long.
    """
    start, line = 0, 1
    while start < len(text):
        match = end.search(text, start + _PIECE, start + _LONGEST)
        if match is None and start + _LONGEST < len(text):
            value, limit = f"{_LONGEST >> 20} MB without its end", "lines, as programs write them"
            raise InputError(f"{what} is too long", line=line, value=value, limit=limit)
        stop = match.end() if match else len(text)
        yield line, text[start:stop]
        line += text.count("\n", start, stop)
        start = stop


def one_space(text: str) -> str:
    """The same words with one space between two, and none at both ends of a line."""
    text = text.replace("\t", " ")
    while "  " in text:
        text = text.replace("  ", " ")
    return text.replace(" \n", "\n").replace("\n ", "\n").strip(" ")

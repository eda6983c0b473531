"""Polygons in OBJ files."""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from dragdeck.arrays import ANY, NUMBER, WHOLE, quick_columns
from dragdeck.errors import InputError
from dragdeck.mesh.polygons import (
    Polygons,
    by_size,
    mesh_text,
    no_such_node,
    numbers,
    one_space,
    pieces,
    refuse_two_marks,
)
from dragdeck.mesh.surface import Floats, Integers

_END = re.compile(r"(?<!\\)\n")
_FACET = re.compile(r"f( \d+(?P<beside>(/\d*){0,2}))( \d+(/\d*){0,2})*")
_DIGITS = b"0123456789"
_FACETS = "f", "fo"
_OTHER_FILES = "call", "csh"
_SLOWLY = ("\\", "\nv\n", "\nf\n", *(f"\n{key}" for key in ("fo", *_OTHER_FILES)))
"""What keeps a piece from being read at once."""

_FEW_CORNERS = 64

_MOST_CORNERS = 10_000
"""Of a polygon: dividing one into triangles takes time that grows with their square."""


def obj(content: bytes) -> Polygons:
    """The polygons of an OBJ file, of all its groups.

    Raises
    ------
    InputError
        A line is damaged, or names a node that is not there, or the file has no facets.
    """
    text = mesh_text(content)
    coordinates, corners, sizes = [np.empty((0, 3))], [np.empty(0, int)], [np.empty(0, int)]
    nodes, last = 0, [(0, 0, "")]
    for line, piece in pieces(text, _END, "a line"):
        points, named, counts = _quickly(piece) or _slowly(piece, line, nodes)
        last.append((int(named.max(initial=-1)), line, piece))
        coordinates.append(points)
        corners.append(named)
        sizes.append(counts)
        nodes += len(points)
    refuse_two_marks(text, r"^[ \t]*v(?:\s+\S+){0,2}\s+\S*")
    for most, line, piece in last:
        if most >= nodes:
            _refuse_beyond(piece, line, nodes)
    if not any(map(len, sizes)):
        raise InputError("no facets", line=1, value=text[:60].split("\n")[0], limit='"f 1 2 3"')
    return Polygons(
        np.concatenate(coordinates), by_size(np.concatenate(corners), np.concatenate(sizes))
    )


_Piece = tuple[Floats, Integers, Integers]
"""Nodes, (N, 3), corners of all facets one after the other, and how many each has."""


def _quickly(piece: str) -> _Piece | None:
    """What is in a piece if it is written as nearly every program does."""
    text = one_space(f"\n{piece}\n")
    if any(mark in text for mark in _SLOWLY) or not text.replace("\n", "").isprintable():
        return None
    lines = text.split("\n")
    nodes = [line for line in lines if line.startswith("v ")]
    layout = ["v", NUMBER, NUMBER, NUMBER, *[ANY] * (nodes[0].count(" ") - 3 if nodes else 0)]
    points = _columns(nodes, layout)
    facets: dict[int, list[str]] = {}
    for line in lines:
        if line.startswith("f "):
            facets.setdefault(line.count(" "), []).append(line)
    corners = [_facets(rows, count) for count, rows in facets.items()]
    if points is None or any(named is None for named in corners):
        return None
    sizes = [np.full(len(rows), count) for count, rows in facets.items()]
    named = [rows.ravel() for rows in corners if rows is not None]
    start = [np.empty(0, int)]
    return points.reshape(-1, 3), np.concatenate(start + named), np.concatenate(start + sizes)


def _facets(lines: list[str], count: int) -> Integers | None:
    """Nodes of polygons, (M, count), if all name them in the same way and from the first."""
    first, text = _FACET.fullmatch(lines[0]), "".join(f"{line}\n" for line in lines).encode()
    if first is None or not 3 <= count <= _FEW_CORNERS:
        return None
    form = f"{lines[0]}\n".encode().translate(None, _DIGITS)
    if text.translate(None, _DIGITS) != len(lines) * form:
        return None
    layout = ["f", *[WHOLE, *[ANY] * first["beside"].count("/")] * count]
    columns = quick_columns(text.replace(b"/", b" "), layout)
    named = None if columns is None else np.column_stack(columns) - 1
    return None if named is None or named.min() < 0 else named


def _columns(lines: list[str], layout: Sequence[str]) -> Floats | None:
    if not lines:
        return np.empty((0, 3))
    columns = quick_columns("".join(f"{line}\n" for line in lines).encode(), layout)
    return None if columns is None else np.column_stack(columns)


def _slowly(piece: str, first: int, before: int) -> _Piece:
    """What is in a piece, line by line, behind so many nodes."""
    points, corners, sizes = list[Floats](), list[int](), list[int]()
    for line, (key, *words) in _lines(piece, first):
        if key == "v":
            _refuse_fewer(words, 3, "coordinates of a node", line)
            points.append(numbers(words[:3], line))
        elif key in _FACETS:
            _refuse_fewer(words, 3, "corners of a facet", line)
            corners += [_node(word, before + len(points), line) for word in words]
            sizes.append(len(words))
        elif key in _OTHER_FILES:
            raise InputError(
                "the file takes in another one",
                line=line,
                value=" ".join([key, *words])[:60],
                limit="all nodes and facets in one file",
            )
    return np.array(points).reshape(-1, 3), np.array(corners, int), np.array(sizes, int)


def _lines(piece: str, first: int) -> Iterator[tuple[int, list[str]]]:
    """Lines with their numbers, without comments, those that go on joined."""
    begun: list[str] = []
    for number, line in enumerate(piece.split("\n"), first):
        text = line.partition("#")[0].rstrip()
        begun += text.removesuffix("\\").split()
        if "\0" in text or len(begun) > _MOST_CORNERS:
            problem = "a byte is 0" if "\0" in text else "a line has too many words"
            limit = f"a text, UTF-8 for example, with at most {_MOST_CORNERS:,} words per line"
            value = None if "\0" in text else f"{len(begun)} words"
            raise InputError(problem, line=number, value=value, limit=limit)
        if begun and not text.endswith("\\"):
            yield number, begun
            begun = []
    if begun:
        yield number, begun


def _refuse_beyond(piece: str, first: int, nodes: int) -> None:
    for line, (key, *words) in _lines(piece, first):
        if key in _FACETS:
            beyond = [number for word in words if (number := int(word.partition("/")[0])) > nodes]
            if beyond:
                raise no_such_node(beyond[0], range(1, nodes + 1), line)


def _refuse_fewer(words: Sequence[str], fewest: int, what: str, line: int) -> None:
    if len(words) < fewest:
        raise InputError(f"too few {what}", line=line, value=" ".join(words), limit=f"{fewest}")


def _node(word: str, before: int, line: int) -> int:
    """Index of a corner ``node/texture/normal``: nodes count from 1, or backwards from the last."""
    name = word.partition("/")[0]
    if not re.fullmatch(r"[+-]?\d{1,18}", name):
        raise InputError("not a corner", line=line, value=word[:60], limit="such as 3, 3/1 or 3//2")
    number = int(name)
    if number == 0 or number < -before:
        raise no_such_node(number, range(1, before + 1), line)
    return number - 1 if number > 0 else before + number

"""Polygons in OBJ files."""

import re
from collections.abc import Iterator, Sequence
from typing import Any

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
_GEOMETRY = ["v"], ["f"]
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
    refuse_two_marks(text, r"^[ \t]*v(?:\s+\S+){0,2}\s+")
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
    text = one_space("\n" + piece.strip("\n") + "\n")
    if any(mark in text for mark in _SLOWLY) or not text.replace("\n", "").isprintable():
        return None
    points, corners, sizes = np.empty((0, 3)), [np.empty(0, int)], [np.empty(0, int)]
    for key, rows in _alike(text):
        columns = _nodes(rows) if key == "v" else _facets(rows)
        if columns is None:
            return None
        if key == "v":
            points = np.column_stack(columns)
        else:
            corners.append(np.column_stack(columns).ravel() - 1)
            sizes.append(np.full(len(columns[0]), len(columns)))
    named = np.concatenate(corners)
    return (points, named, np.concatenate(sizes)) if named.min(initial=0) >= 0 else None


def _alike(text: str) -> Iterator[tuple[str, bytes]]:
    """Rows of nodes, and those of facets with the same number of words; each with its key."""
    every = text.count("\n") - 1
    for key in "vf":
        if text.count(f"\n{key} ") == every and (key == "v" or _is_uniform(text[1:].encode())):
            yield key, text[1:].encode()
            return
    if text.count("\nv ") + text.count("\nf ") == 0:
        return
    rows: dict[tuple[str, int], list[str]] = {}
    for line in text.split("\n"):
        if line.startswith(("v ", "f ")):
            key = line[0]
            rows.setdefault((key, line.count(" ") if key == "f" else 0), []).append(line)
    for (key, _), lines in rows.items():
        yield key, "\n".join([*lines, ""]).encode()


def _nodes(rows: bytes) -> list[Any] | None:
    """Coordinates of nodes, (N,) each; more numbers may stand behind them."""
    more = rows[: rows.find(b"\n")].count(b" ") - 3
    return quick_columns(rows, ["v", *[NUMBER] * 3, *[ANY] * more])


def _is_uniform(rows: bytes) -> bool:
    """Whether all rows have the same words but for their digits."""
    form = rows[: rows.find(b"\n") + 1].translate(None, _DIGITS)
    return rows.translate(None, _DIGITS) == rows.count(b"\n") * form


def _facets(rows: bytes) -> list[Any] | None:
    """Numbers of nodes of each corner, (M,), if all are named alike and from the first."""
    first = rows[: rows.find(b"\n")].decode()
    match, count = _FACET.fullmatch(first), first.count(" ")
    if not match or not 3 <= count <= _FEW_CORNERS or not _is_uniform(rows):
        return None
    layout = ["f", *[WHOLE, *[ANY] * match["beside"].count("/")] * count]
    return quick_columns(rows.replace(b"/", b" "), layout)


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
    begun, doubtful = list[str](), False
    for number, line in enumerate(piece.split("\n"), first):
        text = line.partition("#")[0].rstrip()
        if doubtful and text.lstrip()[:2].split() in _GEOMETRY:
            raise InputError(
                "the line before may go on here",
                line=number,
                value=line[:60],
                limit="no backslash at the end of a comment or a name",
            )
        begun += text.removesuffix("\\").split()
        goes_on = line.rstrip().endswith("\\")
        doubtful = goes_on and not ("#" not in line and begun[:1] in _GEOMETRY)
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

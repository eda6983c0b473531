"""Facets in STL files, text or binary."""

import re

import numpy as np

from dragdeck.arrays import ANY, NUMBER, quick_columns
from dragdeck.errors import InputError
from dragdeck.mesh.polygons import (
    Polygons,
    by_size,
    mesh_text,
    numbers,
    one_space,
    pieces,
    refuse_two_marks,
)
from dragdeck.mesh.surface import Floats

_SPACES = r"\s+\S+" * 3
_FACET = re.compile(
    rf"facet(?:\s+normal{_SPACES})?\s+outer\s+loop((?:\s+vertex{_SPACES}){{3,}})"
    r"\s+endloop\s+endfacet",
    re.I,
)
_END = re.compile("endfacet", re.I)
_UTF_16 = b"\xff\xfe", b"\xfe\xff"
_NAMES = "solid", "endsolid", "end solid"
_HEAD, _RECORD = 84, 50

_CORNER = ["vertex", NUMBER, NUMBER, NUMBER]
_LAYOUT = ["facet", "normal", ANY, ANY, ANY, "outer", "loop", *_CORNER * 3, "endloop", "endfacet"]
"""Words of a triangle."""


def stl(content: bytes) -> Polygons:
    """Every solid of an STL file, text or binary; each polygon has nodes of its own.

    Raises
    ------
    InputError
        It is neither, or was cut short.
    """
    count = int.from_bytes(content[80:_HEAD], "little")
    end = _HEAD + _RECORD * count
    if _HEAD <= end <= len(content) and len(content) >= _HEAD and not content.startswith(_UTF_16):
        return _binary(content, end)
    text = mesh_text(content)
    if not text.lstrip()[:5].lower() == "solid" or "\0" in text:
        raise InputError(
            "neither text nor whole binary STL",
            value=f"{len(content)} bytes, {count} facets announced",
            limit=f'a text that begins with "solid", or {end} bytes',
        )
    return _text(text)


def _binary(content: bytes, end: int) -> Polygons:
    if any(content[end : end + _RECORD]) and len(content) >= end + _RECORD:
        raise InputError(
            "more facets than the file announces",
            value=f"{len(content) - end} further bytes after byte {end}",
            limit=f"{end} bytes for {(end - _HEAD) // _RECORD} facets",
        )
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(content[_HEAD:end], dtype=record)["corners"].astype(np.float64)
    return Polygons(corners.reshape(-1, 3), [np.arange(3 * len(corners)).reshape(-1, 3)])


def _text(text: str) -> Polygons:
    points, sizes = [np.empty((0, 3))], list[int]()
    for line, piece in pieces(text, _END, "a facet"):
        triangles = _triangles(piece)
        corners = _corners(piece, line) if triangles is None else [triangles]
        points += corners
        sizes += [3] * (len(triangles) // 3) if triangles is not None else map(len, corners)
    refuse_two_marks(text, r"\bvertex(?:\s+\S+){0,2}\s+")
    joined = np.concatenate(points)
    return Polygons(joined, by_size(np.arange(len(joined)), sizes))


def _triangles(piece: str) -> Floats | None:
    """Corners one after the other, (3 N, 3), if all is written as nearly every program does."""
    lines = one_space(piece.lower().replace("\n", " ")).replace(" facet ", "\nfacet ")
    columns = quick_columns(f"{lines}\n".encode(), _LAYOUT)
    return None if columns is None else np.column_stack(columns).reshape(-1, 3)


def _corners(piece: str, line: int) -> list[Floats]:
    """Corners of each facet, (k, 3)."""
    corners, end = [], 0
    for facet in _FACET.finditer(piece):
        _refuse_between(piece, end, facet.start(), line)
        words = [word for place, word in enumerate(facet[1].split()) if place % 4]
        try:
            corners.append(numbers(words).reshape(-1, 3))
        except InputError as error:
            error.line = line + piece.count("\n", 0, facet.start(1)) + 1
            raise
        end = facet.end()
    _refuse_between(piece, end, len(piece), line)
    return corners


def _refuse_between(piece: str, start: int, stop: int, line: int) -> None:
    """Refuse what is neither a facet nor the name of a solid."""
    for text in piece[start:stop].split("\n"):
        if (words := text.lstrip()) and not words.lower().startswith(_NAMES):
            raise InputError(
                "not a whole facet",
                line=line + piece.count("\n", 0, start),
                value=" ".join(piece[start : start + 500].split())[:60],
                limit="facet normal, outer loop, three corners or more, endloop, endfacet",
            )
        start += len(text) + 1

"""Nodes and facets in the content of STL, OBJ and PLY files.

Only these two are read. Normals, textures, colours, groups and other elements stand beside them in
a user's file and are passed over. What could be read in two ways is refused with its line or byte.
"""

import io
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.mesh.surface import Floats, Integers

_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.I)
_SPACES = r"\s+\S+" * 3
_FACET = re.compile(
    rf"facet\s+normal{_SPACES}\s+outer\s+loop((?:\s+vertex{_SPACES}){{3,}})\s+endloop\s+endfacet",
    re.I,
)
_BETWEEN = re.compile(r"(\s*(end\s?)?solid.*)*\s*", re.I)
_STL_HEAD, _STL_FACET = 84, 50


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


def _numbers(words: Sequence[str], line: int | None = None) -> Floats:
    """Numbers as text, of decimal points or commas, with the exponents of C or Fortran.

    Raises
    ------
    InputError
        One of them is no number, or a comma may stand for thousands.
    """
    wrong = next((word for word in words if not _NUMBER.fullmatch(word)), None)
    if wrong is not None:
        raise InputError("not a number", line=line, value=wrong[:60], limit="such as 1.5 or 2e-3")
    joined = " ".join(words)
    if "," in joined and "." in joined:
        raise InputError(
            "decimal commas beside decimal points",
            line=line,
            value=joined[:60],
            limit="one of both",
        )
    return np.array(
        joined.replace(",", ".").replace("D", "e").replace("d", "e").split(), dtype=float
    )


def _by_size(corners: Sequence[int] | Integers, sizes: Sequence[int] | Integers) -> list[Integers]:
    """Polygons one after the other as an (M, k) array for each number of corners k."""
    nodes, counts = np.asarray(corners, dtype=np.int64), np.asarray(sizes, dtype=np.int64)
    first = np.cumsum(counts) - counts
    return [
        nodes[first[counts == size][:, None] + np.arange(size)]
        for size in np.unique(counts)
        if size
    ]


# --- STL ------------------------------------------------------------------------------------------


def stl(content: bytes) -> Polygons:
    """Every solid of an STL file, text or binary; each polygon has nodes of its own.

    Raises
    ------
    InputError
        It is neither, or was cut short.
    """
    count = int.from_bytes(content[80:_STL_HEAD], "little")
    end = _STL_HEAD + _STL_FACET * count
    whole = len(content) >= _STL_HEAD and end <= len(content)
    if whole and end == len(content):
        return _stl_facets(content, end)
    text = text_of(content)
    if whole and not _FACET.search(text):
        return _stl_facets(content, end)
    if not re.match(r"\s*solid", text, re.I):
        raise InputError(
            "neither text nor whole binary STL",
            value=f"{len(content)} bytes, {count} facets announced",
            limit=f'a text that begins with "solid", or {end} bytes',
        )
    return _stl_text(text)


def _stl_facets(content: bytes, end: int) -> Polygons:
    if any(content[end : end + _STL_FACET]) and len(content) >= end + _STL_FACET:
        raise InputError(
            "more facets than the file announces",
            value=f"{len(content) - end} further bytes after byte {end}",
            limit=f"{end} bytes for {(end - _STL_HEAD) // _STL_FACET} facets",
        )
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(content[_STL_HEAD:end], dtype=record)["corners"].astype(np.float64)
    return Polygons(corners.reshape(-1, 3), [np.arange(3 * len(corners)).reshape(-1, 3)])


def _stl_text(text: str) -> Polygons:
    words, sizes, end = list[str](), list[int](), 0
    for facet in _FACET.finditer(text):
        _refuse_between(text, end, facet.start())
        corners = facet[1].split()
        words += [word for place, word in enumerate(corners) if place % 4]
        sizes.append(len(corners) // 4)
        end = facet.end()
    _refuse_between(text, end, len(text))
    points = _numbers(words).reshape(-1, 3)
    return Polygons(points, _by_size(np.arange(len(points)), sizes))


def _refuse_between(text: str, start: int, stop: int) -> None:
    """Refuse what is neither a facet nor the name of a solid."""
    between = text[start:stop]
    name = _BETWEEN.match(between)
    rest = between[name.end() if name else 0 :]
    if rest:
        raise InputError(
            "not a whole facet",
            line=text.count("\n", 0, stop - len(rest)) + 1,
            value=" ".join(rest.split())[:60],
            limit="facet normal, outer loop, three corners or more, endloop, endfacet",
        )


# --- OBJ ------------------------------------------------------------------------------------------


def obj(content: bytes) -> Polygons:
    """The polygons of an OBJ file, of all its groups.

    Raises
    ------
    InputError
        A line is damaged, or names a node that is not there.
    """
    coordinates, corners, sizes, lines = list[Floats](), list[int](), list[int](), list[int]()
    for line, (key, *words) in _obj_lines(text_of(content)):
        if key == "v":
            _refuse_fewer(words, 3, "coordinates of a node", line)
            coordinates.append(_numbers(words[:3], line))
        elif key in ("f", "fo"):
            _refuse_fewer(words, 3, "corners of a facet", line)
            corners += [_node(word, len(coordinates), line) for word in words]
            sizes.append(len(words))
            lines.append(line)
    if corners and max(corners) >= len(coordinates):
        line = lines[int(np.searchsorted(np.cumsum(sizes), np.argmax(corners), side="right"))]
        raise _no_such_node(max(corners) + 1, _numbered(len(coordinates)), line)
    return Polygons(np.array(coordinates).reshape(-1, 3), _by_size(corners, sizes))


def _obj_lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Lines with their numbers, without comments, those that go on joined."""
    begun = ""
    for number, line in enumerate(text.split("\n"), 1):
        line = begun + line.partition("#")[0].rstrip()
        begun = line[:-1] + " " if line.endswith("\\") else ""
        if not begun and (words := line.split()):
            yield number, words


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
        raise _no_such_node(number, _numbered(before), line)
    return number - 1 if number > 0 else before + number


def _numbered(nodes: int) -> range:
    return range(1, nodes + 1)


def _no_such_node(number: int, nodes: range, line: int | None = None) -> InputError:
    return InputError(
        "a facet names a node that is not there",
        line=line,
        value=number,
        limit=f"{nodes.start} to {nodes.stop - 1}",
    )


# --- PLY ------------------------------------------------------------------------------------------


def ply(content: bytes) -> Polygons:
    """The faces of a PLY file: text, or binary of either byte order.

    Raises
    ------
    InputError
        It was cut short, or has no nodes with x, y and z.
    """
    from plyfile import PlyData, PlyParseError

    head = re.search(rb"\bend_header[ \t]*(\r\n|\r|\n)", content)
    if not content.startswith(b"ply") or head is None:
        raise InputError("not a PLY file", limit='"ply" at its start, and a line "end_header"')
    counts = re.findall(rb"^element\s+\S+\s+(\d+)", content[: head.start()], re.M)
    if sum(map(int, counts)) > len(content):
        raise InputError(
            "the file was cut short",
            value=f"{len(content)} bytes, {sum(map(int, counts))} elements",
        )
    stream = io.BytesIO(content)
    try:
        read = PlyData.read(stream)
    except (PlyParseError, ValueError, MemoryError) as error:
        raise InputError("the file is damaged", value=str(error)) from error
    elements: dict[str, Any] = {element.name: element.data for element in read}
    if read.text:  # a line for each element
        lines = sum(1 for line in content[head.end() :].splitlines() if line.strip())
        rest, unit = lines - sum(map(len, elements.values())), "lines"
    else:
        rest, unit = len(stream.read()), "bytes"
    if rest > 0:
        raise InputError("more than the header announces", value=f"{rest} {unit}")
    if "tristrips" in elements:
        raise InputError("strips of triangles are not read", remedy="export single triangles")
    nodes, faces = elements.get("vertex"), elements.get("face")
    if nodes is None or not {"x", "y", "z"} <= {*nodes.dtype.names}:
        raise InputError(
            "no nodes", value=", ".join(elements), limit='an element "vertex" with x, y and z'
        )
    points = np.column_stack([nodes[axis] for axis in "xyz"]).astype(np.float64)
    polygons = [
        np.asarray(polygon, dtype=np.int64)
        for name in ("vertex_indices", "vertex_index")
        if faces is not None and name in faces.dtype.names
        for polygon in faces[name]
    ]
    corners = np.concatenate([np.empty(0, dtype=np.int64), *polygons])
    wrong = corners[(corners < 0) | (corners >= len(points))]
    if len(wrong):
        raise _no_such_node(int(wrong[0]), range(len(points)))
    return Polygons(points, _by_size(corners, [*map(len, polygons)]))

"""Faces in PLY files: text, or binary of either byte order."""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from typing import Any, NamedTuple, Protocol

import numpy as np

from dragdeck.arrays import NUMBER, quick_columns
from dragdeck.errors import InputError
from dragdeck.files import text_of
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

_HEAD = re.compile(rb"\bend_header[ \t]*(\r\n|\r|\n)")
_LINE = re.compile("\n")
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_KINDS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_FEW = 64
"""Rows that are read one by one, and that are tried first."""

_INDICES = "vertex_indices", "vertex_index"


class _Property(NamedTuple):
    """A property: types of numpy, of its values and, for a list, of their number."""

    name: str
    kind: str
    length: str = ""


class _Element(NamedTuple):
    """An element of the header."""

    name: str
    rows: int
    properties: list[_Property]

    def wrong_row(self, value: object, **place: Any) -> InputError:
        """A row that is not what the header announces."""
        names = (f"list {each.name}" if each.length else each.name for each in self.properties)
        return InputError(
            f"not a row of the element {self.name!a}", value=value, limit=" ".join(names), **place
        )


_Values = Mapping[str, Any]
"""By the names of properties: numbers, (M,), or the lists of M rows, (M, k)."""


def ply(content: bytes) -> Polygons:
    """The faces of a PLY file.

    Raises
    ------
    InputError
        It was cut short, or has no nodes with x, y and z or no faces.
    """
    if not content.startswith(b"ply"):
        content = text_of(content).encode()
    head = _HEAD.search(content)
    if not content.startswith(b"ply") or head is None:
        raise InputError("not a PLY file", limit='"ply" at its start, and a line "end_header"')
    order, elements = _header(text_of(content[: head.start()]))
    announced = sum(element.rows for element in elements)
    if announced > len(content):
        value = f"{len(content)} bytes, {announced} elements"
        raise InputError("the file was cut short", value=value)
    body = content[head.end() :]
    rows: _Rows = _Bytes(body, order, head.end()) if order else _Lines(body, head)
    parts = {element.name: [*_values(rows, element)] for element in elements}
    if (rest := rows.rest()) > 0:
        raise InputError("more than the header announces", value=f"{rest} {rows.unit}")
    if parts.get("tristrips"):
        raise InputError("strips of triangles are not read", remedy="export single triangles")
    return _polygons(parts, {element.name: element for element in elements})


def _header(text: str) -> tuple[str, list[_Element]]:
    """Byte order, empty for text, and the elements."""
    order, elements = None, list[_Element]()
    for number, line in enumerate(text.split("\n")[1:], 2):
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", "ascii", _]:
                order = ""
            case ["format", name, _] if name in _ORDERS:
                order = _ORDERS[name]
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count):
                elements.append(_Element(name, int(count), []))
            case ["property", kind, name] if kind in _KINDS and elements:
                elements[-1].properties.append(_Property(name, _KINDS[kind]))
            case ["property", "list", count, kind, name] if (
                _KINDS.get(count, "f")[0] != "f" and kind in _KINDS and elements
            ):
                elements[-1].properties.append(_Property(name, _KINDS[kind], _KINDS[count]))
            case _:
                raise InputError("not a line of a PLY header", line=number, value=line[:60])
    named = [[element.name for element in elements]]
    named += [[each.name for each in element.properties] for element in elements]
    twice = next((name for names in named for name in names if names.count(name) > 1), None)
    if order is None or twice is not None:
        problem = "the header has no format" if twice is None else "the header has a name twice"
        raise InputError(problem, value=twice, limit='a line such as "format ascii 1.0"; '
                         "each element and each of its properties once")  # fmt: skip
    return order, elements


def _polygons(parts: Mapping[str, list[_Values]], elements: Mapping[str, _Element]) -> Polygons:
    nodes, faces = elements.get("vertex"), elements.get("face")
    plain = {each.name for each in nodes.properties if not each.length} if nodes else set()
    if not {"x", "y", "z"} <= plain:
        limit = 'an element "vertex" with x, y and z'
        raise InputError("no nodes", value=", ".join(elements), limit=limit)
    lists = [each.name for each in faces.properties if each.length] if faces else []
    named = [name for name in _INDICES if name in lists]
    if len(named) != 1:
        limit = f'an element "face" with one list {" or ".join(_INDICES)}'
        raise InputError("no faces, or two lists of their nodes", value=", ".join(lists),
                         limit=limit)  # fmt: skip
    columns = [
        np.concatenate([np.empty(0), *(part[axis] for part in parts["vertex"])]) for axis in "xyz"
    ]
    points = np.column_stack(columns).astype(np.float64)
    corners, sizes = [np.empty(0, int)], [np.empty(0, int)]
    for part in parts["face"]:
        values = part[named[0]]
        nodes_of = values.astype(np.int64)
        wrong = values[(nodes_of != values) | (nodes_of < 0) | (nodes_of >= len(points))]
        if wrong.size:
            raise no_such_node(wrong[0].item(), range(len(points)))
        corners.append(nodes_of.ravel())
        sizes.append(np.full(len(values), values.shape[1]))
    return Polygons(points, by_size(np.concatenate(corners), np.concatenate(sizes)))


class _Rows(Protocol):
    """The rows of a file, one element after the other."""

    unit: str

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """How many of the next rows are alike, at most so many, and their values."""
        ...

    def rest(self) -> int:
        """How much is left."""
        ...


def _values(rows: _Rows, element: _Element) -> Iterator[_Values]:
    """The values of an element, in parts in which all lists are as long as in the first row."""
    left = element.rows if element.properties else 0
    while left:
        count, values = rows.take(element, left)
        left -= count
        yield values


class _Bytes:
    """The rows of a binary file."""

    unit = "bytes"

    def __init__(self, body: bytes, order: str, before: int) -> None:
        self._body, self._order, self._place, self._before = body, order, 0, before
        self._likely = _FEW

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """As in `_Rows`."""
        kind = self._kind(element)
        room = (len(self._body) - self._place) // max(kind.itemsize, 1)
        if room == 0:
            raise self._short(element)
        rows = np.frombuffer(self._body, kind, min(most, room, self._likely), self._place)
        alike = np.ones(len(rows), dtype=bool)
        for place, each in enumerate(element.properties):
            if each.length:
                alike &= rows[f"{place} count"] == rows[f"{place} count"][0]
        count, self._likely = _alike(alike, self._likely)
        self._place += count * kind.itemsize
        return count, {
            each.name: rows[str(place)][:count] for place, each in enumerate(element.properties)
        }

    def _kind(self, element: _Element) -> np.dtype[Any]:
        """The row that stands here."""
        fields: list[Any] = []
        end = self._place
        for place, each in enumerate(element.properties):
            length: tuple[int, ...] = ()
            if each.length:
                count = np.dtype(self._order + each.length)
                if end + count.itemsize > len(self._body):
                    raise self._short(element)
                length = (int(np.frombuffer(self._body, count, 1, end)[0]),)
                fields.append((f"{place} count", count))
                end += count.itemsize
            kind = np.dtype(self._order + each.kind)
            end += kind.itemsize * (length[0] if length else 1)
            if (length and length[0] < 0) or end > len(self._body):
                raise self._short(element)
            fields.append((str(place), kind, length))
        return np.dtype(fields)

    def _short(self, element: _Element) -> InputError:
        byte, size = self._before + self._place, self._before + len(self._body)
        return element.wrong_row(f"that which begins at byte {byte} of {size}")

    def rest(self) -> int:
        """As in `_Rows`."""
        return len(self._body) - self._place


class _Lines:
    """The rows of a text; blank lines between them are passed over."""

    unit = "lines"

    def __init__(self, body: bytes, head: re.Match[bytes]) -> None:
        rows = mesh_text(body)
        refuse_two_marks(rows, "^.*")
        self._pieces = pieces(rows, _LINE, "a line")
        self._before = text_of(head.string[: head.end()]).count("\n")
        self._text, self._line, self._likely = "", 0, _FEW

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """As in `_Rows`."""
        self._fill()
        first, words = self._text.partition("\n")[0], self._text.partition("\n")[0].split(" ")
        lengths = _lengths(element, words)
        if lengths is None:
            value, line = (first[:60], self._line) if first else ("the end of the file", None)
            raise element.wrong_row(value, line=line)
        rows = _cut(self._text, min(most, self._likely))[0]
        columns = quick_columns(f"{rows}\n".encode(), [NUMBER] * len(words))
        if columns is None:
            self._likely = _FEW
            lines = _cut(rows, _FEW)[0].split("\n")
            alike_lines = takewhile(lambda line: line.count(" ") == len(words) - 1, lines)
            numbered = enumerate(alike_lines, self._line)
            columns = [*np.array([numbers(line.split(" "), number) for number, line in numbered]).T]
        alike = np.ones(len(columns[0]), dtype=bool)
        values, place = dict[str, Any](), 0
        for each, length in zip(element.properties, lengths, strict=True):
            if each.length:
                alike &= columns[place] == length
                listed = np.array(columns[place + 1 : place + 1 + length]).T
                values[each.name] = listed.reshape(len(alike), length)
            else:
                values[each.name] = columns[place]
            place += 1 + length
        count, self._likely = _alike(alike, self._likely)
        self._text = _cut(self._text, count)[1]
        self._line += count
        return count, {name: column[:count] for name, column in values.items()}

    def _fill(self) -> None:
        """Go on to the next line that is not blank."""
        while not (text := self._text.lstrip("\n")):
            line, piece = next(self._pieces, (0, ""))
            if not piece:
                break
            self._text, self._line = one_space(piece), self._before + line
        self._line += len(self._text) - len(text)
        self._text = text

    def rest(self) -> int:
        """As in `_Rows`."""
        rest = 0
        while True:
            self._fill()
            if not self._text:
                return rest
            rest += self._text.count("\n") + (not self._text.endswith("\n"))
            self._text = ""


def _cut(text: str, lines: int) -> tuple[str, str]:
    """So many lines, without the end of the last, and the rest."""
    if text.count("\n") < lines:
        return text, ""
    parts = text.split("\n", lines)
    return "\n".join(parts[:lines]), parts[lines]


def _lengths(element: _Element, words: Sequence[str]) -> list[int] | None:
    """Lengths of the lists in a row of words, 0 of a single value; None if it is no such row."""
    lengths, place = list[int](), 0
    for each in element.properties:
        count = words[place] if each.length and place < len(words) else "0"
        if not re.fullmatch(r"\d{1,9}", count):
            return None
        lengths.append(int(count))
        place += 1 + lengths[-1]
    return lengths if place == len(words) else None


def _alike(alike: Any, likely: int) -> tuple[int, int]:
    """How many rows are like the first, and how many to try next."""
    count = len(alike) if alike.all() else int(np.argmin(alike))
    return count, max(_FEW, 2 * count) if count < len(alike) else 4 * likely

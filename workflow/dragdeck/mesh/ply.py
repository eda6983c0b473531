"""Faces in PLY files: text, or binary of either byte order."""

import re
from collections.abc import Iterator, Mapping
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
from dragdeck.mesh.surface import Floats, Integers

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
        names = (f"list {field.name}" if field.length else field.name for field in self.properties)
        return InputError(
            f"not a row of the element {self.name!a}", value=value, limit=" ".join(names), **place
        )


_Values = Mapping[str, Any]
"""By the names of properties: numbers, (M,), or lists one after the other and their lengths, (M,).
"""


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
    named += [[field.name for field in element.properties] for element in elements]
    twice = next((name for names in named for name in names if names.count(name) > 1), None)
    if order is None or twice is not None:
        problem = "the header has no format" if twice is None else "the header has a name twice"
        raise InputError(problem, value=twice, limit='a line such as "format ascii 1.0"; '
                         "each element and each of its properties once")  # fmt: skip
    return order, elements


def _polygons(parts: Mapping[str, list[_Values]], elements: Mapping[str, _Element]) -> Polygons:
    nodes, faces = elements.get("vertex"), elements.get("face")
    plain = {field.name for field in nodes.properties if not field.length} if nodes else set()
    if not {"x", "y", "z"} <= plain:
        limit = 'an element "vertex" with x, y and z'
        raise InputError("no nodes", value=", ".join(elements), limit=limit)
    lists = [field.name for field in faces.properties if field.length] if faces else []
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
        values, counts = part[named[0]]
        nodes_of = values.astype(np.int64)
        wrong = values[(nodes_of != values) | (nodes_of < 0) | (nodes_of >= len(points))]
        if wrong.size:
            raise no_such_node(wrong[0].item(), range(len(points)))
        corners.append(nodes_of)
        sizes.append(counts)
    return Polygons(points, by_size(np.concatenate(corners), np.concatenate(sizes)))


class _Rows(Protocol):
    """The rows of a file, one element after the other."""

    unit: str

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """The values of some of the next rows, at most so many, and of how many."""
        ...

    def rest(self) -> int:
        """How much is left."""
        ...


def _values(rows: _Rows, element: _Element) -> Iterator[_Values]:
    """The values of an element, in parts."""
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

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """As in `_Rows`: all rows, at once where their lists have one length."""
        kind = self._kind(element)
        if most * kind.itemsize > len(self._body) - self._place:
            return self._walk(element, most)
        rows = np.frombuffer(self._body, kind, most, self._place)
        fields = [(str(place), field) for place, field in enumerate(element.properties)]
        counts = [rows[f"{place} count"] for place, field in fields if field.length]
        if any((count != count[0]).any() for count in counts):
            return self._walk(element, most)
        self._place += rows.nbytes
        return most, {
            field.name: (rows[place].ravel(), np.full(most, rows[place].shape[1]))
            if field.length
            else rows[place]
            for place, field in fields
        }

    def _walk(self, element: _Element, rows: int) -> tuple[int, _Values]:
        """The next rows, whose lists differ in length."""
        byte_order: Any = "big" if self._order == ">" else "little"
        sizes = [
            (
                np.dtype(field.kind).itemsize,
                int(field.length[1:] or 0),
                field.length.startswith("i"),
            )
            for field in element.properties
        ]
        begins, counts, body, place = list[int](), list[int](), self._body, self._place
        for _ in range(rows):
            for size, width, signed in sizes:
                count = 1
                if width:
                    count = int.from_bytes(body[place : place + width], byte_order, signed=signed)
                    place += width
                begins.append(place)
                counts.append(count)
                place += size * count
            if place > len(body) or min(counts[-len(sizes) :]) < 0:
                raise self._short(element)
            self._place = place
        values = dict[str, Any]()
        for number, (field, (size, *_)) in enumerate(zip(element.properties, sizes, strict=True)):
            first, length = (np.array(part[number :: len(sizes)]) for part in (begins, counts))
            starts = np.repeat(first - size * (np.cumsum(length) - length), length)
            items = (starts + size * np.arange(len(starts)))[:, None] + np.arange(size)
            numbers_of = np.frombuffer(body, np.uint8)[items].view(self._order + field.kind).ravel()
            values[field.name] = (numbers_of, length) if field.length else numbers_of
        return rows, values

    def _kind(self, element: _Element) -> np.dtype[Any]:
        """The row that stands here."""
        fields: list[Any] = []
        end = self._place
        for place, field in enumerate(element.properties):
            length: tuple[int, ...] = ()
            if field.length:
                count = np.dtype(self._order + field.length)
                if end + count.itemsize > len(self._body):
                    raise self._short(element)
                length = (int(np.frombuffer(self._body, count, 1, end)[0]),)
                fields.append((f"{place} count", count))
                end += count.itemsize
            kind = np.dtype(self._order + field.kind)
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
        self._before = text_of(head.string[: head.end()]).count("\n")
        refuse_two_marks(rows, r"^(?:.*\s)?", self._before)
        self._pieces = pieces(rows, _LINE, "a line")
        self._words, self._starts, self._lines = np.empty(0), np.zeros(1, int), np.empty(0, int)
        self._text, self._first = "", 0
        self._damage: InputError | None = None

    def take(self, element: _Element, most: int) -> tuple[int, _Values]:
        """As in `_Rows`."""
        if not self._fill():
            raise self._damage or element.wrong_row("the end of the file")
        place, ends = self._starts[:-1][:most].copy(), self._starts[1:][:most]
        good, values = np.ones(len(place), dtype=bool), dict[str, Any]()
        for field in element.properties:
            good &= place < ends
            values[field.name] = self._words[np.where(good, place, 0)]
            place += 1
            if field.length:
                numbers_of = values[field.name]
                good &= (numbers_of >= 0) & (numbers_of <= ends - place) & (numbers_of % 1 == 0)
                counts = np.where(good, numbers_of, 0).astype(np.int64)
                first = np.repeat(place - np.cumsum(counts) + counts, counts)
                values[field.name] = self._words[first + np.arange(len(first))], counts
                place += counts
        good &= place == ends
        if not good.all():
            line = int(self._lines[np.argmin(good)])
            row = self._text.split("\n")[line - self._first]
            raise element.wrong_row(row[:60], line=line)
        self._starts, self._lines = self._starts[len(place) :], self._lines[len(place) :]
        return len(place), values

    def _fill(self) -> bool:
        """Whether there is a further row; those of the next piece are read if need be."""
        while not len(self._lines):
            line, piece = (0, "") if self._damage else next(self._pieces, (0, ""))
            if not piece:
                return False
            self._text, self._first = one_space(piece.removesuffix("\n")), self._before + line
            self._words, counts, self._lines = _quick_words(self._text) or self._slow_words()
            self._starts = np.concatenate([[0], np.cumsum(counts)])
            self._lines = self._lines + self._first
        return True

    def _slow_words(self) -> tuple[Floats, Integers, Integers]:
        """As `_quick_words`, of the lines before the first that is no row of numbers."""
        words, counts, lines = [np.empty(0)], list[int](), list[int]()
        for line, row in enumerate(self._text.split("\n")):
            try:
                words += [numbers(row.split(" "), self._first + line)] if row else []
            except InputError as error:
                self._damage = error
                break
            counts += [len(words[-1])] if row else []
            lines += [line] if row else []
        return np.concatenate(words), np.array(counts, int), np.array(lines, int)

    def rest(self) -> int:
        """As in `_Rows`."""
        rest = 0
        while self._fill():
            rest, self._lines = rest + len(self._lines), self._lines[:0]
        return rest + (self._damage is not None)


def _quick_words(text: str) -> tuple[Floats, Integers, Integers] | None:
    """Numbers in lines of words, how many are in each line, and which lines these are, from 0."""
    content = text.encode()
    width = content.partition(b"\n")[0].count(b" ") + 1
    alike = quick_columns(content + b"\n", [NUMBER] * width)
    if alike is not None:
        return (
            np.column_stack(alike).ravel(),
            np.full(len(alike[0]), width),
            np.arange(len(alike[0])),
        )
    columns = quick_columns(content.replace(b" ", b"\n") + b"\n", [NUMBER])
    if columns is None:
        return None
    marks = np.frombuffer(content, np.uint8)
    marks = marks[(marks == ord(" ")) | (marks == ord("\n"))]
    ends = np.flatnonzero(np.append(marks == ord("\n"), [True])) + 1
    return columns[0], np.diff(ends, prepend=0), np.arange(len(ends))

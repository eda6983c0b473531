"""Polygons in legacy VTK files: polygon data, or an unstructured grid of polygons."""

import re

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError
from dragdeck.mesh.polygons import Polygons, by_size, no_polygons, no_such_node
from dragdeck.mesh.surface import Integers

_HEAD = re.compile(
    rb"# vtk DataFile Version [^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET[ \t]+(\w+)", re.I
)
_PART = re.compile(
    rb"^[ \t]*(POINTS|POLYGONS|TRIANGLE_STRIPS|CELLS|CELL_TYPES)[ \t]+(\d{1,18})(?:[ \t]+(\w+))?"
    rb"[ \t]*\r?\n(?:[ \t]*OFFSETS[ \t]+(\w+)[ \t]*\r?\n)?",
    re.M,
)
_WORD = re.compile(rb"\n[ \t]*[A-Z][A-Z_]{2,}")
"""What ends numbers of a text."""

_CONNECTIVITY = re.compile(rb"^[ \t]*CONNECTIVITY[ \t]+(\w+)[ \t]*\r?\n", re.M)
_KINDS = {b"float": ">f4", b"double": ">f8", b"int": ">i4", b"long": ">i8", b"vtktypeint64": ">i8"}
_DATASETS = {b"polydata": "POLYGONS", b"unstructured_grid": "CELLS"}
_FACES, _PASSED_OVER = (5, 7, 9), (1, 2, 3, 4)
"""Types of cells: triangles, polygons and quadrilaterals; vertices and lines."""


def vtk_legacy(content: bytes) -> Polygons:
    """The polygons of a legacy VTK file, ASCII or binary.

    Raises
    ------
    InputError
        It was cut short, or is no surface.
    """
    head = _HEAD.match(content)
    name = _DATASETS.get(head[2].lower()) if head else None
    if head is None or name is None:
        limit = "# vtk DataFile, with DATASET POLYDATA or UNSTRUCTURED_GRID"
        value = head[2].decode("ascii", "replace") if head else ascii(content[:40])
        raise InputError("not a VTK file of a surface", value=value, limit=limit)
    file = _File(content, head.end(), text=head[1].upper() == b"ASCII")
    if "TRIANGLE_STRIPS" in file.parts:
        raise InputError("strips of triangles are not read", remedy="export single triangles")
    points = file.numbers("POINTS", 3).reshape(-1, 3).astype(np.float64)
    corners, sizes = file.cells(name)
    if name == "CELLS":
        types = file.numbers("CELL_TYPES", 1, b"int")
        if len(types) != len(sizes):
            limit = f"{len(sizes)}, as CELLS"
            raise InputError("CELL_TYPES are not as many", value=f"{len(types)}", limit=limit)
        others = types[~np.isin(types, [*_FACES, *_PASSED_OVER])]
        if len(others):
            raise no_polygons(len(others), others[0])
        kept = np.isin(types, _FACES)
        corners, sizes = corners[np.repeat(kept, sizes)], sizes[kept]
    wrong = corners[(corners < 0) | (corners >= len(points))]
    if len(wrong):
        raise no_such_node(int(wrong[0]), range(len(points)))
    return Polygons(points, by_size(corners, sizes))


class _File:
    """The content of a file, with the first line of each of its parts."""

    def __init__(self, content: bytes, begin: int, *, text: bool) -> None:
        self._content, self._text = content, text
        self.parts = dict[str, re.Match[bytes]]()
        for part in _PART.finditer(content, begin):
            name = part[1].decode()
            if name in self.parts:
                raise InputError("a part of the file stands there twice", value=name)
            self.parts[name] = part

    def numbers(self, name: str, width: int, kind: bytes = b"") -> NDArray[np.generic]:
        """The numbers of a part: points, or types of cells."""
        part = self._part(name)
        return self._at(part.end(), width * int(part[2]), kind or part[3], name)

    def cells(self, name: str) -> tuple[Integers, Integers]:
        """Corners of all cells one after the other, and how many each has."""
        part = self._part(name)
        count, size = int(part[2]), int(part[3] or 0)
        if part[4]:
            ends = self._at(part.end(), count, part[4], "OFFSETS").astype(np.int64)
            begin = _CONNECTIVITY.search(self._content, part.end())
            if begin is None:
                raise InputError("the file was cut short", limit="a line CONNECTIVITY")
            corners = self._at(begin.end(), size, begin[1], "CONNECTIVITY").astype(np.int64)
            sizes = np.diff(ends)
            if not len(ends) or ends[0] != 0 or (sizes < 0).any() or ends[-1] != size:
                raise InputError("OFFSETS do not divide CONNECTIVITY", value=f"{size} corners")
            return corners, sizes
        flat = self._at(part.end(), size, b"int", name).astype(np.int64)
        counts, place = list[int](), 0
        while place < size and flat[place] >= 0:
            counts.append(int(flat[place]))
            place += counts[-1] + 1
        if place != size or len(counts) != count:
            raise InputError(f"{name} are not {count} cells of {size} numbers in all")
        sizes = np.array(counts, dtype=np.int64)
        return np.delete(flat, np.cumsum(sizes + 1) - sizes - 1), sizes

    def _part(self, name: str) -> re.Match[bytes]:
        if name not in self.parts:
            raise InputError(f"the file has no {name}", value=", ".join(self.parts))
        return self.parts[name]

    def _at(self, place: int, count: int, kind: bytes | None, what: str) -> NDArray[np.generic]:
        """So many numbers from a place on."""
        if (kind or b"").lower() not in _KINDS:
            raise InputError(f"unknown type of {what}", value=str(kind), limit="float or double")
        dtype = np.dtype(_KINDS[(kind or b"").lower()])
        values = np.empty(0)
        if not self._text and dtype.itemsize * count <= len(self._content) - place:
            return np.frombuffer(self._content, dtype, count, place)
        if self._text:
            end = _WORD.search(self._content, place)
            text = self._content[place : end.start() if end else None]
            try:
                values = np.fromstring(text, dtype.newbyteorder("="), sep=" ")
            except ValueError:
                raise InputError(f"not numbers of {what}", value=f"from byte {place} on") from None
        if len(values) != count:
            value = f"{len(values)} in {len(self._content) - place} bytes from byte {place} on"
            limit = f"{count} numbers of {dtype.itemsize} bytes"
            raise InputError(f"not as many {what} as announced", value=value, limit=limit)
        return values

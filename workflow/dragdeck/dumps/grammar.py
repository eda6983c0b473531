"""The grammar of what LIGGGHTS writes: frames of dumps, rows of ``fix print``, and their index."""

import re
import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from warnings import warn

import numpy as np

from dragdeck.dumps.content import Cursor
from dragdeck.dumps.frame import Columns, Layout
from dragdeck.dumps.numbers import (
    COLUMNS_OF_WORDS,
    Cells,
    WrongRow,
    cells_of_text,
    columns_of_numbers,
    columns_of_words,
    first_rows,
    named_columns,
    refuse_unlike,
)
from dragdeck.errors import DumpError

_STEP, _HEAD = struct.Struct("<q"), struct.Struct("<qi6i")
"""Of a binary frame: step; number of rows, whether the box is triclinic, its boundaries."""

_BOX_BYTES, _TILT_BYTES = 48, 24
_TAIL = struct.Struct("<ii")
"""Number of columns and of ranks, after the box."""

_COUNT = struct.Struct("<i")
_MAX_RANKS = 1_000_000
"""A binary frame that claims to come from more ranks is none."""

_LONGEST_MAGIC, _LARGEST_POSITIVE = 64, 0x7F
"""Length of a name at the begin of a frame; last byte of a number that is not negative."""

_LARGEST_STEP = 2.0**53
_ROW_BEGINS = [bytes([byte]) for byte in b"0123456789+-. "]
_BLOCK_ROWS = 20_000
"""Rows of a ``fix print`` file that are read at once."""


def frame_steps(at: Cursor) -> Iterator[int]:
    """Step of each frame of a dump: looks at their structure, not at their numbers."""
    for _ in at.frames():
        if at.layout.binary:
            step, rows, ranks = _binary_head(at)
            for count in _counts(at, rows, ranks):
                at.skip(8 * count, f"{count} numbers of a rank")
        else:
            step, rows, _ = _text_head(at)
            _check_last_row(at, rows, *deque(_row_lines(at, rows), maxlen=1))
        yield step


def frame_cells(at: Cursor) -> tuple[int, Cells]:
    """Step and numbers of the frame that begins at a place, its columns in the layout's order.

    Raises
    ------
    WrongRow
        At the first row of a text that is not so many numbers.
    DumpError
        The frame is not whole, or not one of this output.
    """
    if not at.layout.binary:
        step, text, names = _text_frame(at)
        return step, _ordered(at, cells_of_text(text, at.width), names)
    step, rows, ranks = _binary_head(at)
    counts = _counts(at, rows, ranks)
    data = b"".join(at.take(8 * count, f"{count} numbers of a rank") for count in counts)
    return step, np.frombuffer(data, "<f8").reshape(-1, at.width).T.astype(np.float64, "C")


def frame_columns(at: Cursor) -> tuple[int, Columns]:
    """Step and columns of the frame that begins at a place.

    Raises
    ------
    WrongRow
        At the first row that is not so many numbers, or not finite ones; of a foreign dump, not
        so many words.
    DumpError
        The frame is not whole, or not one of this output.
    """
    layout = at.layout
    if not layout.foreign:
        step, cells = frame_cells(at)
        return step, named_columns(cells, layout.columns)
    if layout.binary:
        step, cells = frame_cells(at)
        return step, columns_of_numbers(cells, layout.columns)
    step, text, names = _text_frame(at)
    if any(name in COLUMNS_OF_WORDS for name in names):
        return step, columns_of_words(text, names)
    cells = cells_of_text(text, at.width)
    return step, columns_of_numbers(_ordered(at, cells, names), layout.columns)


def _text_frame(at: Cursor) -> tuple[int, bytes, list[str]]:
    """Step and rows of a text frame, and the names of its columns in their order."""
    step, rows, names = _text_head(at)
    return step, b"".join(_row_lines(at, rows)), names


def _ordered(at: Cursor, cells: Cells, names: list[str]) -> Cells:
    for place, name in enumerate(names):
        if (first := names.index(name)) < place:
            refuse_unlike(name, cells[first], cells[place])
    return cells[[names.index(name) for name in at.layout.header]]


def binary_names(file: Path, layout: Layout) -> list[str]:
    """Names of the columns of a binary dump; none where it does not have them.

    LAMMPS of 2020 and later writes them in each frame, after a negative length and ``DUMPCUSTOM``.
    """
    names: list[str] = []
    with Cursor(file, layout) as at:
        if at.take(_STEP.size, "a binary frame's header")[-1] <= _LARGEST_POSITIVE:
            return names
    with Cursor(file, layout) as at:
        _binary_head(at, names)
    return names


def _binary_head(at: Cursor, names: list[str] | None = None) -> tuple[int, int, int]:
    """Step, number of rows and number of ranks of a binary frame; its names into a list."""
    foreign = f"the header of a binary dump with {at.width} columns"
    (step,) = _STEP.unpack(at.take(_STEP.size, "a binary frame's header"))
    revised = step < 0
    if revised:
        _magic(at, -step, foreign)
        (step,) = _STEP.unpack(at.take(_STEP.size, "a binary frame's header"))
    rows, triclinic, *_ = _HEAD.unpack(at.take(_HEAD.size, "a binary frame's header"))
    if step < 0 or rows < 0 or triclinic not in (0, 1):
        at.fail("this is not the header of a binary dump", foreign)
    at.take(_BOX_BYTES + triclinic * _TILT_BYTES, "the box of a binary frame")
    if revised:
        width, read = _revised_tail(at)
        if names is not None:
            names += read
            at.width = width
        elif read != list(at.layout.header):
            at.fail(f"the columns are {' '.join(read)}", " ".join(at.layout.header))
        (ranks,) = _COUNT.unpack(at.take(_COUNT.size, "the number of ranks"))
    else:
        width, ranks = _TAIL.unpack(at.take(_TAIL.size, "a binary frame's header"))
    if width != at.width:
        at.fail(f"the rows have {width} columns", foreign)
    if not 1 <= ranks <= _MAX_RANKS:
        at.fail(f"the frame claims to come from {ranks} ranks", foreign)
    if rows * width * 8 > at.left:
        at.cut_short(f"{rows} rows of {width} numbers")
    return step, rows, ranks


def _magic(at: Cursor, length: int, foreign: str) -> None:
    """Pass over what LAMMPS writes before a frame that has names, or fail."""
    if length > _LONGEST_MAGIC or not at.take(length, "a name").startswith(b"DUMP"):
        at.fail("this is not the header of a binary dump", foreign)
    order, revision = struct.unpack("<ii", at.take(8, "byte order and revision"))
    if order != 1 or revision != 2:
        at.fail(f"byte order {order:#x}, revision {revision}", "byte order 0x1 and revision 2")


def _revised_tail(at: Cursor) -> tuple[int, list[str]]:
    """Number of columns, and their names."""
    (width,) = _COUNT.unpack(at.take(_COUNT.size, "the number of columns"))
    _string(at)
    if at.take(1, "whether a time follows") != b"\0":
        at.take(8, "a time")
    return width, _string(at).split()


def _string(at: Cursor) -> str:
    (length,) = _COUNT.unpack(at.take(_COUNT.size, "the length of a text"))
    if not 0 <= length <= at.left:
        at.cut_short(f"a text of {length} bytes")
    return at.take(length, "a text").decode("ascii", "replace")


def _counts(at: Cursor, rows: int, ranks: int) -> Iterator[int]:
    """How many numbers follow from each rank."""
    written = 0
    for _ in range(ranks):
        (count,) = _COUNT.unpack(at.take(_COUNT.size, "the count of numbers of a rank"))
        if count < 0 or count % at.width:
            at.fail(f"a rank wrote {count} numbers", f"a multiple of {at.width} columns")
        written += count // at.width
        yield count
    if written != rows:
        at.fail(f"the ranks wrote {written} rows", f"{rows} rows, as the header says")


def _text_head(at: Cursor) -> tuple[int, int, list[str]]:
    """Step and number of rows of a text frame, and the names of its columns in their order."""
    at.item("TIMESTEP", "UNITS", "TIME")
    step = at.whole_number("a step")
    at.item("NUMBER OF")
    rows = at.whole_number("a number of rows")
    at.item("BOX BOUNDS")
    for _ in range(3):
        at.line("the bounds of the box")
    names = at.item("ENTRIES" if at.layout.kind == "local" else "ATOMS").split()[2:]
    header = at.layout.header
    if set(names) != set(header) or (len(names) != len(header) and not at.layout.foreign):
        at.fail(
            f"the header names the columns {' '.join(names)}", f"{' '.join(header)} in any order"
        )
    at.width = len(names)
    return step, rows, names


def _row_lines(at: Cursor, rows: int) -> Iterator[bytes]:
    """The lines of a text frame, in pieces."""
    done, whole = 0, True
    for piece in at.lines(rows):
        if b"ITEM: " in piece:
            lines = piece.split(b"\n")
            row = next((n for n, line in enumerate(lines) if line.startswith(b"ITEM: ")), None)
            if row is not None:
                shown = lines[row][:119] + b"\n"
                at.fail(f"row {done + row}: found {shown!r}", f"{at.width} numbers")
        if (
            at.layout.foreign
            and not at.left
            and len(piece.rpartition(b"\n")[2].split()) == at.width
        ):
            warn(
                f"{at.file}: the last row has no line end; its last number may have been cut",
                stacklevel=2,
            )
            piece += b"\n"
        done, whole = done + piece.count(b"\n"), piece.endswith(b"\n")
        yield piece
    if done < rows or not whole:
        at.cut_short(f"{rows} whole rows of {at.width} numbers")
    after = at.next_bytes()[:40]
    if after[:1] in _ROW_BEGINS:
        at.fail(f"{rows} rows are not all: {after!r} follows", f"{rows} rows, as its header says")


def _check_last_row(at: Cursor, rows: int, piece: bytes = b"") -> None:
    """Fail if the last row of a frame is not of so many words, as where a disk was full."""
    last = piece[piece.rfind(b"\n", 0, -1) + 1 :]
    if rows and len(last.split()) != at.width:
        at.fail(f"row {rows - 1}: found {last[:120]!r}", f"{at.width} numbers")


@dataclass(frozen=True)
class PrintRows:
    """Rows of a ``fix print`` file that follow each other without a header.

    Attributes
    ----------
    text : bytes
    cells : (M, N) ndarray
        Numbers of each column.
    begin : int
        Where in the file they begin.
    """

    text: bytes
    cells: Cells
    begin: int

    def ends(self) -> list[tuple[int | None, int]]:
        """Step of each row and where in the file it ends; None for what comes before them."""
        places = self.begin + 1 + np.flatnonzero(np.frombuffer(self.text, np.uint8) == ord("\n"))
        steps = self.cells[0].astype(np.int64).tolist()
        return [(None, self.begin), *zip(steps, places.tolist(), strict=True)]


def print_rows(at: Cursor, most: int = _BLOCK_ROWS) -> Iterator[PrintRows]:
    """Rows of a ``fix print`` file, so many at once; all that stand before damage come first.

    The header may come again between the rows, as it does when the engine opens the file once
    more. Of the numbers only the steps are looked at.
    """
    if not at.next_bytes():
        return
    header = list(at.layout.header)
    columns = at.line("a header line").lstrip("# ").split()
    if columns != header:
        at.fail(f"the header is {' '.join(columns)[:200]!r}", f"{' '.join(header)!r}")
    at.offset = at.place
    yield PrintRows(b"", np.empty((at.width, 0)), at.offset)
    names = rb"[ \t]+".join(re.escape(name.encode()) for name in header)
    titles = re.compile(rb"^[# ]*" + names + rb"\s*?\n", re.MULTILINE)
    while text := b"".join(at.lines(most)):
        end = text.rfind(b"\n") + 1
        places = [0, *(place for edge in titles.finditer(text) for place in edge.span()), end]
        start = at.offset
        for first, last in zip(places[::2], places[1::2], strict=True):
            at.offset = start + first
            yield from _printed(at, text[first:last])
        at.offset = start + end
        if end < len(text):
            at.cut_short(f"{at.width} numbers and the end of the line")


def _printed(at: Cursor, text: bytes) -> Iterator[PrintRows]:
    """The rows of a text, up to a wrong one."""
    wrong: WrongRow | None = None
    try:
        cells = _with_steps(cells_of_text(text, at.width))
    except WrongRow as error:
        wrong = error
        text = first_rows(text, wrong.row)
        cells = cells_of_text(text, at.width)
    yield PrintRows(text, cells, at.offset)
    at.frame += cells.shape[1]
    at.offset += len(text)
    if wrong is not None:
        at.fail(wrong.problem, wrong.expected)


def _with_steps(cells: Cells) -> Cells:
    steps = cells[0]
    wrong = ~((steps >= 0) & (steps <= _LARGEST_STEP) & (steps == np.floor(steps)))
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise WrongRow(row, f"step is {steps[row]}", "a whole number")
    return cells


@dataclass(frozen=True)
class WholeFrames:
    """The frames of an output file up to the first that is not whole.

    Attributes
    ----------
    ends : tuple of (int or None, int)
        The step of each and where it ends, bytes; None for a line of titles.
    problem : str
        Place and kind of the damage that follows them; empty where nothing does.
    """

    ends: tuple[tuple[int | None, int], ...] = ()
    problem: str = ""

    @property
    def steps(self) -> list[int]:
        """Their steps, in the order of the file."""
        return [step for step, _ in self.ends if step is not None]

    def length_to(self, last: float) -> int:
        """Where the frames up to a step end, bytes."""
        kept = takewhile(lambda end: end[0] is None or end[0] <= last, self.ends)
        return max((end for _, end in kept), default=0)


def whole_frames(file: Path, layout: Layout) -> WholeFrames:
    """Look at every frame of an output file: at its structure, not at its numbers.

    Binary dumps are not read but for their headers, and nothing of the size of a file is held.

    Parameters
    ----------
    file : Path
    layout : Layout
        Its entry in ``columns.json``.
    """
    ends: list[tuple[int | None, int]] = []
    problem = ""
    try:
        with Cursor(file, layout) as at:
            if layout.kind == "print":
                for rows in print_rows(at):
                    ends += rows.ends()
            else:
                ends.extend((step, at.place) for step in frame_steps(at))
    except DumpError as damage:
        thing = "row" if layout.kind == "print" else "frame"
        problem = f"{thing} {damage.frame}, byte {damage.offset}: {damage.problem}"
        problem += f", expected {damage.expected}"
    return WholeFrames(tuple(ends), problem)

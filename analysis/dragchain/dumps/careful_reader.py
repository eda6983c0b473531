"""Single output files, read line by line: slow for dumps, and exact about what is wrong.

`fast_reader` reads the frames that are as LIGGGHTS writes them, `run_parts` merges the parts of
an output.
"""

import io
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, takewhile
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from dragchain.dumps.decompress import Content
from dragchain.dumps.frame import Columns, Frame, Layout, is_integer_column
from dragchain.errors import DumpError, TruncatedDumpError

_BLOCK_ROWS = 20_000
"""Rows of a ``fix print`` file that are read at once."""

_PIECE_BYTES = 1 << 24
_MOST_DIGITS = 18
"""Digits of a count or a step that fits into 64 bits, whatever they are."""

MAX_RANKS = 1_000_000
"""A binary frame that claims to come from more ranks is none."""

_HEAD = struct.Struct("<qqi6i")
_TILT_BYTES = 24
_BOX_BYTES = 48
_TAIL = struct.Struct("<ii")
_COUNT = struct.Struct("<i")
_ROW_BEGINS = [bytes([byte]) for byte in b"0123456789+-. "]


def read_carefully(
    file: Path, output: Layout, *, frame: int = 0, offset: int = 0
) -> Iterator[Frame]:
    """Frames of one file of a ``dump custom`` or ``dump local``.

    Parameters
    ----------
    file : Path
        The file, compressed if its name ends in one of `dragchain.dumps.decompress.CODECS`.
    output : Layout
        What it holds. A text dump may have its columns in any order, as its header says.
    frame, offset : int
        The frame to begin with, and the byte of the content at which it starts.

    Yields
    ------
    Frame
        In the order of the file. Memory is bounded by the largest frame.

    Raises
    ------
    TruncatedDumpError
        If the file ends inside a frame.
    DumpError
        If the file is not such a dump, has other columns, or holds something
        that is not a finite number. The frames before have come by then.
    """
    read_one = _read_binary_frame if output.binary else _read_text_frame
    with Content(file) as content:
        content.skip(offset)
        stream = io.BufferedReader(content)
        while stream.peek(1):
            yield read_one(_Cursor(file, stream, content, output, frame, stream.tell()))
            frame += 1
        if content.damage is not None:
            _Cursor(file, stream, content, output, frame, stream.tell()).cut_short("more frames")


@dataclass
class _Cursor:
    """An open file, and the frame or row in it that is being read."""

    file: Path
    stream: "io.BufferedReader[Any]"
    content: Content
    output: Layout
    frame: int
    offset: int

    def fail(self, problem: str, expected: str) -> NoReturn:
        raise DumpError(
            self.file,
            problem,
            frame=self.frame,
            offset=self.offset,
            expected=expected,
            kept=self.kept(),
            remedy="check that the file is complete and belongs to this run; otherwise "
            "repeat the run",
        )

    def kept(self) -> str | None:
        """Say which frames have been read; the rows of a ``fix print`` file come in blocks."""
        if self.output.kind == "print":
            return None
        return f"the {self.frame} frames before it" if self.frame else "no frame stands before it"

    def fail_row(self, row: int, problem: str, expected: str) -> NoReturn:
        """Fail at a row; in a ``fix print`` file the rows are what is counted."""
        if self.output.kind != "print":
            self.fail(f"row {row}: {problem}", expected)
        with Content(self.file) as content:
            content.skip(self.offset)
            self.offset += sum(len(line) for line in islice(io.BufferedReader(content), row))
        self.frame += row
        self.fail(problem, expected)

    def cut_short(self, expected: str) -> NoReturn:
        thing = "row" if self.output.kind == "print" else "frame"
        size = self.stream.tell() if self.content.size is None else self.content.size
        damage = "" if self.content.damage is None else f" ({self.content.damage})"
        raise TruncatedDumpError(
            self.file,
            f"the file ends after {size} bytes{damage}, inside this {thing};"
            f" the {thing}s before it are intact",
            frame=self.frame,
            offset=self.offset,
            expected=expected,
            kept=self.kept(),
            remedy="resume the run from its last checkpoint, or repeat it",
        )

    def take(self, count: int, what: str) -> bytes:
        """The next bytes; what a damaged file claims to hold is never allocated at once."""
        data = bytearray()
        while piece := self.stream.read(min(count - len(data), _PIECE_BYTES)):
            data += piece
        if len(data) < count:
            self.cut_short(what)
        return bytes(data)

    def line(self, what: str) -> str:
        data = self.stream.readline()
        if not data.endswith(b"\n"):
            self.cut_short(what)
        try:
            return data.decode("ascii").strip()
        except UnicodeDecodeError:
            self.fail(f"found bytes that are not text: {data[:40]!r}", what)

    def item(self, what: str) -> str:
        line = self.line(f"ITEM: {what}")
        if not line.startswith(f"ITEM: {what}"):
            self.fail(f"found {line[:60]!r}", f"a line that begins with 'ITEM: {what}'")
        return line

    def whole_number(self, what: str) -> int:
        line = self.line(what)
        if not line.isdigit() or len(line) > _MOST_DIGITS:
            self.fail(f"found {line[:60]!r}", what)
        return int(line)


def _read_binary_frame(at: _Cursor) -> Frame:
    step, rows, triclinic, *_ = _HEAD.unpack(at.take(_HEAD.size, "a binary frame's header"))
    width = len(at.output.columns)
    foreign = f"the header of a binary dump with {width} columns"
    if step < 0 or rows < 0 or triclinic not in (0, 1):
        at.fail("this is not the header of a binary dump", foreign)
    at.take(_BOX_BYTES + triclinic * _TILT_BYTES, "the box of a binary frame")
    found_width, ranks = _TAIL.unpack(at.take(_TAIL.size, "a binary frame's header"))
    if found_width != width:
        at.fail(f"the rows have {found_width} columns", foreign)
    if not 1 <= ranks <= MAX_RANKS:
        at.fail(f"the frame claims to come from {ranks} ranks", foreign)
    size = at.content.size
    if size is not None and rows * width * 8 > size - at.stream.tell():
        at.cut_short(f"{rows} rows of {width} numbers")
    values = np.concatenate([_read_rank(at, width) for _ in range(ranks)])
    if len(values) != rows:
        at.fail(f"the ranks wrote {len(values)} rows", f"{rows} rows, as the header says")
    return Frame(step, _split(values, at), at.frame == 0)


def _read_rank(at: _Cursor, width: int) -> NDArray[np.float64]:
    (count,) = _COUNT.unpack(at.take(_COUNT.size, "the count of numbers of a rank"))
    if count < 0 or count % width:
        at.fail(f"a rank wrote {count} numbers", f"a multiple of {width} columns")
    data = at.take(8 * count, f"{count} numbers of a rank")
    return np.frombuffer(data, dtype="<f8").astype(np.float64).reshape(-1, width)


def _read_text_frame(at: _Cursor) -> Frame:
    at.item("TIMESTEP")
    step = at.whole_number("a step")
    at.item("NUMBER OF")
    rows = at.whole_number("a number of rows")
    at.item("BOX BOUNDS")
    for _ in range(3):
        at.line("the bounds of the box")
    order = _column_order(at, at.item("ENTRIES" if at.output.kind == "local" else "ATOMS"))
    lines = list(islice(at.stream, rows))
    if len(lines) < rows or (lines and not lines[-1].endswith(b"\n")):
        at.cut_short(f"{rows} whole rows of {len(at.output.columns)} numbers")
    values = _parse(lines, at)
    after = at.stream.peek(1)
    if after[:1] in _ROW_BEGINS:
        at.fail(
            f"{rows} rows are not all: {after[:40]!r} follows", f"{rows} rows, as its header says"
        )
    return Frame(step, _split(values[:, order], at), at.frame == 0)


def _column_order(at: _Cursor, line: str) -> list[int]:
    """Where in a row the columns stand, in the order of the output's."""
    found = line.split()[2:]
    if sorted(found) != sorted(at.output.header):
        at.fail(
            f"the header names the columns {' '.join(found)}",
            f"{' '.join(at.output.header)} in any order",
        )
    return [found.index(name) for name in at.output.header]


def _parse(lines: list[bytes], at: _Cursor) -> NDArray[np.float64]:
    width = len(at.output.columns)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            values = np.fromstring(b"".join(lines).decode("ascii"), dtype=np.float64, sep=" ")
        except (DeprecationWarning, UnicodeDecodeError, ValueError):
            _blame_row(lines, at)
    if values.size != len(lines) * width:
        _blame_row(lines, at)
    return values.reshape(-1, width)


def _blame_row(lines: list[bytes], at: _Cursor) -> NoReturn:
    """Name the first row that is not as many numbers as there are columns."""
    width = len(at.output.columns)
    for number, line in enumerate(lines):
        if not _is_row(line, width):
            at.fail_row(number, f"found {line[:120]!r}", f"{width} numbers")
    at.fail("its rows cannot be read as numbers", f"{len(lines)} rows of {width} numbers")


def _is_row(line: bytes, width: int) -> bool:
    words = line.split()
    try:
        return len([float(word) for word in words]) == width
    except ValueError:
        return False


def _split(values: NDArray[np.float64], at: _Cursor) -> Columns:
    """Name the columns of a (N, M) block, after checking that all is finite."""
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        name = at.output.columns[column]
        at.fail_row(int(row), f"{name} is {values[row, column]}", "a finite number")
    columns: Columns = {}
    for index, name in enumerate(at.output.columns):
        column = np.ascontiguousarray(values[:, index])
        columns[name] = _integers(column, name, at) if is_integer_column(name) else column
    return columns


def _integers(column: NDArray[np.float64], name: str, at: _Cursor) -> NDArray[np.int64]:
    whole = column.astype(np.int64)
    if (whole != column).any():
        row = int(np.flatnonzero(whole != column)[0])
        at.fail_row(row, f"{name} is {column[row]}", "a whole number")
    return whole


def read_print_file(
    file: Path, output: Layout, *, block_rows: int = _BLOCK_ROWS
) -> Iterator[Columns]:
    """Blocks of rows of one ``fix print`` file.

    Parameters
    ----------
    file : Path
        The file. Its header line may come again between the rows, as it does
        when the engine opens the file once more.
    output : Layout
        What ``columns.json`` says about it.
    block_rows : int
        Rows to read at once.

    Yields
    ------
    dict of str to (N,) ndarray
        The columns of at most `block_rows` rows, steps strictly increasing.

    Raises
    ------
    TruncatedDumpError
        If the file ends inside a row.
    DumpError
        If the header is another one, a row is not finite numbers, or the steps
        do not increase.
    """
    with Content(file) as content:
        stream = io.BufferedReader(content)
        at = _Cursor(file, stream, content, output, 0, 0)
        if not stream.peek(1):
            return
        _check_print_header(at)
        last_step = -1
        while stream.peek(1):
            lines, cut = _print_lines(at, block_rows)
            if lines:
                columns = _split(_parse(lines, at), at)
                _check_increasing(columns["step"], last_step, at)
                last_step = int(columns["step"][-1])
                yield columns
            at.frame += len(lines)
            at.offset = stream.tell()
            if cut is not None:
                at.offset -= len(cut)
                at.cut_short(f"{len(output.columns)} numbers and the end of the line")


def _check_print_header(at: _Cursor) -> None:
    found = at.line("a header line").lstrip("# ").split()
    if found != list(at.output.header):
        at.fail(f"the header is {' '.join(found)[:200]!r}", f"{' '.join(at.output.header)!r}")
    at.offset = at.stream.tell()


def _print_lines(at: _Cursor, count: int) -> tuple[list[bytes], bytes | None]:
    """Read `count` lines or up to a header, and the cut one that ends the file, if any."""
    header = list(at.output.header)
    block = islice(at.stream, count)
    lines = list(takewhile(lambda line: not _is_header(line, header), block))
    cut = lines.pop() if lines and not lines[-1].endswith(b"\n") else None
    return lines, cut


def _is_header(line: bytes, header: list[str]) -> bool:
    first = line.lstrip(b"# ")[:1]
    return first.isalpha() and line.decode("ascii", "replace").lstrip("# ").split() == header


def _check_increasing(
    steps: NDArray[np.int64] | NDArray[np.float64], last: int, at: _Cursor
) -> None:
    jumps = np.diff(steps, prepend=last)
    if (jumps <= 0).any():
        row = int(np.flatnonzero(jumps <= 0)[0])
        at.fail_row(row, f"the steps go back to {int(steps[row])}", "rising steps")

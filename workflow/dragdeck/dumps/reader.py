"""The frames of any output of LIGGGHTS, and the rows of its ``fix print`` files."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dragdeck.dumps.content import Cursor
from dragdeck.dumps.frame import Columns, Frame, Layout
from dragdeck.dumps.grammar import binary_names, frame_columns, print_rows
from dragdeck.dumps.numbers import WrongRow, first_rows, named_columns, whole_numbers
from dragdeck.errors import DumpError, TruncatedDumpError

_KINDS = {"ENTRIES": "local", "ATOMS": "custom"}
_HEADER_LINES = 14
"""Up to the names of the columns, with units and time before them."""


def read_frames(files: Iterable[Path], layout: Layout) -> Iterator[Frame]:
    """Frames of files of one ``dump custom`` or ``dump local``.

    Parameters
    ----------
    files : iterable of Path
        The files, one after the other.
    layout : Layout
        What they hold. A text dump may have its columns in any order, as its header says.

    Yields
    ------
    Frame
        In the order of the file. At most one is in memory.

    Raises
    ------
    TruncatedDumpError
        If a file ends inside a frame.
    DumpError
        If a file is not such a dump, has other columns, or holds something
        that is not a finite number. The frames before have come by then.
    """
    first: Columns = {}
    for file in files:
        with Cursor(file, layout) as at:
            for number in at.frames():
                try:
                    step, columns = frame_columns(at)
                    first = first or {
                        name: column for name, column in columns.items() if column.size
                    }
                    columns = {
                        name: _like(first.get(name), column, name)
                        for name, column in columns.items()
                    }
                except WrongRow as wrong:
                    at.fail(f"row {wrong.row}: {wrong.problem}", wrong.expected)
                yield Frame(step, columns, number == 0)


def _like(first: Any, column: Any, name: str) -> Any:
    """A column with the type that it had in the first frame with rows.

    Raises
    ------
    WrongRow
        At the first row that does not fit.
    """
    if first is None or column.dtype == first.dtype or not column.size:
        return column
    if first.dtype.kind == "i":
        return whole_numbers(column, name)
    return column.astype(first.dtype)


def read_prints(file: Path, layout: Layout, *, block_rows: int = 20_000) -> Iterator[Columns]:
    """Blocks of rows of one ``fix print`` file.

    Parameters
    ----------
    file : Path
        The file; its header line may come again between the rows.
    layout : Layout
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
    last_step = -1.0
    with Cursor(file, layout) as at:
        for rows in print_rows(at, block_rows):
            try:
                columns = named_columns(rows.cells, layout.columns)
                jumps = np.diff(rows.cells[0], prepend=last_step)
                if (jumps <= 0).any():
                    row = int(np.flatnonzero(jumps <= 0)[0])
                    problem = f"the steps go back to {int(rows.cells[0, row])}"
                    raise WrongRow(row, problem, "rising steps")
            except WrongRow as wrong:
                at.frame += wrong.row
                at.offset += len(first_rows(rows.text, wrong.row))
                at.fail(wrong.problem, wrong.expected)
            if rows.text:
                last_step = rows.cells[0, -1]
                yield columns


def read_dump(source: Path | str, columns: Sequence[str] | None = None) -> Iterator[Frame]:
    """Read the frames of a ``dump custom`` or ``dump local`` of LIGGGHTS or LAMMPS.

    Parameters
    ----------
    source : Path or str
        The file; or, for a dump with one file per frame, its pattern with ``*`` for the step.
        The ending ``.bin`` marks a binary dump, ``.gz`` a compressed one.
    columns : sequence of str, optional
        Names of the columns: required for a binary dump without them, in the order of its dump
        command; a text dump must contain all of them, in any order. By default those in its header.

    Yields
    ------
    Frame
        In the order of the file, or of the steps in the names of the files. Columns
        named ``id``, ``type`` or ``..._id`` are int64 if all are whole, ``element`` and
        ``typelabel`` are strings, all others float64. A column that a dump has twice comes once.
        At most one frame is in memory.

    Warns
    -----
    UserWarning
        The last row has no line end: its last number may have been cut.

    Raises
    ------
    TruncatedDumpError
        If a file ends inside a frame.
    DumpError
        If there is no such file, or it is not such a dump. Both errors name file, frame and byte;
        the frames before it have been yielded by then.
    """
    files = dump_files(source)
    yield from read_frames(files, layout_of(files[0], columns))


def dump_files(source: Path | str) -> list[Path]:
    """Files of a dump; those that ``*`` stands for in the order of their steps.

    Raises
    ------
    DumpError
        If there is none.
    """
    source = Path(source)
    before, star, after = source.name.partition("*")
    if not star:
        files = [source] if source.is_file() else []
    else:
        name = re.compile(re.escape(before) + r"([0-9]+)" + re.escape(after))
        matches = [(name.fullmatch(file.name), file) for file in source.parent.glob(source.name)]
        files = [file for _, file in sorted((int(m.group(1)), file) for m, file in matches if m)]
    if not files:
        raise DumpError(source, "there is no such file", remedy="check the name of the dump")
    return files


@dataclass(frozen=True)
class DumpLayout:
    """What a single dump says of itself; see `dragdeck.dumps.frame.Layout`."""

    kind: str
    columns: tuple[str, ...]
    binary: bool = False
    foreign: ClassVar[bool] = True

    @property
    def header(self) -> tuple[str, ...]:
        """The columns, which have the names that LIGGGHTS gives them."""
        return self.columns


def layout_of(file: Path, columns: Sequence[str] | None) -> DumpLayout:
    """Layout of a dump file, from its name and first lines.

    Raises
    ------
    DumpError
        If it is no dump, or columns of a binary one are not given, or one comes twice.
    """
    binary = ".bin" in file.suffixes[-2:]
    kind, names = ("custom", _names(file)) if binary else _header(file)
    wanted = tuple(columns or dict.fromkeys(names))
    if not wanted:
        raise DumpError(
            file,
            "a binary dump does not contain the names of its columns",
            remedy="give their names in the order of the dump command in the input script",
        )
    if len(set(wanted)) < len(wanted):
        raise DumpError(file, f"a column is given twice: {' '.join(wanted)}")
    return DumpLayout(kind, wanted, binary)


def _names(file: Path) -> list[str]:
    """Names of the columns of a binary dump; none where it does not have them."""
    return binary_names(file, DumpLayout("custom", (), binary=True))


def _header(file: Path) -> tuple[str, list[str]]:
    """Kind of a text dump, and the names of its columns."""
    expected = "the header of a text dump of LIGGGHTS"
    with Cursor(file, DumpLayout("custom", ())) as at:
        lines = b"".join(at.lines(_HEADER_LINES)).split(b"\n")
    named = [line for line in lines if line.startswith((b"ITEM: ATOMS ", b"ITEM: ENTRIES "))]
    words = [word.decode("ascii", "replace") for word in named[0].split()] if named else []
    if len(words) < 3:
        begun = not lines[0] or lines[0].startswith(b"ITEM: ")
        raise (TruncatedDumpError if begun else DumpError)(
            file,
            f"found {lines[0][:60]!r}, but no names of columns",
            frame=0,
            offset=0,
            expected=expected,
            remedy="give a file of dump custom or dump local; the name of a binary file must end "
            "with .bin, that of a compressed one with .gz",
        )
    return _KINDS[words[1]], words[2:]

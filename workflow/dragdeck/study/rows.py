"""Rows of users' tables as numbers, in pieces: the first piece with a bad row is refused."""

import csv
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dragdeck.arrays import ANY, END, TEXT, Floats, Ints, numpy_of, quick_columns
from dragdeck.errors import InputError, together
from dragdeck.mesh.polygons import pieces

_MOST_NAMED = 5
"""Errors of a table that are named."""

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)
"""What may be thousands as well as a decimal comma."""

BLANK = " \t;,\x1a"
"""What lines without a value consist of: Excel writes its separators below a table, DOS an end."""

LINE = re.compile("\n")

_SHORTEST = 2
"""Characters of the shortest row, its end included."""

_HEADER_AGAIN = re.compile(r"(channels$|\*\*\*|x_value|time\b)", re.I)
"""First cells of lines that begin another record, as in a file of LabVIEW with several headers."""

_MISSING = ("", "nan", "n/a", "#n/a", "#nv", "null")
MOST_MISSING = 0.01
"""Part of the values of a column that may be missing where its reader can do without them."""

_COMMA = (
    "if these are decimal commas, export with a decimal point, or with a semicolon or tab between "
    "the columns"
)

_Piece = tuple[Ints, list[Floats]]
"""Lines of rows, (N,), and numbers in their columns, (N,) each."""


@dataclass(frozen=True)
class Table:
    """The rows of a CSV file as text.

    Attributes
    ----------
    file : Path
    separator : str
        What stands between columns: ``;``, a tab or ``,``, whichever the header has first.
    names : tuple of str
        Columns, in lower case and with the unit at the end: ``fx_n`` of ``Fx [N]``.
    header_line : int
    text : str
        What stands below the header: rows, comments and blank lines.
    first_line : int
        Line of its begin in the file.
    joined : bool
        Whether every second comma is a decimal mark, in a file with commas between columns.
    most : int, optional
        No more rows than one beyond so many are read.
    """

    file: Path
    separator: str
    names: tuple[str, ...]
    header_line: int
    text: str
    first_line: int
    joined: bool = False
    most: int | None = None

    def numbers(self, names: Iterable[str], gaps: Collection[str] = ()) -> _Piece:
        """Columns as numbers, by their names; up to 1 % of those in `gaps` as NaN.

        Returns
        -------
        lines : (N,) array
            Line of each row in the file.
        columns : list of (N,) arrays

        Raises
        ------
        InputError
            Rows are longer or shorter than the header, a value is no finite number, or a comma in
            it may be a decimal comma or not; it names the line of each in the first bad piece.
        """
        rows = _Rows(self, [*names], gaps)
        read, count, missing, left = [rows.none], 0, 0, len(self.text)
        try:
            for line, text in pieces(self.text, LINE, "a line"):
                read.append(rows.read(self.first_line + line - 1, text))
                lines, columns = read[-1]
                count, left = count + len(lines), left - len(text)
                missing += np.isnan(columns).sum(axis=1).max()
                many = missing > MOST_MISSING * (count + left / _SHORTEST)
                if many or (self.most is not None and count > self.most):
                    break
        except InputError as error:
            if error.file is None:
                error.file, error.line = self.file, self.first_line + (error.line or 1) - 1
            raise
        rows.refuse_unsure()
        stop = None if self.most is None else self.most + 1
        lines, *columns = (
            np.concatenate(parts)[:stop]
            for parts in zip(*([lines, *columns] for lines, columns in read), strict=True)
        )
        rows.refuse_missing(lines, columns)
        return lines, columns

    def refuse_gaps(self, lines: Ints) -> None:
        """Refuse lines between the header and the last row that are no rows: samples have no time.

        Raises
        ------
        InputError
            It names the first blank or commented line.
        """
        gaps = np.flatnonzero(lines != self.first_line + np.arange(len(lines)))
        if len(gaps):
            line = self.first_line + int(gaps[0])
            problem = "a blank or commented line in a series without times"
            remedy = "remove the line if no sample is missing there, or give a column of times"
            raise InputError(problem, file=self.file, line=line, remedy=remedy)


def is_row(text: str) -> bool:
    """Whether a line is a row: neither blank nor a comment."""
    return bool(text.strip(BLANK)) and text.lstrip()[0] != "#"


def cells_of(text: str, separator: str) -> list[str]:
    """The cells of a line, those in quotes without them.

    Raises
    ------
    csv.Error
        A quotation mark has no second one in the line, for example.
    """
    reader = csv.reader([text], delimiter=separator, skipinitialspace=True, strict=True)
    return next(reader)


def without_ends(row: list[str], count: int) -> list[str]:
    """A row without empty cells beyond the header, which stand behind trailing separators."""
    while len(row) > count and not row[-1].strip():
        row = row[:-1]
    return row


class _Rows:
    """Reads columns of a table piece by piece; decimal marks must be the same in all of them."""

    def __init__(self, table: Table, names: list[str], gaps: Collection[str]) -> None:
        self.table, self.names, self.gaps = table, names, gaps
        self.none: _Piece = (np.empty(0, np.int64), [np.empty(0) for _ in names])
        self._count = len(table.names) * (2 if table.joined else 1)
        self._places = [table.names.index(name) for name in names]
        self._unnamed = [place for place, name in enumerate(table.names) if not name]
        self._marks = dict[str, tuple[int, str]]()
        self._grouped = True

    def read(self, line: int, text: str) -> _Piece:
        """The rows of some lines, of which the first has this number."""
        return self._quickly(line, text) or self._slowly(line, text)

    def _quickly(self, line: int, text: str) -> _Piece | None:
        """The rows of a piece in which every line is one, and every value a plain number."""
        table = self.table
        text = text if text.endswith("\n") else f"{text}\n"
        if "#" in text or ('"' in text and not _quotes_are_pairs(text, table.separator)):
            return None
        content = text.encode()
        if table.joined:
            content = _divided(content, self._count)
        width = content.partition(b"\n")[0].count(table.separator.encode()) + 1
        layout = [ANY if name else END for name in table.names]
        layout += [END] * (width - len(layout))
        for place in self._places:
            layout[place] = TEXT
        read = quick_columns(content, layout, table.separator, quoted='"' in text)
        if read is None:
            return None
        order = sorted({*self._places})
        cells = [read[order.index(place)] for place in self._places]
        lines = np.arange(line, line + len(cells[0]))
        settled = self._marks.keys() - ({","} if self._grouped else {})
        unsure = table.separator != "," or '"' in text
        if unsure and any(mark in text for mark in {*".,"} - settled):
            self._note(lines, [column.to_pylist() for column in cells])
        return self._plain(lines, cells)

    def _plain(self, lines: Ints, cells: Sequence[Any]) -> _Piece | None:
        """Plain numbers, and empty cells where there may be gaps, but for rows without a value."""
        try:
            columns = [numpy_of(self._pointed(column).cast("float64")) for column in cells]
        except ValueError:
            return None
        empty = [column.null_count if name in self.gaps else 0
                 for name, column in zip(self.names, cells, strict=True)]  # fmt: skip
        gaps = [np.isnan(values) for values in columns]
        finite = [np.count_nonzero(np.isfinite(values)) for values in columns]
        if [len(lines) - count for count in empty] != finite or np.all(gaps, axis=0).any():
            return None
        return lines, columns

    def _slowly(self, first: int, text: str) -> _Piece:
        """The rows of a piece line by line."""
        numbered = [(line, row) for line, row in enumerate(text.split("\n"), first) if is_row(row)]
        rows = [self._row(line, row) for line, row in numbered]
        lines = np.array([line for line, _ in numbered], dtype=np.int64)
        self._refuse_uneven(lines, rows)
        if self.table.joined:
            rows = [[*map(".".join, zip(row[::2], row[1::2], strict=True))] for row in rows]
        cells = [[row[place].strip() for row in rows] for place in self._places]
        self._note(lines, cells)
        mark = "," if "," in self._marks else "."
        columns, errors = list[Floats](), list[InputError]()
        for name, column in zip(self.names, cells, strict=True):
            values = np.array([_number(cell.replace(mark, ".")) for cell in column])
            for row in np.flatnonzero(~np.isfinite(values)).tolist():
                if name not in self.gaps or column[row].lower() not in _MISSING:
                    errors.append(self._wrong(lines[row], name, _said(column[row])))
            columns.append(values)
        if errors:
            self.refuse_unsure()
            raise _first(sorted(errors, key=lambda error: error.line or 0), lines[-1])
        return lines, columns

    def _row(self, line: int, text: str) -> list[str]:
        try:
            return without_ends(cells_of(text, self.table.separator), self._count)
        except csv.Error as error:
            problem, remedy = f"not a CSV file: {error}", "a row is one line, quoted cells included"
            file = self.table.file
            raise InputError(problem, file=file, line=line, remedy=remedy) from None

    def _refuse_uneven(self, lines: Ints, rows: Sequence[Sequence[str]]) -> None:
        """Refuse rows that are longer or shorter than the header, or have a value without name."""
        table, errors = self.table, []
        for line, row in zip(lines.tolist(), rows, strict=True):
            if _HEADER_AGAIN.match(row[0]):
                raise InputError(
                    "a second header: the file has several records", file=table.file, line=line,
                    value=table.separator.join(row)[:80], limit="one header and its rows",
                    remedy="export one record per file; in LabVIEW: one header only",
                )  # fmt: skip
            divided = table.joined and not all(row)
            even = len(row) == self._count and not divided
            if even and not any(row[column].strip() for column in self._unnamed):
                continue
            problem = f"the row has {len(row)} values, but the header has {len(table.names)} names"
            if even:
                problem = "a value stands in a column without a name"
            decimal = table.separator == "," and len(row) >= self._count
            errors.append(
                InputError(
                    problem, file=table.file, line=line, value=table.separator.join(row)[:80],
                    limit=table.separator.join(table.names)[:200],
                    remedy=_COMMA if decimal else "correct the row, or the header",
                )
            )  # fmt: skip
        if errors:
            raise _first(errors, lines[-1])

    def _note(self, lines: Ints, columns: Sequence[Sequence[str | None]]) -> None:
        """Note the decimal marks in cells; there is one in the whole table."""
        for mark in ".,":
            marked = [(int(lines[row]), cell) for cells in columns
                      for row, cell in enumerate(cells) if cell and mark in cell]  # fmt: skip
            if marked:
                self._marks.setdefault(mark, min(marked))
            if mark == "," and self._grouped:
                self._grouped = all(_GROUPED.fullmatch(cell) for _, cell in marked)
        if len(self._marks) > 1:
            self._refuse_comma()

    def _pointed(self, cells: Any) -> Any:
        """Cells with decimal points for decimal commas."""
        from pyarrow import compute

        comma = "," in self._marks
        return compute.replace_substring(cells, ",", ".") if comma else cells

    def refuse_unsure(self) -> None:
        """Refuse commas of which each may be a mark of thousands."""
        if "," in self._marks and self._grouped:
            self._refuse_comma()

    def _refuse_comma(self) -> None:
        problem = "a comma may be a decimal comma or a mark of thousands"
        if "." in self._marks:
            problem += f", while line {self._marks['.'][0]} has a decimal point"
        line, cell = self._marks[","]
        raise InputError(
            problem, file=self.table.file, line=line, value=cell,
            limit="one decimal mark, point or comma, in the whole table, and no mark of thousands",
            remedy="export with a decimal point and without marks of thousands",
        )  # fmt: skip

    def refuse_missing(self, lines: Ints, columns: Sequence[Floats]) -> None:
        """Refuse columns of which too many values are missing."""
        for name, values in zip(self.names, columns, strict=True):
            missing = lines[np.isnan(values)]
            if len(missing) > MOST_MISSING * len(lines):
                errors = [self._wrong(line, name, _said("")) for line in missing[:_MOST_NAMED]]
                raise _first(errors, lines[-1], len(missing))

    def _wrong(self, line: int, name: str, problem: str) -> InputError:
        file, limit = self.table.file, "a finite number"
        return InputError(problem, file=file, line=int(line), field=name, limit=limit)


def _divided(content: bytes, cells: int) -> bytes:
    """Rows of so many parts between commas with points for each second comma.

    Rows in which these commas are not between digits are returned as they are.
    """
    marks = np.frombuffer(content, np.uint8).copy()
    ends, places = np.flatnonzero(marks == ord("\n")), np.flatnonzero(marks == ord(","))
    if len(places) != (cells - 1) * len(ends):
        return content
    commas = places.reshape(len(ends), cells - 1)
    decimal = commas[:, ::2]
    beside = marks[np.concatenate([decimal - 1, decimal + 1])]
    even = (commas[:, -1] < ends).all() and (commas[1:, 0] > ends[:-1]).all()
    if not even or (beside < ord("0")).any() or (beside > ord("9")).any():
        return content
    marks[decimal] = ord(".")
    return marks.tobytes()


def _quotes_are_pairs(text: str, separator: str) -> bool:
    """Whether quotation marks are at both ends of cells only; pyarrow reads these as csv does."""
    marks = (separator, "\n")
    first, last = (sum(text.count(form.format(mark)) for mark in marks) for form in ('{}"', '"{}'))
    first += text.startswith('"')
    return first == last and first + last == text.count('"')


def _number(cell: str) -> float:
    return float(cell) if NUMBER.fullmatch(cell) else np.nan


def is_number(cell: str) -> bool:
    """Whether a cell is a number with a decimal point or comma."""
    return NUMBER.fullmatch(cell.replace(",", ".", 1)) is not None


def _said(cell: str) -> str:
    if len(cell.split()) > 1 and all(map(is_number, cell.split())):
        return f"{cell[:60]!r} is several numbers, without a semicolon, tab or comma between them"
    if re.match(r"[\d-]+[ T]?[\d:]*:\d\d", cell):
        return f"{cell[:60]!r} is a time of the day; export seconds, or state rate_hz without times"
    return f"{cell[:60]!r} is text, not a number" if cell else "the value is missing"


def _first(errors: Sequence[InputError], last: int, count: int = 0) -> InputError:
    """The first errors as one, with the number of the others up to a line."""
    shown, left = list(errors[:_MOST_NAMED]), max(count, len(errors)) - _MOST_NAMED
    if left > 0:
        more = f"{left} more such lines up to line {last}"
        shown.append(InputError(more, file=shown[0].file))
    return together(shown)

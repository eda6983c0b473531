"""Tables of users: CSV files of numbers. Nothing in them is cut, shifted or guessed.

Every table that a study names is read here: measured forces, waypoints, sieve analyses. Measuring
programs write a head before the names of the columns, and units below them or in brackets.
"""

import csv
import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError, together
from dragdeck.files import text_of

Floats = NDArray[np.float64]

_MOST_BYTES = 64_000_000
_MOST_NAMED = 5
"""Errors of a table that are named."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)
"""What may be thousands as well as a decimal comma."""

_UNITS = {
    "s": "s", "ms": "ms", "us": "us", "\u00b5s": "us", "\u03bcs": "us", "N": "n", "mN": "mn",
    "kN": "kn", "m": "m", "mm": "mm", "kg": "kg", "g": "g",
    "deg": "deg", "\u00b0": "deg", "rad": "rad",
}  # fmt: skip
"""Units as programs write them, and as names of columns end with them."""

_BLANK = " \t;,"
"""What lines without a value consist of: Excel writes its separators below a table."""

_MISSING = ("", "nan", "n/a", "#n/a", "#nv", "null")
MOST_MISSING = 0.01
"""Part of the values of a column that may be missing where its reader can do without them."""

_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")
_BEHIND = re.compile(r"(.*\S)\s*(?:/|,|\sin)\s*(\S+)")
"""A unit in brackets, and one behind a mark, as in ``Fx / N``."""
_LABVIEW_TIME = "x_value"
_TIMES = ("time", "t", "zeit", "temps", _LABVIEW_TIME)
"""Names of a column of times without its unit; LabVIEW's is in s."""

_COMMENT = "comment"
"""The last column of LabVIEW, which its rows do not have."""

_LONGEST_HEAD = 1000
"""Lines within which the names of columns stand."""

_LABVIEW_UNITS = "Y_Unit_Label"
"""First word of the line of its head with the units of all columns but that of the times."""

_COMMA = (
    "if these are decimal commas, export with a decimal point, or with a semicolon or tab between "
    "the columns"
)


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
    lines : sequence of int
        Line of each row in the file.
    rows : sequence of sequences of str
    """

    file: Path
    separator: str
    names: tuple[str, ...]
    header_line: int
    lines: Sequence[int]
    rows: Sequence[Sequence[str]]

    def numbers(self, names: Iterable[str], gaps: Collection[str] = ()) -> list[Floats]:
        """Columns as numbers, (N,) each, by their names; up to 1 % of those in `gaps` as NaN.

        Raises
        ------
        InputError
            Rows are longer or shorter than the header, a value is no finite number, or a comma in
            it may be a decimal comma or not; it names the line of each.
        """
        self._refuse_uneven()
        wanted = {name: [row[self.names.index(name)].strip() for row in self.rows]
                  for name in names}  # fmt: skip
        if self._decimal_commas(list(wanted.values())):
            wanted = {
                name: [cell if "." in cell else cell.replace(",", ".") for cell in cells]
                for name, cells in wanted.items()
            }
        values, errors = [], []
        for name, cells in wanted.items():
            absent = {row for row, cell in enumerate(cells) if cell.lower() in _MISSING}
            if name not in gaps or len(absent) > MOST_MISSING * len(cells):
                absent = set()
            texts = [row for row, cell in enumerate(cells)
                     if row not in absent and not _NUMBER.fullmatch(cell)]  # fmt: skip
            errors += [self._wrong(row, name, _said(cells[row])) for row in texts]
            readable = ["nan" if row in absent else "0" if texts else cell
                        for row, cell in enumerate(cells)]  # fmt: skip
            column = np.array(readable, dtype=np.float64)
            large = np.flatnonzero(np.isinf(column)).tolist()
            errors += [self._wrong(row, name, _said(cells[row])) for row in large]
            values.append(column)
        if errors:
            raise _first(sorted(errors, key=lambda error: error.line or 0))
        return values

    def refuse_gaps(self) -> None:
        """Refuse lines between the header and the last row that are no rows: samples have no time.

        Raises
        ------
        InputError
            It names the first blank or commented line.
        """
        for line, other in zip(self.lines, range(self.header_line + 1, 10**9), strict=False):
            if line != other:
                problem = "a blank or commented line in a series without times"
                remedy = "remove the line if no sample is missing there, or give a column of times"
                raise InputError(problem, file=self.file, line=other, remedy=remedy)

    def _refuse_uneven(self) -> None:
        """Refuse rows that are longer or shorter than the header, or have a value without name."""
        count, errors = len(self.names), []
        unnamed = [column for column, name in enumerate(self.names) if not name]
        for line, row in zip(self.lines, self.rows, strict=True):
            if len(row) == count and not any(row[column].strip() for column in unnamed):
                continue
            problem = f"the row has {len(row)} values, but the header has {count} names"
            if len(row) == count:
                problem = "a value stands in a column without a name"
            decimal = self.separator == "," and len(row) >= count
            errors.append(
                InputError(
                    problem, file=self.file, line=line, value=self.separator.join(row)[:80],
                    limit=self.separator.join(self.names)[:200],
                    remedy=_COMMA if decimal else "correct the row, or the header",
                )
            )  # fmt: skip
        if errors:
            raise _first(errors)

    def _decimal_commas(self, columns: Sequence[Sequence[str]]) -> bool:
        """Whether commas in numbers are decimal commas."""
        if self.separator == ",":
            return False
        points, commas = (
            [(row, cell) for cells in columns for row, cell in enumerate(cells) if mark in cell]
            for mark in ".,"
        )
        if not commas:
            return False
        row, cell = min(commas)
        limit = "one decimal mark, point or comma, in the whole table, and no mark of thousands"
        if points or all(_GROUPED.fullmatch(cell) for _, cell in commas):
            problem = "a comma may be a decimal comma or a mark of thousands"
            if points:
                problem += f", while line {self.lines[min(points)[0]]} has a decimal point"
            raise InputError(
                problem, file=self.file, line=self.lines[row], value=cell, limit=limit,
                remedy="export with a decimal point and without marks of thousands",
            )  # fmt: skip
        return True

    def _wrong(self, row: int, name: str, problem: str) -> InputError:
        file, line = self.file, self.lines[row]
        return InputError(problem, file=file, line=line, field=name, limit="a finite number")


def _said(cell: str) -> str:
    if len(cell.split()) > 1 and all(map(_is_number, cell.split())):
        return f"{cell[:60]!r} is several numbers, without a semicolon, tab or comma between them"
    return f"{cell!r} is text, not a number" if cell else "the value is missing"


def read_table(file: Path, most: int | None = None) -> Table:
    """Read a CSV file: a header line, then one row per line.

    Lines that begin with ``#`` are comments; they and blank lines are passed over.

    Parameters
    ----------
    file : Path
    most : int, optional
        Of a longer table, no more rows than one beyond so many are read.

    Raises
    ------
    InputError
        The file cannot be read as text of at most 64 MB, or is no CSV file.
    """
    texts = _text(file).split("\n")
    used = [n for n, text in enumerate(texts) if text.strip(_BLANK) and text.lstrip()[0] != "#"]
    if used and re.fullmatch("sep=.", texts[used[0]].strip(), re.IGNORECASE):  # of Excel
        del used[0]
    if not used:
        raise InputError("the file is empty", file=file, limit="a header line, and rows of numbers")
    before, has_units = _head(texts, used)
    head, used = used[:before], used[before:]
    header = used[0] + 1
    separator = _separator(texts[used[0]])
    units = _cells(texts[used.pop(1)], separator) if has_units else _labview_units(texts, head)
    lines, rows = [], []
    reader = csv.reader((texts[n] for n in used), delimiter=separator, skipinitialspace=True)
    try:
        names, *_ = islice(reader, 1)
        for row in islice(reader, None if most is None else most + 1):
            lines.append(used[reader.line_num - 1] + 1)
            rows.append(row)
    except csv.Error as error:
        line = used[reader.line_num - 1] + 1
        raise InputError(f"not a CSV file: {error}", file=file, line=line) from None
    if before and names[-1].lower() == _COMMENT and {*map(len, rows)} == {len(names) - 1}:
        names.pop()
    rows = [_without_ends(row, len(names)) for row in rows]
    if names[0].lower() == _LABVIEW_TIME and not any(row[0].strip() for row in rows if row):
        names[0] = ""  # its file has no times
    units = _without_ends(units, len(names))
    try:
        named = tuple(column_name(*column) for column in zip_longest(names, units, fillvalue=""))
    except InputError as error:
        error.file, error.line = file, header
        raise
    if separator == "," and (joined := _joined(rows, len(names))):
        separator, rows = ";", joined
    return Table(file, separator, named, header, lines, rows)


def column_name(name: str, unit: str = "") -> str:
    """Name of a column in lower case with its unit at the end.

    The unit is in brackets, as in ``Fx [N]``, behind a mark, as in ``Fx / N`` or ``Fx in N``, or in
    a row below the names.

    Raises
    ------
    InputError
        Units contradict each other.
    """
    bracketed, behind = _BRACKETS.fullmatch(name.strip()), _BEHIND.fullmatch(name.strip())
    if not bracketed and behind and behind[2] in _UNITS:
        bracketed = behind
    base, units = re.sub(r"\s+", "_", name.strip().lower()), {unit.strip("[]() ")}
    if bracketed:
        base = re.sub(r"\s+", "_", bracketed[1].lower())
        units.add(bracketed[2])
    if base == _LABVIEW_TIME and units == {""}:
        units.add("s")
    base = "time" if base in _TIMES else base
    end = base.rpartition("_")[2]
    if end in _UNITS.values():
        units.add(end)
    known = {_UNITS.get(text, text) for text in units if text}
    if not known & {*_UNITS.values()}:
        return name.strip().lower()
    if len(known) > 1:
        raise InputError(
            "a column has two units", field=name, value=" and ".join(sorted(known)), limit="one"
        )
    return base if end in known else f"{base}_{known.pop()}"


def _without_ends(row: list[str], count: int) -> list[str]:
    """A row without empty cells beyond the header, which stand behind trailing separators."""
    while len(row) > count and not row[-1].strip():
        row = row[:-1]
    return row


def _labview_units(texts: Sequence[str], head: Sequence[int]) -> list[str]:
    lines = (_cells(texts[n]) for n in head)
    return next((["", *units] for key, *units in lines if key == _LABVIEW_UNITS), [])


def _joined(rows: Sequence[Sequence[str]], count: int) -> list[list[str]]:
    """Rows in which commas are decimal marks and separators; none where they are not surely so.

    A second part that begins with 0, such as 060, is no number of its own.
    """
    if any(len(row) != 2 * count for row in rows):
        return []
    pairs = [[*zip(row[::2], row[1::2], strict=True)] for row in rows]
    parts = [part for row in pairs for part in row]
    fractions = [fraction for whole, fraction in parts if re.fullmatch(r"[-+]?\d+", whole.strip())]
    surely = any(fraction[:1] == "0" and len(fraction) > 1 for fraction in fractions)
    if not surely or len(fractions) < len(parts) or not all(map(str.isdecimal, fractions)):
        return []
    return [[f"{whole},{fraction}" for whole, fraction in row] for row in pairs]


def _head(texts: Sequence[str], used: Sequence[int]) -> tuple[int, bool]:
    """How many used lines are before that of the names, and whether units are below it.

    Names stand before the first two rows of numbers. Where what stands there cannot be names, the
    first line has them, and the others are rows, of which `Table.numbers` says what is wrong.
    """
    used = used[:_LONGEST_HEAD]
    widths = [_width(texts[n]) for n in used]
    usual = max(Counter(filter(None, widths)).items(), key=lambda item: item[1], default=(0, 0))[0]
    numeric = [bool(width) and width == usual for width in widths]
    first = next((k for k in range(len(used)) if all(numeric[k : k + 2])), 0)
    units = first > 1 and _is_units(texts[used[first - 1]])
    names = first - 1 - units
    if names > 0 and any(map(_is_number, _cells(texts[used[names]]))):
        return 0, False
    return max(names, 0), units


def _separator(text: str) -> str:
    return next((mark for mark in (";", "\t") if mark in text), ",")


def _cells(text: str, separator: str = "") -> list[str]:
    return [cell.strip() for cell in text.split(separator or _separator(text))]


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell.replace(",", ".", 1)) is not None


def _width(text: str) -> int:
    """How many numbers are in a row of numbers alone, missing ones included; 0 of another line."""
    cells = _cells(text.strip().rstrip(_BLANK))
    return len(cells) if all(_is_number(cell) or not cell for cell in cells) else 0


def _is_units(text: str) -> bool:
    cells = [cell.strip("[]() ") for cell in _cells(text)]
    return any(cells) and all(cell in _UNITS or cell in ("", "-") for cell in cells)


def _text(file: Path) -> str:
    try:
        if (size := file.stat().st_size) > _MOST_BYTES:
            value, limit = f"{size / 1e6:.0f} MB", f"at most {_MOST_BYTES / 1e6:.0f} MB"
            raise InputError("the file is too large", file=file, value=value, limit=limit)
        text = text_of(file.read_bytes()).replace("\u2212", "-")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    before, zero, _ = text.partition("\0")
    if zero:
        line, remedy = before.count("\n") + 1, "export it as text in the encoding UTF-8"
        raise InputError("not a CSV file: a byte is 0", file=file, line=line, remedy=remedy)
    return text


def _first(errors: Sequence[InputError]) -> InputError:
    """The first errors as one, with the number of the others."""
    shown, left = list(errors[:_MOST_NAMED]), len(errors) - _MOST_NAMED
    if left > 0:
        shown.append(InputError(f"{left} more such lines", file=shown[0].file))
    return together(shown)

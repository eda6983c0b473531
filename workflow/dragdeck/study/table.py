"""Tables of users: CSV files of numbers. Nothing in them is cut, shifted or guessed.

Every table that a study names is read here: measured forces, waypoints, sieve analyses. Measuring
programs write a head before the names of the columns, and units below them or in brackets.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise, zip_longest
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.mesh.polygons import pieces
from dragdeck.study.rows import BLANK, LINE, Table, cells_of, is_number, is_row, without_ends

_MOST_BYTES = 64_000_000

_UNITS = {
    "s": "s", "sec": "s", "Sec": "s", "seconds": "s", "ms": "ms", "us": "us",
    "\u00b5s": "us", "\u03bcs": "us", "N": "n", "Newton": "n", "mN": "mn", "kN": "kn",
    "m": "m", "cm": "cm", "mm": "mm", "kg": "kg", "g": "g",
    "um": "um", "\u00b5m": "um", "\u03bcm": "um",
    "deg": "deg", "\u00b0": "deg", "rad": "rad",
}  # fmt: skip
"""Units as programs write them, and as names of columns end with them."""

_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")
_BEHIND = re.compile(r"(.*\S)\s*(?:/|,|\sin)\s*(\S+)")
"""A unit in brackets, and one behind a mark, as in ``Fx / N``."""
_LABVIEW_TIME = "x_value"
_TIMES = ("time", "t", "zeit", "temps", _LABVIEW_TIME)
"""Names of a column of times without its unit; LabVIEW's is in s."""

_COMMENT = "comment"
"""The last column of LabVIEW, which its rows do not have."""

ROW = "row"
"""Name that a first column without one gets if it counts the rows."""

_COUNTED = ["0", "1", "2"], ["1", "2", "3"]
"""How pandas, Excel and others begin a column without a name, of the numbers of rows."""

_LONGEST_HEAD = 1000
"""Lines within which the names of columns stand."""

_WORDS = re.compile(r"\S+(?: *[\[(][^\])]*[\])])?")
"""Words, each with a unit in brackets behind it."""

_LABVIEW_UNITS = "Y_Unit_Label"
"""First word of the line of its head with the units of all columns but that of the times."""


def user_table(file: Path, most: int | None = None) -> Table:
    """Read a CSV file: a header line, then one row per line.

    Lines that begin with ``#`` are comments; they and blank lines are passed over. Blanks may align
    the columns, and their names may stand in a comment just above the first row.

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
    text = _with_columns(_text(file))
    texts = _beginning(text, file)
    used = [n for n, line in enumerate(texts) if is_row(line)]
    if used and re.fullmatch("sep=.", texts[used[0]].strip(), re.IGNORECASE):  # of Excel
        del used[0]
    if not used:
        comments = f"nothing but comments within {len(texts):,} lines"
        problem = comments if any(texts) else "the file is empty"
        raise InputError(problem, file=file, limit="a header line, and rows of numbers")
    before, has_units = _head(texts, used)
    head, used = used[:before], used[before:]
    line, below = used[0] + 1, used[has_units] + 1
    separator = _separator(texts[used[0]])
    units = _cells(texts[used[1]], separator) if has_units else _labview_units(texts, head)
    rows = [texts[n] for n in used[1 + has_units :]]
    text = text[sum(len(line) + 1 for line in texts[:below]) :]
    try:
        names = cells_of(texts[used[0]], separator)
        if before and names[-1].lower() == _COMMENT:
            names, text = _without_comment(names, separator, rows, text)
        first = _cells(rows[0], separator) if rows else names
        if names[0].lower() == _LABVIEW_TIME and not first[0]:
            names[0] = ""  # its file has no times
        elif not names[0] and [_cells(row, separator)[0] for row in rows[:3]] in _COUNTED:
            names[0] = ROW
        units = without_ends(units, len(names))
        named = tuple(column_name(*column) for column in zip_longest(names, units, fillvalue=""))
    except csv.Error as error:
        raise InputError(f"not a CSV file: {error}", file=file, line=line) from None
    except InputError as error:
        error.file, error.line = file, line
        raise
    twice = separator == "," and all(named) and len(first) == 2 * len(names)
    joined = twice and _are_joined(rows, len(names))
    return Table(file, separator, named, line, text, below + 1, joined=joined, most=most)


def _with_columns(text: str) -> str:
    """A text with tabs for the blanks that align columns, and without a mark before their names."""
    lines = text.split("\n", _LONGEST_HEAD)
    lines, rest = lines[:_LONGEST_HEAD], lines[_LONGEST_HEAD:]
    rows = [_numbers_between_blanks(line) for line in lines]
    aligned = 2 * sum(map(bool, rows)) > sum(map(is_row, lines))
    widths = [len(row) for row in rows] if aligned else [*map(_width, lines)]
    pairs = enumerate(pairwise(widths))
    first = next((k for k, (width, below) in pairs if 1 < width == below), 0)
    if not first:
        return text
    named = lines[first - 1]
    if named.startswith("#") and not any(map(is_row, lines[:first])):
        named = named.lstrip("# ")
    cells = _between_blanks(named, widths[first]) if aligned else _cells(named)
    if len(cells) != widths[first]:
        return text
    if not aligned and named == lines[first - 1]:
        return text
    lines[first - 1] = named
    if aligned:
        lines[:first] = ["\t".join(_between_blanks(line, widths[first])) for line in lines[:first]]
        below = "\n".join([*lines[first:], *rest])
        rest = [re.sub(" +", "\t", re.sub("^ +| +$", "", below, flags=re.MULTILINE))]
        del lines[first:]
    return "\n".join([*lines, *rest])


def _numbers_between_blanks(text: str) -> list[str]:
    """The cells of a line of several numbers with nothing but blanks between them."""
    words = [] if "\t" in text else text.split()
    return words if len(words) > 1 and all(map(is_number, words)) else []


def _between_blanks(text: str, count: int) -> list[str]:
    """The cells of a line, if it has so many; else the line."""
    ways = re.split(r"\s{2,}", text.strip()), text.split(), _WORDS.findall(text)
    return next((cells for cells in ways if len(cells) == count), [text])


def _without_comment(
    names: list[str], separator: str, rows: Sequence[str], text: str
) -> tuple[list[str], str]:
    """Names and rows without LabVIEW's column of comments: its first row alone may have one."""
    widths = [len(_cells(row, separator)) for row in rows[:2]]
    if len(names) - 1 not in widths:
        return names, text
    if widths[0] == len(names):
        text = text.replace(rows[0], separator.join(_cells(rows[0], separator)[:-1]), 1)
    return names[:-1], text


def _beginning(text: str, file: Path) -> list[str]:
    """The first lines of a text, its head among them."""
    try:
        _, beginning = next(pieces(text, LINE, "a line"), (1, ""))
    except InputError as error:
        error.file = file
        raise
    return beginning.removesuffix("\n").split("\n")


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
    stem, _, end = base.rpartition("_")
    if stem and end in _UNITS.values():
        units.add(end)
        base = stem
    base = "time" if base in _TIMES else base
    known = {_UNITS.get(text, text) for text in units if text}
    if not known & {*_UNITS.values()}:
        return re.sub(r"\s+", "_", name.strip().lower())
    if len(known) > 1:
        raise InputError(
            "a column has two units", field=name, value=" and ".join(sorted(known)), limit="one"
        )
    return f"{base}_{known.pop()}"


def _labview_units(texts: Sequence[str], head: Sequence[int]) -> list[str]:
    lines = (_cells(texts[n]) for n in head)
    return next((["", *units] for key, *units in lines if key == _LABVIEW_UNITS), [])


def _are_joined(rows: Sequence[str], count: int) -> bool:
    """Whether commas are surely decimal marks and separators in rows.

    A second part that begins with 0, such as 060, is no number of its own.
    """
    cells = [[cell.strip() for cell in row.split(",")] for row in rows]
    if any(len(row) != 2 * count for row in cells):
        return False
    wholes, fractions = ([cell for row in cells for cell in row[part::2]] for part in (0, 1))
    whole = all(re.fullmatch(r"[-+]?\d+", cell) for cell in wholes)
    surely = any(cell[:1] == "0" and len(cell) > 1 for cell in fractions)
    return whole and surely and all(map(str.isdecimal, fractions))


def _head(texts: Sequence[str], used: Sequence[int]) -> tuple[int, bool]:
    """How many used lines are before that of the names, and whether units are below it.

    Names stand before the first two rows of numbers, or are known as those of LabVIEW. Where what
    stands there cannot be names, the first line has them, and the others are rows, of which
    `Table.numbers` says what is wrong.
    """
    used = used[:_LONGEST_HEAD]
    for before, n in enumerate(used):
        if _cells(texts[n])[0].lower() == _LABVIEW_TIME:
            return before, False
    widths = [_width(texts[n]) for n in used]
    usual = max(Counter(filter(None, widths)).items(), key=lambda item: item[1], default=(0, 0))[0]
    numeric = [bool(width) and width == usual for width in widths]
    first = next((k for k in range(len(used)) if all(numeric[k : k + 2])), 0)
    units = first > 1 and _is_units(*(texts[n] for n in used[first - 2 : first]))
    names = first - 1 - units
    if names > 0 and any(map(is_number, _cells(texts[used[names]]))):
        return 0, False
    return max(names, 0), units


def _separator(text: str) -> str:
    return next((mark for mark in (";", "\t") if mark in text), ",")


def _cells(text: str, separator: str = "") -> list[str]:
    return [cell.strip() for cell in text.split(separator or _separator(text))]


def _width(text: str) -> int:
    """How many numbers are in a row of numbers alone, missing ones included; 0 of another line."""
    cells = _cells(text.strip().rstrip(BLANK))
    return len(cells) if all(is_number(cell) or not cell for cell in cells) else 0


def _is_units(names: str, text: str) -> bool:
    """Whether a unit that is known, and no number, stands below as many names."""
    cells = [cell.strip("[]() ") for cell in _cells(text)]
    numeric = any(map(is_number, cells))
    return not numeric and len(cells) == len(_cells(names)) and not _UNITS.keys().isdisjoint(cells)


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

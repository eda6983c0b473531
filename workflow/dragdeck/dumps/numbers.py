"""Numbers from rows of text, and columns from numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dragdeck.arrays import END, NUMBER, quick_columns
from dragdeck.dumps.frame import Columns, is_integer_column

Cells = NDArray[np.float64]
"""Numbers of M columns and N rows, (M, N)."""

COLUMNS_OF_WORDS = ("element", "typelabel")
"""The columns of a dump of LAMMPS or LIGGGHTS that hold words."""

_SHORT_BYTES = 8192
"""Of a shorter text pyarrow takes longer to begin than Python to read it."""


class WrongRow(Exception):
    """A row that is not what it should be: its number from 0, what is wrong, what was expected."""

    def __init__(self, row: int, problem: str, expected: str) -> None:
        self.row, self.problem, self.expected = row, problem, expected
        super().__init__(problem)


_INEXACT = 2**53
"""From here on a float is not each whole number."""


def cells_of_text(text: bytes, width: int) -> Cells:
    """Numbers of whole lines, each of so many: those of Python's ``float``, bit for bit.

    Raises
    ------
    WrongRow
        At the first line that is not so many numbers.
    """
    cells = _quickly(text, width) if len(text) > _SHORT_BYTES else None
    return _one_by_one(text, width) if cells is None else cells


def _quickly(text: bytes, width: int) -> Cells | None:
    layout = [NUMBER] * width
    if text[: text.find(b"\n")].endswith(b" "):  # as the engine writes it: then nothing follows
        layout.append(END)
    columns = quick_columns(text, layout)
    return None if columns is None else np.array(columns)


def _one_by_one(text: bytes, width: int) -> Cells:
    """The numbers in any form that Python reads, but for ``_`` between digits."""
    rows = []
    for row, line in enumerate(text.split(b"\n")[:-1]):
        try:
            numbers = [float(word) for word in line.split()]
        except ValueError:
            numbers = []
        if len(numbers) != width or b"_" in line:
            shown = line[:120] + b"\n"
            raise WrongRow(row, f"found {shown!r}", f"{width} numbers")
        rows.append(numbers)
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(-1, width).T)


def columns_of_words(text: bytes, names: Sequence[str]) -> Columns:
    """Columns by name: strings in the columns that have words, numbers in the others.

    Raises
    ------
    WrongRow
        At the first line that is not so many words, or not a number where one should be.
    """
    rows = [line.split() for line in text.split(b"\n")[:-1]]
    for row, words in enumerate(rows):
        if len(words) != len(names):
            raise WrongRow(row, f"found {b' '.join(words)[:120]!r}", f"{len(names)} words")
    columns: dict[str, Any] = {}
    for place, name in enumerate(names):
        words = [row[place] for row in rows]
        if (first := names.index(name)) < place:
            refuse_unlike(name, np.array([row[first] for row in rows]), np.array(words))
        if name in COLUMNS_OF_WORDS:
            columns[name] = np.array([word.decode("utf-8", "replace") for word in words], object)
        else:
            (cells,) = _one_by_one(b"".join(word + b"\n" for word in words), 1)
            columns[name] = _whole_if_it_is(cells, name)
    return columns


def columns_of_numbers(cells: Cells, names: Sequence[str]) -> Columns:
    """Columns by name as they are: ids as int64 where all are whole."""
    return {name: _whole_if_it_is(cell, name) for name, cell in zip(names, cells, strict=True)}


def refuse_unlike(name: str, first: NDArray[Any], second: NDArray[Any]) -> None:
    """Refuse two columns of one name, (N,), that differ.

    Raises
    ------
    WrongRow
        At the first row in which they do.
    """
    differ = np.flatnonzero((first != second) & ((first == first) | (second == second)))
    if len(differ):
        row = int(differ[0])
        shown = f"{name} is {first[row]} and {second[row]}"
        raise WrongRow(row, shown, "the same value in both columns of that name")


def _whole_if_it_is(column: Cells, name: str) -> Any:
    if not is_integer_column(name):
        return column
    inexact = np.isfinite(column) & (np.abs(column) >= _INEXACT)
    if inexact.any():
        row = int(np.argmax(inexact))
        raise WrongRow(row, f"{name} is {column[row]:.0f}", f"a number below {_INEXACT}")
    try:
        return whole_numbers(column, name)
    except WrongRow:
        return column


def first_rows(text: bytes, count: int) -> bytes:
    """The first lines of a text."""
    return text[: len(text) - len(text.split(b"\n", count)[-1])]


def named_columns(cells: Cells, names: Sequence[str]) -> Columns:
    """Columns by name: ids as int64.

    Raises
    ------
    WrongRow
        At the first number that is not finite, or that is not whole and should be.
    """
    if not np.isfinite(cells).all():
        row, column = np.argwhere(~np.isfinite(cells.T))[0]
        raise WrongRow(int(row), f"{names[column]} is {cells[column, row]}", "a finite number")
    return {
        name: whole_numbers(column, name) if is_integer_column(name) else column
        for name, column in zip(names, cells, strict=True)
    }


def whole_numbers(column: Cells, name: str) -> NDArray[np.int64]:
    """A column, (N,), as int64.

    Raises
    ------
    WrongRow
        At the first number that is not whole.
    """
    with np.errstate(invalid="ignore"):
        whole = column.astype(np.int64)
    if (whole != column).any():
        row = int(np.flatnonzero(whole != column)[0])
        raise WrongRow(row, f"{name} is {column[row]}", "a whole number")
    return whole

"""Array types of every package, numbers of classes, and columns of rows of text."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NUMBER, WHOLE, END, ANY = "float64", "int64", "null", ""
"""What stands at a place of each row, for `quick_columns`: a number, a whole number, nothing, or
any word."""


def class_numbers(particle_id: Ints, first_ids: Sequence[int]) -> Ints:
    """Number of the class, from 0, of (N,) particles, whose ids rise from class to class."""
    return np.searchsorted(first_ids or [1], particle_id, side="right") - 1


def quick_columns(text: bytes, layout: Sequence[str]) -> list[NDArray[Any]] | None:
    """The numbers in rows of words by pyarrow, whose rounding is correct.

    Parameters
    ----------
    text : bytes
        Whole lines, with one space between words.
    layout : sequence of str
        What stands at each place: `NUMBER`, `WHOLE`, `END`, `ANY`, or else this very word.

    Returns
    -------
    list of (N,) arrays, or None
        Of each number and whole number; None if a row is another, or pyarrow is not sure of one.
    """
    import pyarrow as pa
    from pyarrow import compute, csv

    if not text.isascii():
        return None
    kinds = {NUMBER: pa.float64(), WHOLE: pa.int64(), END: pa.null()}
    types = {str(place): kinds.get(kind, pa.string()) for place, kind in enumerate(layout)}
    try:
        table = csv.read_csv(
            pa.BufferReader(text),
            csv.ReadOptions(column_names=list(types)),
            csv.ParseOptions(delimiter=" ", quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(
                column_types=types,
                null_values=[""],
                include_columns=[name for name, kind in zip(types, layout, strict=True) if kind],
            ),
        )
    except pa.ArrowInvalid:
        return None
    if len(table) != text.count(b"\n"):
        return None
    numbers = []
    for kind, column in zip(filter(None, layout), table.columns, strict=True):
        if kind in (NUMBER, WHOLE):
            if column.null_count:
                return None
            numbers.append(column.to_numpy())
        elif kind != END and not compute.all(compute.equal(column, kind)).as_py():
            return None
    return numbers

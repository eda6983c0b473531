"""Array types of every package, numbers of classes, and columns of rows of text."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NUMBER, WHOLE, END, ANY, TEXT = "float64", "int64", "null", "", "string"
"""What stands at a place of each row, for `quick_columns`: a number, a whole number, nothing, any
word, or a word that is wanted itself."""


def class_numbers(particle_id: Ints, first_ids: Sequence[int]) -> Ints:
    """Number of the class, from 0, of (N,) particles, whose ids rise from class to class."""
    return np.searchsorted(first_ids or [1], particle_id, side="right") - 1


def numpy_of(column: Any) -> NDArray[Any]:
    """A column of numbers of pyarrow, (N,), NaN where it has none; its own way imports pandas."""
    parts = [np.empty(0, str(column.type))]
    for chunk in column.chunks:
        valid, values = chunk.buffers()
        part = np.frombuffer(values, str(chunk.type), len(chunk), 8 * chunk.offset)
        if chunk.null_count:
            bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
            part = np.where(bits[chunk.offset : chunk.offset + len(chunk)], part, np.nan)
        parts.append(part)
    return np.concatenate(parts)


def quick_columns(
    text: bytes, layout: Sequence[str], separator: str = " ", quoted: bool = False
) -> list[Any] | None:
    """The numbers in rows of words by pyarrow, whose rounding is correct.

    Parameters
    ----------
    text : bytes
        Whole lines, with one separator between words.
    layout : sequence of str
        What stands at each place: `NUMBER`, `WHOLE`, `END`, `ANY`, `TEXT`, or else this very word.
    separator : str
    quoted : bool
        Whether words may stand in quotation marks.

    Returns
    -------
    list of (N,) arrays, or None
        Of each number and whole number, and of each `TEXT` one of pyarrow; None if a row is
        another, or pyarrow is not sure of one.
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
            csv.ParseOptions(
                delimiter=separator, quote_char='"' if quoted else False, ignore_empty_lines=False
            ),
            csv.ConvertOptions(
                column_types=types,
                null_values=[""],
                strings_can_be_null=TEXT in layout,
                include_columns=[name for name, kind in zip(types, layout, strict=True) if kind],
            ),
        )
    except pa.ArrowInvalid:
        return None
    if len(table) != text.count(b"\n"):
        return None
    numbers = []
    for kind, column in zip(filter(None, layout), table.columns, strict=True):
        if kind == TEXT:
            numbers.append(column)
        elif kind in (NUMBER, WHOLE):
            if column.null_count:
                return None
            numbers.append(numpy_of(column))
        elif kind != END and not compute.all(compute.equal(column, kind)).as_py():
            return None
    return numbers

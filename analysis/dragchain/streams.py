"""Tables read a row group at a time, so that memory does not grow with their length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from dragchain.errors import TableError

PIECE_ROWS = 32_768
"""Rows that come at once: what is computed of them is a multiple of their size."""

Steps = tuple[int, int]
"""The first and the last step to read."""


def read_groups(
    path: Path, columns: Sequence[str], steps: Steps | None = None
) -> Iterator[pd.DataFrame]:
    """Yield the rows of a table that has a column ``step``, a row group or a part of it at a time.

    Parameters
    ----------
    path : Path
        The table.
    columns : sequence of str
        Columns to read, ``step`` among them.
    steps : tuple of int, optional
        First and last step to read; groups without any of them are not read.

    Yields
    ------
    DataFrame
        At least one row each, in the order of the table.

    Raises
    ------
    TableError
        If the table is not there, or lacks a column.
    """
    if not path.is_file():
        raise TableError(f"{path} is not there: run `dragchain tables {path.parent.parent}`")
    with pq.ParquetFile(path) as file:
        if missing := [name for name in columns if name not in file.schema_arrow.names]:
            raise TableError(
                f"{path}: has no column {missing[0]}: it is older than this; make the tables"
                f" again: dragchain tables {path.parent.parent}"
            )
        for group in range(file.num_row_groups):
            if steps is not None and _outside(file, group, steps):
                continue
            table = file.read_row_group(group, columns=list(columns))
            for start in range(0, table.num_rows, PIECE_ROWS):
                rows = table.slice(start, PIECE_ROWS).to_pandas()
                if steps is not None:
                    rows = rows[(rows["step"] >= steps[0]) & (rows["step"] <= steps[1])]
                if len(rows):
                    yield rows
            del table
            pa.default_memory_pool().release_unused()


def _outside(file: pq.ParquetFile, group: int, steps: Steps) -> bool:
    """Whether the statistics of a row group say that it holds none of the steps."""
    row_group = file.metadata.row_group(group)
    columns = (row_group.column(number) for number in range(row_group.num_columns))
    known = next(column.statistics for column in columns if column.path_in_schema == "step")
    if known is None or not known.has_min_max:
        return False
    return bool(known.max < steps[0] or known.min > steps[1])


def read_steps(
    path: Path, columns: Sequence[str], steps: Steps | None = None
) -> Iterator[tuple[int, pd.DataFrame]]:
    """Yield the rows of each step of a table, in the order of the steps.

    Parameters and errors are those of `read_groups`; it is an error too if the table is
    not in the order of its steps.
    """
    held: list[pd.DataFrame] = []
    last: int | None = None
    for rows in read_groups(path, columns, steps):
        step = rows["step"].to_numpy(np.int64)
        if (np.diff(step) < 0).any() or (last is not None and step[0] < last):
            raise TableError(
                f"{path} is not in the order of its steps: make the tables again:"
                f" dragchain tables {path.parent.parent}"
            )
        cuts = np.flatnonzero(np.diff(step)) + 1
        for first, end in zip([0, *cuts], [*cuts, len(step)], strict=True):
            part = rows.iloc[first:end]
            if held and int(step[first]) != last:
                yield _held(held, last)
                held = []
            held.append(part)
            last = int(step[first])
    if held:
        yield _held(held, last)


def _held(parts: list[pd.DataFrame], step: int | None) -> tuple[int, pd.DataFrame]:
    assert step is not None
    return step, parts[0] if len(parts) == 1 else pd.concat(parts, ignore_index=True)

"""Tables read a row group at a time, so that memory does not grow with their length."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby, pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from dragchain.arrays import Ints
from dragchain.errors import TableError

PIECE_ROWS = 32_768
"""Rows that come at once: what is computed of them is a multiple of their size."""

_NUMBER = re.compile("^step$|^(?!input_).*_(n|m|s|j|id|pa|m_s|n_m|rad_s)$")
"""Names of columns that hold numbers, by their units; an input may be a list, as text."""

_NEVER_EMPTY = ("network", "particles", "workpiece_contacts")
"""Tables of a bed with a workpiece in it: they always have rows."""

Steps = tuple[int, int] | Ints
"""What to read: the first and the last step of a stretch, or rising steps, (N,)."""


@contextmanager
def intact(path: Path) -> Iterator[None]:
    """A table to be read within the block, or say which command makes it.

    Raises
    ------
    TableError
        If the file is not there or is damaged, or lacks a column that is asked for.
    """
    if not path.is_file():
        raise TableError(f"{path} is missing: run `{_command(path)}`")
    try:
        metadata = pq.read_metadata(path)
        if path.stem in _NEVER_EMPTY and metadata.num_rows == 0:
            raise pa.ArrowInvalid("it has no rows")
        for field in metadata.schema.to_arrow_schema():
            if field.type in (pa.string(), pa.large_string()) and _NUMBER.search(field.name):
                raise pa.ArrowTypeError(f"column {field.name} contains text instead of numbers")
        yield
    except (pa.ArrowException, OSError) as error:
        raise TableError(
            f"{path} is damaged or was made by an older version ({error}): make it again: "
            f"`{_command(path)}`"
        ) from error


_MADE_BY = {
    **dict.fromkeys(("network", "chains", "clusters"), "chains"),
    **dict.fromkeys(("facets", "contact_events"), "loading"),
}
"""The command that makes a table of a run, where it is not ``tables``."""


def _command(path: Path) -> str:
    """The command that makes a table, which is in a folder of a run or the report of a study."""
    folder = path.parent.parent
    if path.stem == "summary":
        return f"./run report --config study={folder.name}"
    return f"./run dragchain {_MADE_BY.get(path.stem, 'tables')} {folder}"


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
    steps : (int, int) or (N,) ndarray of int, optional
        First and last step to read, or rising steps; groups without any of them are not read.

    Yields
    ------
    DataFrame
        At least one row each, in the order of the table.

    Raises
    ------
    TableError
        If the table is not there, or lacks a column.
    """
    for group in _groups(path, columns, steps):
        for start in range(0, group.num_rows, PIECE_ROWS):
            rows = group.slice(start, PIECE_ROWS).to_pandas()
            if steps is not None:
                step = rows["step"].to_numpy(np.int64)
                rows = rows[_any_between(steps, step, step)]
            if len(rows):
                yield rows
        del group


def _groups(path: Path, columns: Sequence[str], steps: Steps | None) -> Iterator[pa.Table]:
    """Yield the row groups that may hold rows of the steps; none is held here."""
    with intact(path), pq.ParquetFile(path) as file:
        if missing := [name for name in columns if name not in file.schema_arrow.names]:
            raise TableError(
                f"{path}: column {missing[0]} is missing: an older version made the table;"
                f" make it again: {_command(path)}"
            )
        for number in range(file.num_row_groups):
            if steps is None or _may_hold(file, number, steps):
                yield file.read_row_group(number, columns=list(columns))
                pa.default_memory_pool().release_unused()


def _may_hold(file: pq.ParquetFile, group: int, steps: Steps) -> bool:
    """Whether the statistics of a row group leave it open that it holds one of the steps."""
    row_group = file.metadata.row_group(group)
    columns = (row_group.column(number) for number in range(row_group.num_columns))
    known = next(column.statistics for column in columns if column.path_in_schema == "step")
    if known is None or not known.has_min_max:
        return True
    return bool(_any_between(steps, known.min, known.max))


def _any_between(steps: Steps, low: int | Ints, high: int | Ints) -> Any:
    """Whether one of the steps is from `low` to `high`, both int or both (N,) of int."""
    if isinstance(steps, tuple):
        return (high >= steps[0]) & (low <= steps[1])
    return np.searchsorted(steps, low) < np.searchsorted(steps, high, side="right")


def read_steps(
    path: Path, columns: Sequence[str], steps: Steps | None = None
) -> Iterator[tuple[int, pd.DataFrame]]:
    """Yield the rows of each step of a table, in the order of the steps.

    Parameters and errors are those of `read_groups`; it is an error too if the row groups read
    are not in the order of their steps.
    """
    for step, pieces in groupby(_stretches(path, columns, steps), key=itemgetter(0)):
        if steps is None or _any_between(steps, step, step):
            yield step, pa.concat_tables([rows for _, rows in pieces]).to_pandas()


def _stretches(
    path: Path, columns: Sequence[str], steps: Steps | None
) -> Iterator[tuple[int, pa.Table]]:
    """Yield the stretches of one step within each row group, whose order is checked first."""
    last = np.empty(0, dtype=np.int64)
    for group in _groups(path, columns, steps):
        step = group["step"].to_numpy()
        last = _last_of_rising(path, np.concatenate([last, step]))
        starts = np.flatnonzero(np.diff(step, prepend=step[:1] - 1))
        for start, end in pairwise([*starts.tolist(), step.size]):
            yield int(step[start]), group.slice(start, end - start)
        del group


def _last_of_rising(path: Path, step: Ints) -> Ints:
    """The last of steps that do not fall, (1,), or none of none."""
    falls = np.flatnonzero(np.diff(step) < 0)
    if falls.size:
        before, after = step[falls[0] :][:2]
        raise TableError(
            f"{path} is not sorted by step: step {after} follows step {before}:"
            f" make the tables again: {_command(path)}"
        )
    return step[-1:]


class RisingSteps:
    """The rows of a table at steps that rise, found while it is read; see `read_steps`.

    Parameters
    ----------
    path : Path
        The table.
    columns : sequence of str
        Columns to read, ``step`` among them.
    steps : (int, int) or (N,) ndarray of int, optional
        First and last step that will be asked for, or all of them.

    Raises
    ------
    TableError
        As `read_steps` does, here or later.
    """

    def __init__(self, path: Path, columns: Sequence[str], steps: Steps | None = None) -> None:
        self._frames = read_steps(path, columns, steps)
        self._next = next(self._frames, None)
        with intact(path):
            none = pq.read_schema(path).empty_table().select(columns)
        self._none: pd.DataFrame = none.to_pandas()

    def at(self, step: int) -> pd.DataFrame:
        """Rows of a step above the last one asked for; maybe none."""
        while self._next is not None and self._next[0] < step:
            self._next = None  # its memory is free before the next step is read
            self._next = next(self._frames, None)
        return self._none if self._next is None or self._next[0] > step else self._next[1]

    def finish(self) -> None:
        """Read what is left, so that a step out of order is found."""
        for _ in self._frames:
            pass


def read_table(path: Path, columns: list[str] | None = None) -> pd.DataFrame:
    """Read a table, or say which command makes it.

    Raises
    ------
    TableError
        If the file is not there or damaged.
    """
    with intact(path):
        return pd.read_parquet(path, columns=columns)

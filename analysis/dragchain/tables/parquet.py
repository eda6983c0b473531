"""Parquet tables that are either whole or not there, and any dump of LIGGGHTS as such a table."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from dragchain.tables.columns import described
from dragdeck.dumps.frame import is_integer_column
from dragdeck.dumps.reader import dump_files, layout_of, read_frames
from dragdeck.errors import DumpError
from dragdeck.files import draft_of

GROUP_ROWS = 131_072
"""Rows of a row group: what a table holds in memory while it is written."""

_CATEGORY = pa.dictionary(pa.int8(), pa.string())
"""Type of a column that holds one of a few texts."""

Rows = Mapping[str, NDArray[Any] | pa.Array]
"""Rows of a table: every column's values by its name, all of one length."""


def category(codes: Any, labels: tuple[str, ...]) -> pa.Array:
    """Make a dictionary column from indices into `labels`, shape (N,)."""
    indices = pa.array(codes, type=pa.int8())
    return pa.DictionaryArray.from_arrays(indices, pa.array(labels, type=pa.string()))


def column_type(name: str) -> pa.DataType:
    """Tell a column's type by its name: ids int64, labels text, flags bool, else float64."""
    if name in ("phase", "kind", "class", "a_class", "b_class"):
        return _CATEGORY
    if name == "in_statistics":
        return pa.bool_()
    if name == "impact" or is_integer_column(name):
        return pa.int64()
    return pa.float64()


def _schema(columns: Sequence[str]) -> pa.Schema:
    """The schema of a table whose columns are never empty."""
    return pa.schema([pa.field(name, column_type(name), nullable=False) for name in columns])


def _encodings(schema: pa.Schema) -> dict[str, object]:
    """How the columns are stored: options of a Parquet writer that change no value.

    Whole numbers rise slowly or stay: differences. Bytes of like weight of neighbouring
    floats are alike, while their values rarely come twice: byte stream split. Labels and
    radii are few: dictionaries.
    """
    split = {pa.int64(): "DELTA_BINARY_PACKED", pa.float64(): "BYTE_STREAM_SPLIT"}
    labels = (_CATEGORY, pa.string(), pa.large_string())
    few = [field.name for field in schema if field.type in labels or field.name == "radius_m"]
    return {
        "compression": "zstd",
        "use_dictionary": few,
        "column_encoding": {
            field.name: split[field.type]
            for field in schema
            if field.type in split and field.name not in few
        },
    }


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write a table that appears under its name only once it is whole."""
    with table_writer(path) as writer:
        writer.write(table)


@contextmanager
def table_writer(file: Path, columns: Sequence[str] = ()) -> "Iterator[TableWriter]":
    """A table that is written part by part and appears under its name only once it is whole.

    The metadata of the columns that ``columns.csv`` describes have their unit and description.

    If the block ends in an exception, nothing is left behind, and an older table of that name
    stays as it was.

    Parameters
    ----------
    file : Path
        The table's final name; its folder is made if need be.
    columns : sequence of str, optional
        Its columns in order; `column_type` gives their types. A table of data frames has the
        columns and types of its first row group.
    """
    schema = _schema(columns) if columns else None
    with draft_of(file) as draft, ThreadPoolExecutor(1) as thread:
        writer = TableWriter(draft, file.stem, schema, thread)
        try:
            yield writer
            writer.finish()
        finally:
            writer.close()


class TableWriter:
    """Collects rows into row groups, which a thread of its own writes; see `table_writer`.

    Memory does not grow with the table: it holds no more than a row group and the last part.
    """

    def __init__(
        self, draft: Path, name: str, schema: pa.Schema | None, thread: ThreadPoolExecutor
    ) -> None:
        self.rows = 0
        self._draft, self._name, self._schema, self._thread = draft, name, schema, thread
        self._parts: list[pa.Table | pd.DataFrame] = []
        self._held = 0
        self._writer: pq.ParquetWriter | None = None
        self._writing: Future[None] | None = None

    def write(self, rows: Rows | pd.DataFrame) -> None:
        """Append rows: data frames always, or always columns."""
        self._parts.append(rows if isinstance(rows, pd.DataFrame) else self._table(rows))
        self._held += len(self._parts[-1])
        if self._held >= GROUP_ROWS:
            self._flush()

    def finish(self) -> None:
        """Write the rows that are left."""
        if self._parts:
            self._flush()
        self._wait()
        self._open()

    def close(self) -> None:
        """Close the draft."""
        self._thread.shutdown()
        if self._writer is not None:
            self._writer.close()

    def _table(self, columns: Rows) -> pa.Table:
        assert self._schema is not None, "a table of columns needs their names"
        arrays = [pa.array(columns[field.name], field.type) for field in self._schema]
        return pa.Table.from_arrays(arrays, schema=self._schema)

    def _open(self) -> pq.ParquetWriter:
        if self._writer is None:
            schema = described(self._schema, self._name)
            self._writer = pq.ParquetWriter(self._draft, schema, **_encodings(schema))
        return self._writer

    def _flush(self) -> None:
        self._wait()
        group = self._group()
        write = self._open().write_table
        self._writing = self._thread.submit(write, group, row_group_size=max(self._held, 1))
        self.rows += self._held
        self._parts, self._held = [], 0

    def _group(self) -> pa.Table:
        if isinstance(self._parts[0], pa.Table):
            return pa.concat_tables(self._parts).combine_chunks()
        rows = pd.concat(self._parts, ignore_index=True)
        group = pa.Table.from_pandas(rows, self._schema, preserve_index=False)
        self._schema = group.schema
        return group

    def _wait(self) -> None:
        if self._writing is not None:
            self._writing.result()
        self._writing = None


def dump_to_parquet(
    source: Path | str, target: Path | str, columns: Sequence[str] | None = None
) -> int:
    """Convert a dump to one Parquet table, frame by frame.

    Parameters
    ----------
    source : Path or str
        As in `read_dump`.
    target : Path or str
        Parquet file to write, with the column ``step`` and those of the dump.

    Returns
    -------
    int
        The number of frames.

    Raises
    ------
    TruncatedDumpError, DumpError
        As in `read_dump`. The table then contains the frames before the error.
    """
    files = dump_files(source)
    output = layout_of(files[0], columns)
    frames, broken = 0, None
    with table_writer(Path(target), ("step", *output.columns)) as table:
        try:
            for frame in read_frames(files, output):
                table.write({"step": np.full(frame.rows, frame.step), **frame.columns})
                frames += 1
        except DumpError as error:
            broken = error
    if broken is not None:
        broken.kept = f"{frames} frames, which are in {target}"
        raise broken
    return frames

"""Parquet tables that are either whole or not there."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from dragchain.dumps.frame import is_integer_column
from dragchain.files import draft_of

GROUP_ROWS = 131_072
"""Rows of a row group: what a table holds in memory while it is written."""


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write a table that appears under its name only once it is whole."""
    with draft_of(path) as draft:
        table.to_parquet(draft, index=False)


class TableParts:
    """A table that is written part by part and appears under its name only once it is whole.

    Use it as a context manager. It holds no more than `GROUP_ROWS` rows and the last part. If the
    block ends in an exception, nothing is left behind.

    Parameters
    ----------
    path : Path
        The table's final name.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._draft = path.with_name(path.name + ".part")
        self._parts: list[pd.DataFrame] = []
        self._writer: Any = None

    def __enter__(self) -> Self:
        """Begin; the file is there with the first rows."""
        return self

    def write(self, part: pd.DataFrame) -> None:
        """Append the rows of a part."""
        self._parts.append(part)
        if sum(map(len, self._parts)) >= GROUP_ROWS:
            self._flush()

    def _flush(self) -> None:
        if not self._parts:
            return
        rows = pd.concat(self._parts, ignore_index=True)
        schema = None if self._writer is None else self._writer.schema
        table = pa.Table.from_pandas(rows, schema, preserve_index=False)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._draft, table.schema)
        self._writer.write_table(table)
        self._parts = []

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put the draft in the table's place, or remove it after an exception."""
        try:
            if kind is None:
                self._flush()
            if self._writer is not None:
                self._writer.close()
            if kind is None:
                self._draft.replace(self._path)
        finally:
            self._draft.unlink(missing_ok=True)


CATEGORY = pa.dictionary(pa.int8(), pa.string())
"""Type of a column that holds one of a few texts."""

_FEW = ("radius_m",)


def table_schema(columns: Mapping[str, pa.DataType]) -> pa.Schema:
    """Make the schema of a table whose columns are never empty."""
    return pa.schema([pa.field(name, kind, nullable=False) for name, kind in columns.items()])


def column_type(name: str) -> pa.DataType:
    """Tell a column's type by its name: ids int64, labels text, flags bool, else float64."""
    if name in ("phase", "kind"):
        return CATEGORY
    if name == "in_statistics":
        return pa.bool_()
    if name == "impact" or is_integer_column(name):
        return pa.int64()
    return pa.float64()


def encodings(schema: pa.Schema) -> dict[str, Any]:
    """How the columns are stored: options of a Parquet writer that change no value.

    Whole numbers rise slowly or stay: differences. Bytes of like weight of neighbouring
    floats are alike, while their values rarely come twice: byte stream split. Labels and
    radii are few: dictionaries.
    """
    few = [field.name for field in schema if field.type == CATEGORY or field.name in _FEW]
    split = {pa.int64(): "DELTA_BINARY_PACKED", pa.float64(): "BYTE_STREAM_SPLIT"}
    return {
        "compression": "zstd",
        "use_dictionary": few,
        "column_encoding": {
            field.name: split[field.type]
            for field in schema
            if field.type in split and field.name not in few
        },
    }


class TableWriter:
    """A Parquet file that appears under its name only once it is whole.

    Use it as a context manager. Rows are collected into row groups, which a thread of
    its own writes, so memory does not grow with the table. If the block ends in an
    exception, nothing is left behind, and an older table of that name stays as it was.

    Parameters
    ----------
    file : Path
        The table's final name; its folder is made if need be.
    columns : sequence of str
        Its columns in order; `column_type` gives their types.
    """

    def __init__(self, file: Path, columns: tuple[str, ...]) -> None:
        self.file = file
        self.schema = table_schema({name: column_type(name) for name in columns})
        self.rows = 0
        self._temporary = file.with_name(f".{file.name}.{os.getpid()}.tmp")
        self._parts: dict[str, list[Any]] = {name: [] for name in columns}
        self._held = 0
        self._thread = ThreadPoolExecutor(1)
        self._writing: Future[None] | None = None

    def __enter__(self) -> Self:
        """Open the temporary file."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        self._writer = pq.ParquetWriter(self._temporary, self.schema, **encodings(self.schema))
        return self

    def write(self, columns: Mapping[str, Any]) -> None:
        """Append rows; `columns` maps every column's name to an array of one length."""
        parts = {name: columns[name] for name in self._parts}
        lengths = {len(part) for part in parts.values()}
        if len(lengths) != 1:
            raise ValueError(f"{self.file}: columns of unequal lengths {sorted(lengths)}")
        rows = lengths.pop()
        if rows == 0:
            return
        for name, part in parts.items():
            self._parts[name].append(part)
        self._held += rows
        if self._held >= GROUP_ROWS:
            self._flush()

    def _flush(self) -> None:
        self._wait()
        if self._held:
            arrays = [_joined(self._parts[field.name], field.type) for field in self.schema]
            table = pa.Table.from_arrays(arrays, schema=self.schema)
            self._writing = self._thread.submit(
                self._writer.write_table, table, row_group_size=self._held
            )
        self.rows += self._held
        self._parts, self._held = {name: [] for name in self._parts}, 0

    def _wait(self) -> None:
        if self._writing is not None:
            self._writing.result()
        self._writing = None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the file its name, or remove it after an exception."""
        try:
            if kind is None:
                self._flush()
            self._thread.shutdown()
            self._writer.close()
            if kind is None:
                self._wait()
                os.replace(self._temporary, self.file)
        finally:
            self._temporary.unlink(missing_ok=True)


def _joined(parts: list[Any], kind: pa.DataType) -> pa.Array:
    """One column of parts that are arrays of either library."""
    if kind == CATEGORY:
        return pa.concat_arrays(parts)
    return pa.array(np.concatenate(parts), type=kind)


def category(codes: Any, labels: tuple[str, ...]) -> pa.Array:
    """Make a dictionary column from indices into `labels`, shape (N,)."""
    indices = pa.array(codes, type=pa.int8())
    return pa.DictionaryArray.from_arrays(indices, pa.array(labels, type=pa.string()))

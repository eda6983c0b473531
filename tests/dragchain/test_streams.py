"""Tables read a row group at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dragchain.errors import TableError
from dragchain.streams import read_groups, read_steps

TABLE = pd.DataFrame({"x_m": np.arange(8.0), "step": [0, 0, 10, 10, 10, 30, 40, 40]})


def written(folder: Path, rows: pd.DataFrame = TABLE, group: int = 3) -> Path:
    file = folder / "t.parquet"
    pq.write_table(pa.Table.from_pandas(rows, preserve_index=False), file, row_group_size=group)
    return file


@pytest.mark.parametrize("group", [1, 2, 3, 8])
def test_a_step_is_whole_wherever_row_groups_end(tmp_path: Path, group: int) -> None:
    found = {
        step: rows["x_m"].tolist()
        for step, rows in read_steps(written(tmp_path, group=group), ["step", "x_m"])
    }
    assert found == {0: [0.0, 1.0], 10: [2.0, 3.0, 4.0], 30: [5.0], 40: [6.0, 7.0]}


def test_only_the_steps_asked_for_come(tmp_path: Path) -> None:
    rows = pd.concat(read_groups(written(tmp_path), ["step", "x_m"], (10, 30)))
    assert rows["x_m"].tolist() == [2.0, 3.0, 4.0, 5.0]


def test_groups_without_such_steps_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []
    real = pq.ParquetFile.read_row_group

    def noted(self: pq.ParquetFile, group: int, **options: object) -> pa.Table:
        read.append(group)
        return real(self, group, **options)

    monkeypatch.setattr(pq.ParquetFile, "read_row_group", noted)
    assert len(list(read_steps(written(tmp_path), ["step", "x_m"], (30, 30)))) == 1
    assert read == [1]


def test_a_table_out_of_order_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, TABLE.iloc[[0, 5, 2]])
    with pytest.raises(TableError, match="not in the order of its steps"):
        list(read_steps(file, ["step", "x_m"]))


def test_order_holds_across_groups_too(tmp_path: Path) -> None:
    file = written(tmp_path, TABLE.iloc[[5, 2]], group=1)
    with pytest.raises(TableError, match="not in the order of its steps"):
        list(read_steps(file, ["step", "x_m"]))


def test_a_missing_table_or_column_is_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="run `dragchain tables"):
        next(read_groups(tmp_path / "tables" / "t.parquet", ["step"]))
    with pytest.raises(TableError, match="no column y_m"):
        next(read_groups(written(tmp_path), ["step", "y_m"]))

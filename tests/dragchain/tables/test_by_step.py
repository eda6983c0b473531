"""Tables read a row group at a time."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dragchain.errors import TableError
from dragchain.tables.by_step import RisingSteps, Steps, read_groups, read_steps, read_table

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


STRETCH_OR_STEPS = [
    ((10, 30), [0, 1], [10, 30]),
    ((11, 29), [1], []),
    ((30, 30), [1], [30]),
    ((41, 99), [], []),
    (np.array([0, 40]), [0, 2], [0, 40]),
    (np.array([0, 20, 50]), [0, 1], [0]),
    (np.array([5, 35]), [0], []),
    (np.array([50]), [], []),
    (np.array([], dtype=np.int64), [], []),
]


@pytest.mark.parametrize(("steps", "groups", "found"), STRETCH_OR_STEPS)
def test_only_the_steps_asked_for_come_and_groups_without_them_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, steps: Steps, groups: list[int], found: list
) -> None:
    read: list[int] = []
    real = pq.ParquetFile.read_row_group

    def noted(self: pq.ParquetFile, group: int, **options: object) -> pa.Table:
        read.append(group)
        return real(self, group, **options)

    monkeypatch.setattr(pq.ParquetFile, "read_row_group", noted)
    file = written(tmp_path)
    expected = TABLE.loc[TABLE["step"].isin(found), "x_m"].tolist()
    by_step = list(read_steps(file, ["step", "x_m"], steps))
    assert [step for step, _ in by_step] == found
    assert [x for _, rows in by_step for x in rows["x_m"]] == expected
    assert read == groups
    by_group = read_groups(file, ["step", "x_m"], steps)
    assert [x for rows in by_group for x in rows["x_m"]] == expected
    assert read == 2 * groups


def test_a_group_without_statistics_is_read(tmp_path: Path) -> None:
    file = tmp_path / "t.parquet"
    rows = pa.Table.from_pandas(TABLE, preserve_index=False)
    pq.write_table(rows, file, row_group_size=3, write_statistics=False)
    assert [step for step, _ in read_steps(file, ["step"], (30, 40))] == [30, 40]


def test_labels_stay_categories_where_groups_have_others(tmp_path: Path) -> None:
    kinds = [pa.array([kind]).dictionary_encode() for kind in "bac"]
    tables = [pa.table({"step": [1], "kind": kind}) for kind in kinds]
    with pq.ParquetWriter(tmp_path / "t.parquet", tables[0].schema) as writer:
        for table in tables:
            writer.write_table(table)
    ((_, found),) = read_steps(tmp_path / "t.parquet", ["step", "kind"])
    assert found["kind"].tolist() == ["b", "a", "c"]
    assert isinstance(found["kind"].dtype, pd.CategoricalDtype)


@pytest.mark.parametrize("group", [1, 3, 8])
def test_rising_steps_have_their_rows_or_none(tmp_path: Path, group: int) -> None:
    rows = RisingSteps(written(tmp_path, group=group), ["step", "x_m"])
    assert rows.at(-1).empty
    assert rows.at(10)["x_m"].tolist() == [2.0, 3.0, 4.0]
    none = rows.at(20)
    assert none.empty
    assert none.dtypes.to_dict() == {"step": np.int64, "x_m": np.float64}
    assert rows.at(40)["x_m"].tolist() == [6.0, 7.0]
    assert rows.at(41).empty


def test_the_rest_of_rising_steps_is_checked_at_the_end(tmp_path: Path) -> None:
    rows = RisingSteps(written(tmp_path, TABLE.iloc[[0, 2, 5, 4]], group=3), ["step", "x_m"])
    assert rows.at(0)["x_m"].tolist() == [0.0]
    with pytest.raises(TableError, match="step 10 follows step 30: make the tables again"):
        rows.finish()


def test_a_table_out_of_order_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, TABLE.iloc[[0, 5, 2]])
    with pytest.raises(TableError, match="not sorted by step"):
        list(read_steps(file, ["step", "x_m"]))


def test_order_holds_across_groups_too(tmp_path: Path) -> None:
    file = written(tmp_path, TABLE.iloc[[5, 2]], group=1)
    with pytest.raises(TableError, match="not sorted by step"):
        list(read_steps(file, ["step", "x_m"]))


def test_a_missing_table_or_column_is_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"`\./run dragchain tables"):
        next(read_groups(tmp_path / "tables" / "t.parquet", ["step"]))
    with pytest.raises(TableError, match="column y_m is missing"):
        next(read_groups(written(tmp_path), ["step", "y_m"]))


def test_text_instead_of_numbers_is_named(tmp_path: Path) -> None:
    file = tmp_path / "tables/contacts.parquet"
    file.parent.mkdir()
    pd.DataFrame({"step": [1], "phase": ["drag"], "force_n": ["a"]}).to_parquet(file)
    with pytest.raises(TableError, match=r"contacts\.parquet .*column force_n contains text"):
        read_table(file)

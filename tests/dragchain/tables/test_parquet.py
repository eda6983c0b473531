from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from spoilt_dumps import NAMES, ROWS, SPOILT, text

from dragchain.tables.parquet import (
    GROUP_ROWS,
    category,
    column_type,
    dump_to_parquet,
    table_writer,
)
from dragdeck.documents import Document
from dragdeck.errors import DumpError


def test_a_columns_name_tells_its_type() -> None:
    assert column_type("particle_id") == pa.int64()
    assert column_type("step") == pa.int64()
    assert column_type("drag_n") == pa.float64()
    assert column_type("in_statistics") == pa.bool_()
    assert pa.types.is_dictionary(column_type("kind"))


def test_rows_come_back_in_order(tmp_path: Path) -> None:
    file = tmp_path / "tables" / "t.parquet"
    with table_writer(file, ("step", "phase", "x_m")) as table:
        table.write({"step": [1, 2], "phase": category([0, 1], ("a", "b")), "x_m": [0.5, 1.5]})
        table.write({"step": [], "phase": category([], ("a", "b")), "x_m": []})
        table.write({"step": [3], "phase": category([1], ("a", "b")), "x_m": np.array([2.5])})
    read = pq.read_table(file).to_pandas()
    assert read["step"].tolist() == [1, 2, 3]
    assert read["phase"].tolist() == ["a", "b", "b"]
    assert read["x_m"].tolist() == [0.5, 1.5, 2.5]


def test_an_empty_table_has_its_columns(tmp_path: Path) -> None:
    with table_writer(tmp_path / "t.parquet", ("step", "x_m")):
        pass
    read = pq.read_table(tmp_path / "t.parquet")
    assert (read.num_rows, read.column_names) == (0, ["step", "x_m"])


def test_rows_are_written_while_they_come(tmp_path: Path) -> None:
    block = {"step": np.arange(GROUP_ROWS // 2 + 1)}
    with table_writer(tmp_path / "t.parquet", ("step",)) as table:
        for _ in range(5):
            table.write(block)
        assert table.rows == 2 * 2 * len(block["step"])
    assert pq.ParquetFile(tmp_path / "t.parquet").num_row_groups == 3


def test_a_failure_leaves_the_older_table_and_no_other_file(tmp_path: Path) -> None:
    file = tmp_path / "t.parquet"
    with table_writer(file, ("step",)) as table:
        table.write({"step": [1]})
    with pytest.raises(RuntimeError), table_writer(file, ("step",)) as table:
        table.write({"step": [2]})
        raise RuntimeError
    assert pq.read_table(file)["step"].to_pylist() == [1]
    assert [path.name for path in tmp_path.iterdir()] == ["t.parquet"]


class One(Document):
    b: float


def test_json_has_no_nan_and_leaves_no_half_file(tmp_path: Path) -> None:
    One(b=1.5).write(tmp_path / "a.json")
    with pytest.raises(ValueError, match="finite number"):
        One(b=float("nan")).write(tmp_path / "a.json")
    assert (tmp_path / "a.json").read_text() == '{\n "schema": 2,\n "b": 1.5\n}\n'
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_table_of_all_frames(tmp_path: Path) -> None:
    (tmp_path / "a.dump").write_bytes(text())
    assert dump_to_parquet(tmp_path / "a.dump", tmp_path / "a.parquet") == 4
    table = pq.read_table(tmp_path / "a.parquet")
    assert table.column_names == ["step", *NAMES]
    assert table["step"].to_pylist() == [0, 0, 0, 14, 21, 21]
    assert table["id"].to_pylist() == [3, 1, 2, 1, 2, 1]
    written = [float(f"{row[1]:.9g}") for rows in ROWS.values() for row in rows]
    assert table["x"].to_pylist() == written


def test_a_table_of_the_frames_before_damage(tmp_path: Path) -> None:
    _, damaged, _ = SPOILT["a word"]
    (tmp_path / "a.dump").write_bytes(text([0, 7]) + damaged)
    table = tmp_path / "a.parquet"
    with pytest.raises(DumpError, match=f"row 0.*\n.*\n  kept:   2 frames, which are in {table}"):
        dump_to_parquet(tmp_path / "a.dump", table)
    assert pq.read_table(table)["step"].to_pylist() == [0, 0, 0]

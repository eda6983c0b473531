from pathlib import Path

import pytest

from dragchain import TableError
from dragchain.drag.force import read_counted


def test_missing_tables_are_named(tmp_path: Path) -> None:
    with pytest.raises(
        TableError, match=r"workpiece_force\.parquet is missing: run `dragchain tables"
    ):
        read_counted(tmp_path)

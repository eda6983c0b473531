import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from finished_runs import write_finished_run
from loading_files import made_contacts, write_run
from made_run import Raw
from report_files import (
    ASKED,
    DROP,
    FILLING,
    PICTURES,
    case_json,
    make_run,
    process_findings,
    write_quantities,
)
from tiny_run_files import RADIUS_M
from tiny_run_files import case_json as tiny_case

from dragchain import write_tables
from dragchain.loading.samples import BODY as BODY_IMPULSE
from dragchain.loading.write import write_loading
from dragchain.report.study_report import write_study_report
from dragchain.tables import parquet
from dragchain.tables.columns import ATTRACTION, BODY, columns_of, descriptions, unit_of

TABLES = (
    *("workpiece_force", "workpiece_contacts", "particles", "contacts", "network", "chains"),
    *("clusters", "facets", "contact_events", "impacts", "thermo", "summary"),
)
SOME_RUNS_ONLY = {*BODY, *BODY_IMPULSE, ATTRACTION, "fastest_particle_m_s"}
"""Columns of workpieces that spin or attract, and one that the small run does not write."""


def write_drop(folder: Path) -> None:
    """A drop test with one impact and its table."""
    folder.mkdir()
    columns = ["step", "time_s", "z_m", "vz_m_s", "force_n"]
    impacts = {
        "kind": "print", "binary": False, "pattern": "impacts.{part}.txt", "columns": columns,
        "engine_columns": None, "period_steps": 1, "first_step": 0, "last_step": None,
    }  # fmt: skip
    case = tiny_case() | {"scene": "drop_test", "phases": [], "restitution": 0.68}
    (folder / "case.json").write_text(json.dumps(case))
    (folder / "columns.json").write_text(json.dumps({"schema": 2, "outputs": {"impacts": impacts}}))
    rows = [[10, 0.01, RADIUS_M, -4, 0], [11, 0.011, 0, 0, 9], [12, 0.012, RADIUS_M, 3, 0]]
    (folder / "impacts.1.txt").write_bytes(Raw.prints(rows, columns))
    write_tables(folder)


def write_summary(results: Path) -> None:
    """A report on a process run with its filling and its drop test."""
    make_run(results, case_json("filling", "filling-1"), FILLING, [])
    make_run(results, case_json("drop_test", "drop-1"), DROP, ["drop_test"])
    upstream = {"filling": "filling-1", "drop_test": "drop-1"}
    case = case_json("process", "workpiece-1", upstream=upstream, asked=ASKED)
    run = make_run(results, case, process_findings(), PICTURES)
    write_quantities(run, corrected=0.8)
    made = write_run(results / "made", made_contacts())
    write_loading(made)
    (run / "tables/loading.json").write_bytes((made / "tables/loading.json").read_bytes())
    shutil.rmtree(made)
    write_study_report(results / "report", [run])


def write_all(folder: Path) -> dict[str, Path]:
    """All tables of a small study, by name."""
    write_finished_run(folder / "process")
    write_drop(folder / "drop")
    write_summary(folder / "results")
    return {file.stem: file for file in folder.rglob("*.parquet")}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_all(tmp_path_factory.mktemp("described"))


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same tables without units and descriptions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parquet, "described", lambda schema, table: schema)
        return write_all(tmp_path_factory.mktemp("bare"))


def metadata(field: pa.Field) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}


@pytest.mark.parametrize("table", TABLES)
def test_every_column_has_a_unit_and_a_description(files: dict[str, Path], table: str) -> None:
    for field in pq.read_schema(files[table]):
        found = metadata(field)
        assert len(found["description"]) > 5, field.name
        assert found["unit"] == unit_of(field)
        assert found["unit"] or not pa.types.is_floating(field.type), field.name


@pytest.mark.parametrize("table", TABLES)
def test_every_described_column_is_in_its_table(files: dict[str, Path], table: str) -> None:
    plain = {name for name in columns_of(table) if "*" not in name}
    names = set(pq.read_schema(files[table]).names)
    of_wakes = {name for name in plain if "wake" in descriptions(name)[table]}
    assert plain - names <= (of_wakes if table == "summary" else SOME_RUNS_ONLY)


@pytest.mark.parametrize("table", TABLES)
def test_the_data_are_those_without_metadata(
    files: dict[str, Path], bare: dict[str, Path], table: str
) -> None:
    ours, theirs = pq.read_table(files[table]), pq.read_table(bare[table])
    assert not any("unit" in metadata(field) for field in theirs.schema)
    assert ours.schema.equals(theirs.schema, check_metadata=False)
    assert ours.schema.metadata == theirs.schema.metadata
    one, other = (pd.read_parquet(where[table]) for where in (files, bare))
    pd.testing.assert_frame_equal(one, other, check_exact=True)
    assert _bytes(ours) == _bytes(theirs)


def _bytes(table: pa.Table) -> list[Any]:
    """The buffers of all columns: equal only if every bit is."""
    chunks = [chunk for column in table.columns for chunk in column.chunks]
    return [buffer and buffer.to_pybytes() for chunk in chunks for buffer in chunk.buffers()]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(("drag_n", "N"), ("torque_x_n_m", "N m"), ("normal_impulse_n_s", "N s")),
        *(("slip_x_m_s", "m/s"), ("wx_rad_s", "rad/s"), ("steps_per_s", "1/s")),
        *(("depth_slope_n_per_m", "N/m"), ("area_m2", "m2"), ("force_slide_n_m_se", "N m")),
        *(("input_gravity_m_s2", "m/s2"), ("extrapolated_friction_work_j_per_m", "J/m")),
        *(("coordination_number", "1"), ("direction_rad", "rad"), ("drag_against_x_percent", "%")),
    ],
)
def test_the_end_of_a_name_is_its_unit(name: str, unit: str) -> None:
    assert unit_of(pa.field(name, pa.float64())) == unit


@pytest.mark.parametrize(
    ("name", "type_"),
    [
        *(("particle_id", pa.int64()), ("kind", pa.dictionary(pa.int8(), pa.string()))),
        *(("dominant", pa.bool_()), ("particle_ids", pa.list_(pa.int64()))),
    ],
)
def test_what_is_no_number_has_no_unit(name: str, type_: pa.DataType) -> None:
    assert unit_of(pa.field(name, type_)) == ""


def test_a_meaning_depends_on_the_table() -> None:
    found = descriptions("azimuth_rad")
    assert set(found) == {"workpiece_contacts", "chains", "contact_events"}
    assert len(set(found.values())) == 3
    assert "input_" in descriptions("input_media_count")["summary"]
    assert "lower end" in descriptions("extrapolated_drag_mean_ci95_low_n")["summary"]
    assert descriptions("no_such_column") == {}


def test_unknown_columns_and_tables_stay_bare(tmp_path: Path) -> None:
    for name, known in (("particles", True), ("t", False)):
        with parquet.table_writer(tmp_path / f"{name}.parquet", ("step", "c_x[1]")) as table:
            table.write({"step": [1], "c_x[1]": [0.5]})
        step, other = pq.read_schema(tmp_path / f"{name}.parquet")
        assert ("unit" in metadata(step)) == known
        assert "unit" not in metadata(other)

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from finished_runs import write_finished_run

from dragchain.loading.samples import BODY_IMPULSE
from dragchain.tables import parquet
from dragchain.tables.columns import (
    ATTRACTION,
    BODY,
    CLASSES,
    ORIENTATION,
    _rows,
    descriptions,
    unit_of,
)

TABLES = (
    *("workpiece_force", "workpiece_contacts", "particles", "contacts", "network", "chains"),
    *("clusters", "facets", "contact_events", "thermo"),
)
SOME_RUNS_ONLY = {
    *(*BODY, *BODY_IMPULSE, *ORIENTATION, ATTRACTION, "fastest_particle_m_s"),
    *(name for columns in CLASSES.values() for name in columns),
    *("classes", "peak_pressure_pa", "touch_normal_m_s", "touches_per_m2_s"),
}
"""Columns of spinning workpieces, clumps, attraction, classes and touches, and one not written."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """All tables of a process run, by name."""
    run = write_finished_run(tmp_path_factory.mktemp("described") / "process")
    return {file.stem: file for file in run.rglob("*.parquet")}


def metadata(field: pa.Field) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}


@pytest.mark.parametrize("table", TABLES)
def test_every_column_is_described_and_every_described_one_is_there(
    files: dict[str, Path], table: str
) -> None:
    schema = pq.read_schema(files[table])
    for field in schema:
        found = metadata(field)
        assert len(found["description"]) > 5, field.name
        assert found["unit"] == unit_of(field)
        assert found["unit"] or not pa.types.is_floating(field.type), field.name
    plain = {name for name, tables, _ in _rows() if table in tables and "*" not in name}
    assert plain - set(schema.names) <= SOME_RUNS_ONLY


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
    contacts = {"workpiece_contacts", "sphere_contacts", "contact_events"}
    assert set(found) == {*contacts, "chains", "touches", "touch_events"}
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

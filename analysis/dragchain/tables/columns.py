"""Columns of the tables: names that several share, and what they mean and in which units.

``columns.csv`` beside this module describes them; the end of a column's name is its unit.
"""

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import pyarrow as pa

from dragdeck.files import table_rows
from dragdeck.study.quantities import QUANTITIES


def vector(name: str, unit: str) -> tuple[str, str, str]:
    """The columns of a vector."""
    return f"{name}_x_{unit}", f"{name}_y_{unit}", f"{name}_z_{unit}"


FORCES = vector("force", "n")
_TORQUES = vector("torque", "n_m")
POINT = vector("point", "m")
SLIP = vector("slip", "m_s")
REFERENCE = vector("ref", "m")
CENTRE = ("x_m", "y_m", "z_m")
VELOCITY = ("vx_m_s", "vy_m_s", "vz_m_s")
SPIN = ("wx_rad_s", "wy_rad_s", "wz_rad_s")
ORIENTATION = ("orientation_w", "orientation_x", "orientation_y", "orientation_z")
"""Columns of ``particles`` beside its own where particles are clumps."""

KINEMATICS = ("particle_id", *CENTRE, *VELOCITY, *SPIN, "radius_m")

WORKPIECE_FORCE = (
    "step", "time_s", "phase", *FORCES, *_TORQUES, *REFERENCE,
    "direction_rad", "drag_n", "lateral_n", "vertical_n", "in_statistics",
)  # fmt: skip
BODY = ("turn_rad", "body_x_n", "body_y_n", "body_z_n")
"""Columns of ``workpiece_force`` beside these where the workpiece spins."""

WORKPIECE_CONTACTS = (
    "step", "time_s", "phase", "particle_id", "facet_id", *POINT, *FORCES,
    "normal_force_n", "tangential_force_n", "overlap_m", *SLIP, "normal_velocity_m_s",
    "azimuth_rad", "depth_m", "in_statistics",
)  # fmt: skip
ATTRACTION = "attraction_n"
"""Column of ``workpiece_contacts`` beside these where the contact law attracts particles."""

CLASSES = {
    "particles": ("class",),
    "workpiece_contacts": ("class",),
    "contacts": ("a_class", "b_class"),
}
"""Columns of tables beside theirs where the media have classes, by table."""

CONTACTS = (
    "step", "time_s", "kind", "a_id", "b_id", *POINT, *FORCES,
    "normal_force_n", "tangential_force_n", "overlap_m",
)  # fmt: skip
IMPACTS = (
    "impact", "start_time_s", "duration_s", "peak_force_n", "speed_in_m_s", "speed_out_m_s",
    "restitution", "time_since_first_s",
)  # fmt: skip


# --- meanings ------------------------------------------------------------------------------------


UNITS: Mapping[str, str] = {
    "n_m_per_m": "N m/m", "n_s_per_m": "N s/m", "m_per_m": "m/m", "n_per_m": "N/m",
    "j_per_m": "J/m", "per_m2_s": "1/(m2 s)", "per_m": "1/m", "per_s": "1/s",
    "kg_m3": "kg/m3", "rad_s2": "rad/s2", "m_s2": "m/s2",
    "m_s": "m/s", "rad_s": "rad/s", "n_m": "N m", "n_s": "N s", "m2": "m2", "n": "N", "m": "m",
    "s": "s", "j": "J", "pa": "Pa", "rad": "rad", "deg": "degree", "hz": "Hz", "rpm": "1/min",
    "percent": "%",
}  # fmt: skip
"""Units by the ends of names, longer ends before those that they end with."""


@cache
def _rows() -> list[tuple[str, tuple[str, ...], str]]:
    """Column, tables and description; ``*`` in a column stands for any text."""
    rows = table_rows(Path(__file__).with_name("columns.csv"))
    of_tables = [(row["column"], tuple(row["tables"].split()), row["description"]) for row in rows]
    of_quantities = [
        (column, ("summary",), text)
        for row in QUANTITIES
        if row["reported"] and row["kind"]
        for column, text in _of_quantity(row)
    ]
    return of_tables + of_quantities


def _of_quantity(row: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """The columns of a quantity in the summary, and what they mean."""
    name, unit, label = row["name"], row["unit"], row["label"]
    yield quantity_column(name, unit), f"{label}, in process time" if row["time"] else label
    for end, side in (("low", "lower"), ("high", "upper")):
        text = f"{side} end of the 95 % confidence interval of the {label}"
        yield quantity_column(f"{name}_ci95_{end}", unit), text
    yield f"{name}_reliable", "whether that interval is reliable"


def quantity_column(name: str, unit: str) -> str:
    """The column of a quantity: its name, with its unit at the end."""
    end = f"_{unit.lower().replace('/', '_per_').replace(' ', '_')}" if unit else ""
    return name + end.replace("_1_per", "_per")


def descriptions(column: str) -> dict[str, str]:
    """What a column means in each table that may have it, by the table's name."""
    descriptions: dict[str, str] = {}
    for pattern, tables, text in _rows():
        if fnmatchcase(column, pattern):
            descriptions = dict.fromkeys(tables, text) | descriptions
    return descriptions


def unit_end(column: str) -> str:
    """The end of a column's name that is its unit, empty if there is none."""
    name = column.removesuffix("_se")
    return next((end for end in UNITS if name.endswith(f"_{end}")), "")


def unit_of(field: pa.Field) -> str:
    """The unit of a column: ``1`` for plain numbers, empty for ids, text and flags."""
    if end := unit_end(field.name):
        return UNITS[end]
    name = field.name.removesuffix("_se")
    number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
    return "1" if number and not name.endswith("_id") else ""


def described(schema: pa.Schema, table: str) -> pa.Schema:
    """The schema with the keys ``unit`` and ``description`` in the metadata of known columns."""
    fields = []
    for field in schema:
        if text := descriptions(field.name).get(table):
            field = field.with_metadata({"unit": unit_of(field), "description": text})
        fields.append(field)
    return pa.schema(fields, metadata=schema.metadata)

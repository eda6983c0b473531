"""What the engine is asked to write, column by column.

A deck's dump lines and the ``columns.json`` beside it are both made from these
definitions, so that no reader has to guess a column.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["print", "custom", "local"]


@dataclass(frozen=True)
class Column:
    """A column: our name, and what the engine calls the quantity.

    Attributes
    ----------
    name : str
        With the unit at the end.
    engine : str
        An engine expression: an atom attribute, ``f_id[i]``, ``c_id[i]``, or the
        formula of an equal-style variable.
    whole : bool
        An id: written without decimals.
    """

    name: str
    engine: str
    whole: bool = False


@dataclass(frozen=True)
class Output:
    """A raw output file.

    Attributes
    ----------
    name : str
        Also the first part of the file's name.
    kind : str
        ``print``, ``custom`` or ``local``: the engine command that writes it.
    columns : tuple of Column
    period_steps, first_step, last_step : int
        When frames are written. `last_step` is None where the engine decides.
    binary : bool
    """

    name: str
    kind: Kind
    columns: tuple[Column, ...]
    period_steps: int
    first_step: int
    last_step: int | None
    binary: bool = False

    @property
    def pattern(self) -> str:
        """File name, with ``{part}`` for the part number."""
        ending = {"print": "txt", "custom": "bin" if self.binary else "dump", "local": "dump"}
        return f"{self.name}.{{part}}.{ending[self.kind]}"

    @property
    def file(self) -> str:
        """File name as a deck writes it, with the engine's variable for the part."""
        return self.pattern.replace("{part}", "${part}")

    @property
    def text_format(self) -> str:
        """The engine's number format of one row."""
        return " ".join("%.0f" if column.whole else "%.9g" for column in self.columns)

    def as_json(self) -> dict[str, Any]:
        """The entry of ``columns.json``."""
        named = self.kind != "print" and not self.binary
        return {
            "kind": self.kind,
            "binary": self.binary,
            "pattern": self.pattern,
            "columns": [column.name for column in self.columns],
            "engine_columns": [column.engine for column in self.columns] if named else None,
            "period_steps": self.period_steps,
            "first_step": self.first_step,
            "last_step": self.last_step,
        }


def _vector(name: str, unit: str, source: str, first: int = 1) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{axis}_{unit}", f"{source}[{first + i}]") for i, axis in enumerate("xyz")
    )


_POSITION = tuple(Column(f"{axis}_m", axis) for axis in "xyz")
_VELOCITY = tuple(Column(f"v{axis}_m_s", f"v{axis}") for axis in "xyz")
_SPIN = tuple(Column(f"w{axis}_rad_s", f"omega{axis}") for axis in "xyz")
_ID = Column("ball_id", "id", whole=True)
_RADIUS = Column("radius_m", "radius")
_STEP = Column("step", "step", whole=True)
_TIME = Column("time_s", "step*dt")


def thermo(period: int, last: int | None) -> Output:
    """Ball count, kinetic energies and the largest speed of a ball over time."""
    columns = (
        _STEP,
        _TIME,
        Column("balls", "atoms", whole=True),
        Column("kinetic_energy_j", "c_kinetic"),
        Column("rotational_energy_j", "c_rotation"),
        Column("fastest_ball_m_s", "c_fastest_ball"),
    )
    return Output("thermo", "print", columns, period, period, last)


def settled_balls() -> Output:
    """Every ball of the settled bed, one frame."""
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS)
    return Output("balls", "custom", columns, 1, 0, None, binary=True)


def rod_force(period: int, last: int) -> Output:
    """Force and torque on the tool, and where its reference point is."""
    columns = (
        _STEP,
        _TIME,
        *_vector("force", "n", "f_tool"),
        *_vector("torque", "nm", "f_tool", 4),
        *_vector("ref", "m", "f_tool", 7),
    )
    return Output("rod_force", "print", columns, period, period, last)


def rod_balls(period: int, first: int, last: int) -> Output:
    """Balls that the tool pushes: how they move, and the force as applied."""
    force = _vector("force", "n", "f_force_tool_wall")
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *force)
    return Output("rod_balls", "custom", columns, period, first, last, binary=True)


def rod_contacts(period: int, first: int, last: int, bowl_facets: bool) -> Output:
    """Contacts of the tool's facets, with the force as evaluated again.

    With `bowl_facets`, the bowl's too, told apart by the mesh id.
    """
    mesh = (Column("mesh_id", "c_tool_contacts[7]", whole=True),) if bowl_facets else ()
    columns = (
        *_vector("point", "m", "c_tool_contacts", 1),
        *mesh,
        Column("facet_id", "c_tool_contacts[8]", whole=True),
        Column("ball_id", "c_tool_contacts[9]", whole=True),
        *_vector("force", "n", "c_tool_contacts", 10),
        Column("overlap_m", "c_tool_contacts[13]"),
    )
    return Output("rod_contacts", "local", columns, period, first, last)


def contacts(period: int, first: int, last: int) -> Output:
    """Contacts between balls."""
    columns = (
        Column("ball1_id", "c_ball_contacts[1]", whole=True),
        Column("ball2_id", "c_ball_contacts[2]", whole=True),
        *_vector("force", "n", "c_ball_contacts", 4),
        Column("overlap_m", "c_ball_contacts[7]"),
    )
    return Output("contacts", "local", columns, period, first, last)


def balls(period: int, first: int, last: int, bowl_facets: bool) -> Output:
    """Every ball, with the forces of an exact bowl on it as applied."""
    bowl = (
        *_vector("floor_force", "n", "f_force_floor"),
        *_vector("side_force", "n", "f_force_side"),
    )
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *(() if bowl_facets else bowl))
    return Output("balls", "custom", columns, period, first, last, binary=True)


def bodies(period: int, last: int, walls: Sequence[str]) -> Output:
    """Every ball of a small scene: motion, the force and torque on it, that of each wall."""
    columns = (
        *(_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS),
        *(Column(f"force_{axis}_n", f"f{axis}") for axis in "xyz"),
        *(Column(f"torque_{axis}_nm", f"tq{axis}") for axis in "xyz"),
        *(column for wall in walls for column in _vector(f"{wall}_force", "n", f"f_force_{wall}")),
    )
    return Output("bodies", "custom", columns, period, 0, last, binary=True)


def impacts() -> Output:
    """Every step near an impact of the drop test."""
    columns = (
        _STEP,
        _TIME,
        Column("z_m", "xcm(all,z)"),
        Column("vz_m_s", "vcm(all,z)"),
        Column("force_n", "c_plate_force"),
    )
    return Output("impacts", "print", columns, 1, 0, None)


def balls_and_forces(period: int, last: int) -> Output:
    """Every ball with the total force on it, as applied."""
    force = tuple(Column(f"force_{axis}_n", f"f{axis}") for axis in "xyz")
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *force)
    return Output("balls", "custom", columns, period, 0, last, binary=True)

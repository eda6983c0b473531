"""What the engine is asked to write, column by column.

A deck's dump lines and the ``columns.json`` beside it are both made from these
definitions, so that no reader has to guess a column.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal, Self

from markupsafe import Markup
from pydantic import Field, PositiveInt, field_validator, model_validator

from dragdeck.documents import Document
from dragdeck.parts import Part

Kind = Literal["print", "custom", "local"]


class OutputOfRun(Part):
    """A raw output file and its columns.

    Frames are expected at `first_step` and every `period_steps` after it up to `last_step`. If
    that is None, LIGGGHTS decides during the run: any of these steps may be absent, and the last
    one is not known beforehand.

    Attributes
    ----------
    name : str
        Its key in the document.
    kind : str
        ``print``, ``custom`` or ``local``: the LIGGGHTS command that writes it.
    pattern : str
        File name, with ``{part}`` for the part number.
    columns, engine_columns : tuple of str
        Name of each column in dragdeck, and in LIGGGHTS where the header of the file contains it.
    period_steps, first_step, last_step : int
        Interval, first and last step of the frames; `last_step` is None if LIGGGHTS decides.
    rows_per_particle : float
        Expected rows per frame and particle of the run; a frame has at least one row.
    binary : bool
        Whether it is a binary dump.
    """

    foreign: ClassVar[bool] = False
    name: str = Field(default="", exclude=True)
    kind: Kind
    binary: bool
    pattern: str
    columns: tuple[str, ...]
    engine_columns: tuple[str, ...] | None
    period_steps: PositiveInt
    first_step: int
    last_step: int | None
    rows_per_particle: float = 0.0

    @property
    def header(self) -> tuple[str, ...]:
        """What LIGGGHTS writes in the header of a text file."""
        return self.columns if self.engine_columns is None else self.engine_columns

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        assert self.pattern.count("{part}") == 1, (
            f"pattern is {self.pattern!r}, without {{part}} once"
        )
        assert self.kind == "custom" or not self.binary, f"a {self.kind} output is always text"
        assert self.columns and len(set(self.columns)) == len(self.columns), (
            "columns is empty or names a column twice"
        )
        assert len(self.header) == len(self.columns), "engine_columns has another length"
        assert self.kind != "print" or self.columns[0] == "step", (
            "columns does not start with step, which a print output requires"
        )
        return self


class ColumnsFile(Document):
    """The content of ``columns.json``: the raw output files of a run by name."""

    remedy = "write it with: ./run dragdeck step render"

    outputs: Mapping[str, OutputOfRun]

    @field_validator("outputs")
    @classmethod
    def _named(cls, outputs: Mapping[str, OutputOfRun]) -> Mapping[str, OutputOfRun]:
        return {name: output.model_copy(update={"name": name}) for name, output in outputs.items()}


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
        ``print``, ``custom`` or ``local``: the LIGGGHTS command that writes it.
    columns : tuple of Column
    period_steps, first_step, last_step : int
        Interval, first and last step of the frames; `last_step` is None if LIGGGHTS decides.
    binary : bool
    rows_per_particle : float
        Expected rows per frame and particle of the run; a frame has at least one row.
    purpose : str
        For the comment in the input script: content, and the result made from it.
    waits : bool
        Whether it is not written before `first_step`, although its dump is defined.
    """

    name: str
    kind: Kind
    columns: tuple[Column, ...]
    period_steps: int
    first_step: int
    last_step: int | None
    binary: bool = False
    rows_per_particle: float = 0.0
    purpose: str = ""
    waits: bool = False

    @property
    def pattern(self) -> str:
        """File name, with ``{part}`` for the part number."""
        ending = {"print": "txt", "custom": "bin" if self.binary else "dump", "local": "dump"}
        return f"{self.name}.{{part}}.{ending[self.kind]}"

    @property
    def file(self) -> Markup:
        """File name as a deck writes it, with the engine's variable for the part."""
        return Markup(self.pattern.replace("{part}", "${part}"))

    @property
    def text_format(self) -> str:
        """The engine's number format of one row."""
        return " ".join("%.0f" if column.whole else "%.9g" for column in self.columns)

    def as_part(self) -> OutputOfRun:
        """The entry of ``columns.json``."""
        named = self.kind != "print" and not self.binary
        return OutputOfRun(
            kind=self.kind,
            binary=self.binary,
            pattern=self.pattern,
            columns=tuple(column.name for column in self.columns),
            engine_columns=[column.engine for column in self.columns] if named else None,
            period_steps=self.period_steps,
            first_step=self.first_step,
            last_step=self.last_step,
            rows_per_particle=self.rows_per_particle,
        )


def in_writing_order(outputs: Iterable[Output]) -> tuple[Output, ...]:
    """The outputs in the order in which a deck writes them: contacts, ``local``, come last.

    LIGGGHTS evaluates the contacts of a mesh again for ``compute wall/gran/local``, and leaves
    ``store_force`` of that wall at zero: whatever reads it later in the same step gets zeros.
    """
    return tuple(sorted(outputs, key=lambda output: output.kind == "local"))


def _vector(name: str, unit: str, source: str, first: int = 1) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{axis}_{unit}", f"{source}[{first + i}]") for i, axis in enumerate("xyz")
    )


def _of_walls(walls: Sequence[str]) -> Iterator[Column]:
    """The force of each wall on a particle."""
    for wall in walls:
        yield from _vector(f"{wall}_force", "n", f"f_force_{wall}")


_POSITION = tuple(Column(f"{axis}_m", axis) for axis in "xyz")
_VELOCITY = tuple(Column(f"v{axis}_m_s", f"v{axis}") for axis in "xyz")
_SPIN = tuple(Column(f"w{axis}_rad_s", f"omega{axis}") for axis in "xyz")
_ID = Column("particle_id", "id", whole=True)
_RADIUS = Column("radius_m", "radius")
_BODY = Column("body_id", "id_multisphere", whole=True)
_STEP = Column("step", "step", whole=True)
_TIME = Column("time_s", "step*dt")
_FASTEST = Column("fastest_particle_m_s", "c_fastest_particle")

WORKPIECE_FORCE = "workpiece_force"
"""Output of the force on a workpiece, and the first part of its name for further ones."""

_CONTACTS_PER_PARTICLE = 3.0
"""A settled bed of spheres with friction has five to six neighbours a particle."""


def thermo(period: int, last: int | None, entry: int = 0) -> Output:
    """Particle count, kinetic energies and the largest speed of a particle after the entry."""
    columns = (
        _STEP,
        _TIME,
        Column("n_particles", "atoms", whole=True),
        Column("kinetic_energy_j", "c_kinetic"),
        Column("rotational_energy_j", "c_rotation"),
        _FASTEST,
    )
    purpose = "particle count, energies, largest speed, for acceptance checks and thermo.parquet"
    return Output("thermo", "print", columns, period, entry + period, last, purpose=purpose)


def settled_particles(clumped: bool = False) -> Output:
    """Every particle of the settled bed, or every sphere of clumps, one frame."""
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *([_BODY] if clumped else []))
    purpose = "settled packing, one frame, for packing.json"
    return Output("particles", "custom", columns, 1, 0, None, True, 1.0, purpose)


def workpiece_force(period: int, last: int, workpiece: str, entry: int = 0) -> Output:
    """Force and torque on a workpiece after the entry, and where its reference point is.

    With the largest speed of a particle, for the acceptance check that no contact threw one.
    """
    columns = (
        _STEP,
        _TIME,
        *_vector("force", "n", f"f_{workpiece}"),
        *_vector("torque", "n_m", f"f_{workpiece}", 4),
        *_vector("ref", "m", f"f_{workpiece}", 7),
        _FASTEST,
    )
    name = workpiece.replace("workpiece", WORKPIECE_FORCE)
    purpose = "force, torque and position of the workpiece, for workpiece_force.parquet (drag)"
    return Output(name, "print", columns, period, entry + period, last, purpose=purpose)


def workpiece_particles(period: int, first: int, last: int) -> Output:
    """Particles that the workpiece pushes: how they move, and the force as applied."""
    force = _vector("force", "n", "f_force_workpiece_wall")
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *force)
    return Output(
        "workpiece_particles",
        "custom",
        columns,
        period,
        first,
        last,
        binary=True,
        purpose="particles on the workpiece and the force applied, for workpiece_contacts.parquet",
    )


def workpiece_contacts(period: int, first: int, last: int, several: bool) -> Output:
    """Contacts of facets, with the force as evaluated again.

    With `several` meshes they are told apart by the mesh id: the workpieces from 0, then the bowl.
    """
    mesh = (Column("mesh_id", "c_workpiece_contacts[7]", whole=True),) if several else ()
    columns = (
        *_vector("point", "m", "c_workpiece_contacts", 1),
        *mesh,
        Column("facet_id", "c_workpiece_contacts[8]", whole=True),
        Column("particle_id", "c_workpiece_contacts[9]", whole=True),
        *_vector("force", "n", "c_workpiece_contacts", 10),
        Column("overlap_m", "c_workpiece_contacts[13]"),
    )
    purpose = "contacts with mesh elements, evaluated again, for workpiece_contacts.parquet"
    return Output("workpiece_contacts", "local", columns, period, first, last, purpose=purpose)


TOUCHES = ("touch_particles", "touch_contacts")
"""Outputs as those of the workpiece, at every step, so that each contact is seen to begin."""


def first_touch(first: int, last: int, several: bool) -> tuple[Output, ...]:
    """Contacts on the workpiece, and their particles, at every step of a part of the drag."""
    layouts = (workpiece_particles(1, first, last), workpiece_contacts(1, first, last, several))
    why = "the same at every step of a part of the drag, for touches.parquet"
    return tuple(
        replace(layout, name=name, purpose=why, waits=True, rows_per_particle=0.05)
        for name, layout in zip(TOUCHES, layouts, strict=True)
    )


def contacts(period: int, first: int, last: int) -> Output:
    """Contacts between particles."""
    columns = (
        Column("particle1_id", "c_particle_contacts[1]", whole=True),
        Column("particle2_id", "c_particle_contacts[2]", whole=True),
        *_vector("force", "n", "c_particle_contacts", 4),
        Column("overlap_m", "c_particle_contacts[7]"),
    )
    return Output(
        "contacts",
        "local",
        columns,
        period,
        first,
        last,
        rows_per_particle=_CONTACTS_PER_PARTICLE,
        purpose="contacts between particles, for contacts.parquet and force chains",
    )


def particles(
    period: int, first: int, last: int, walls: Sequence[str], clumped: bool = False
) -> Output:
    """Every particle or sphere of a clump, with the force of each wall on it as applied."""
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *_of_walls(walls))
    columns += (_BODY,) if clumped else ()
    purpose = "all particles, for particles.parquet and force chains"
    return Output("particles", "custom", columns, period, first, last, True, 1.0, purpose)


def bodies(period: int, last: int, walls: Sequence[str]) -> Output:
    """Every particle of a small scene: motion, the force and torque on it, that of each wall."""
    columns = (
        *(_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS),
        *(Column(f"force_{axis}_n", f"f{axis}") for axis in "xyz"),
        *(Column(f"torque_{axis}_n_m", f"tq{axis}") for axis in "xyz"),
        *_of_walls(walls),
    )
    purpose = "all particles with their forces, for the comparison with reference solutions"
    return Output("bodies", "custom", columns, period, 0, last, True, 1.0, purpose)


def impacts() -> Output:
    """Every step near an impact of the drop test."""
    columns = (
        _STEP,
        _TIME,
        Column("z_m", "xcm(all,z)"),
        Column("vz_m_s", "vcm(all,z)"),
        Column("force_n", "c_plate_force"),
    )
    purpose = "height, velocity and force at every step around an impact, for impacts.parquet"
    return Output("impacts", "print", columns, 1, 0, None, purpose=purpose)


def particles_and_forces(period: int, last: int) -> Output:
    """Every particle with the total force on it, as applied."""
    force = tuple(Column(f"force_{axis}_n", f"f{axis}") for axis in "xyz")
    columns = (_ID, *_POSITION, *_VELOCITY, *_SPIN, _RADIUS, *force)
    purpose = "all particles with their total force, for the stability map"
    return Output("particles", "custom", columns, period, 0, last, True, 1.0, purpose)


def load_outputs(run_dir: Path | str) -> Mapping[str, OutputOfRun]:
    """Read ``columns.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    mapping of str to OutputOfRun
        The raw outputs by name. An output that is not in it was not written.

    Raises
    ------
    DocumentError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    return ColumnsFile.read(Path(run_dir) / "columns.json").outputs

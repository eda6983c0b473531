"""Content of ``case.json`` (the simulated case) and ``columns.json`` (its raw outputs)."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Literal, Self

from pydantic import JsonValue, PositiveFloat, PositiveInt, model_validator

from dragchain.errors import TableError
from dragdeck.documents import Document, Part
from dragdeck.study.driven import PathEntry, SuperposedEntry

Scene = Literal["drop_test", "filling", "process"]
OutputKind = Literal["print", "custom", "local"]


class Fidelity(Part):
    """The settings for speed and accuracy of a run."""

    name: str
    youngs_modulus_scale: PositiveFloat
    timestep_fraction: PositiveFloat
    speed_factor: PositiveFloat
    skin_m: PositiveFloat
    ranks: int


class Media(Part):
    """The media as specified in the study."""

    count: int
    radius_mean_m: PositiveFloat
    radius_std_m: float
    density_kg_m3: PositiveFloat


class Bowl(Part):
    """The container: a cylinder about the z axis that stands on z = 0."""

    radius_m: PositiveFloat
    walls: Literal["primitive", "mesh"]


class Workpiece(Part):
    """The body that is dragged through the particles: the ``number``-th, from 1, of ``count``.

    The number of a single one is 0. After ``wake_from_m`` of its path its axis goes where a
    workpiece went before; None if it never does.
    """

    kind: Literal["cylinder", "mesh"]
    radius_m: PositiveFloat
    length_m: PositiveFloat
    mesh: str
    immersion_depth_m: float
    number: int = 0
    count: PositiveInt = 1
    wake_from_m: PositiveFloat | None = None


class Phase(Part):
    """A stretch of the run: the steps after ``start_step`` up to ``end_step``."""

    name: str
    start_step: int
    end_step: int


class Assumption(Part):
    """A value that the source of the study does not report."""

    field: str
    value: JsonValue
    why: str


class ContactModuli(Part):
    """Effective moduli E* and G* of the contact of two bodies, softened as the run is, Pa."""

    modulus_pa: PositiveFloat
    shear_pa: PositiveFloat


class SettlingCriterion(Part):
    """When a packing counts as settled: mean kinetic energy per particle / (m g d)."""

    energy_ratio: PositiveFloat


class AdvisedSettings(Part):
    """The tolerance that a run's settings were chosen for, and their forecast cost.

    ``error`` is the largest measured one of a drop test, None for quantities of the process.
    Costs are relative to a plain run at the physical modulus, ``largest_cost`` with all windows.
    """

    tolerance: float
    quantities: tuple[str, ...]
    error: float | None
    relative_cost: float
    largest_cost: float
    fallback: str | None


class Statistics(Part):
    """What the statistics of a process leave out."""

    transient_s: float


class PublishedDrag(Part):
    """A drag force reported by the source of the study, N; negative: opposes the motion."""

    drag_mean_n: float
    drag_std_n: float | None = None


class Reference(Part):
    """Published values to compare with the results."""

    source: str
    experiment: PublishedDrag | None = None
    simulation: PublishedDrag | None = None


class Case(Document):
    """The content of ``case.json`` of a run of a study.

    The attributes are the keys of the document. ``case``, ``workpiece``, ``motion``, ``surface_m``
    and ``statistics`` are None outside a process, ``restitution`` outside a drop test, ``settled``
    outside a filling. ``contact_moduli`` are those of a particle with a ``particle``, the ``bowl``
    and the ``workpiece``, ``numbers`` the dimensionless numbers of a process. ``superposed`` lists
    the superposed motions, ``asked`` is the tolerance for which the settings were chosen,
    ``unsafe_timestep`` why a step beyond the stable one was accepted, and ``output_of`` the run
    from whose raw output a further workpiece is read. ``lead`` is the softer run from which the
    process goes on, and ``marks`` are states from which others go on. ``added_forces``
    are models of the contact law that add a normal force, such as cohesion.
    """

    remedy = "make it with: dragdeck step render"

    study: str
    title: str | None = None
    scene: Scene
    run: str
    case: str | None = None
    upstream: Mapping[str, str] = {}
    output_of: str | None = None
    lead: str | None = None
    marks: tuple[str, ...] = ()
    timestep_s: PositiveFloat
    rayleigh_time_s: PositiveFloat
    gravity_m_s2: float
    fidelity: Fidelity
    inputs: Mapping[str, JsonValue]
    contact_moduli: Mapping[str, ContactModuli] = {}
    numbers: Mapping[str, float] = {}
    media: Media
    bowl: Bowl | None = None
    workpiece: Workpiece | None = None
    surface_m: PositiveFloat | None = None
    motion: PathEntry | None = None
    superposed: tuple[SuperposedEntry, ...] = ()
    phases: tuple[Phase, ...]
    statistics: Statistics | None = None
    restitution: float | None = None
    settled: SettlingCriterion | None = None
    assumptions: tuple[Assumption, ...]
    reference: Reference | None = None
    versions: Mapping[str, str]
    asked: AdvisedSettings | None = None
    added_forces: tuple[str, ...] = ()
    unsafe_timestep: str | None = None

    @model_validator(mode="after")
    def _of_its_scene(self) -> Self:
        needed = {
            "drop_test": ("restitution",),
            "filling": ("bowl",),
            "process": ("bowl", "case", "workpiece", "motion", "surface_m", "statistics"),
        }
        for name in needed[self.scene]:
            assert getattr(self, name) is not None, f"{name} is missing, which a {self.scene} has"
        for before, after in pairwise(self.phases):
            assert before.end_step == after.start_step, (
                f"phases: {after.name} does not start where {before.name} ends"
            )
        return self


def changed_inputs(
    own: Mapping[str, JsonValue], other: Mapping[str, JsonValue]
) -> dict[str, JsonValue]:
    """Inputs of a run that differ from another's, by dotted name, with the run's own values.

    A study without an optional value may leave its name out or write null: both are None here.
    """
    names = sorted({*own, *other})
    return {name: own.get(name) for name in names if own.get(name) != other.get(name)}


def input_of(case: Case, name: str) -> JsonValue:
    """An input of a run by its dotted name.

    Raises
    ------
    TableError
        If ``case.json`` does not give it.
    """
    if name not in case.inputs:
        raise TableError(f"{case.run}: case.json has no inputs.{name}; render the run again")
    return case.inputs[name]


def number_of(case: Case, name: str) -> float:
    """An input of a run that must be a number; see `input_of`."""
    value = input_of(case, name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TableError(f"{case.run}: case.json: inputs.{name} is {value!r}, not a number")
    return float(value)


def friction_with(case: Case, body: str) -> float:
    """Coefficient of friction of a particle with ``media``, ``bowl`` or ``workpiece``.

    Times the normal force of a contact it limits the tangential force.

    Raises
    ------
    TableError
        If the inputs of ``case.json`` do not give it, or the contact law adds a force to the
        one that limits friction.
    """
    if case.added_forces:
        raise TableError(
            f"{case.run}: the contact law adds a force ({', '.join(case.added_forces)}), and "
            "LIGGGHTS limits friction by the force without it: tangential forces of contacts, "
            "friction work and chains cannot be told from the output; tables of the force "
            "on the workpiece, of energies and particles, and the raw output are not affected"
        )
    particle, other = (input_of(case, f"{name}.material") for name in ("media", body))
    names = [f"pairs.{pair}.friction" for pair in (f"{particle}-{other}", f"{other}-{particle}")]
    return number_of(case, next((name for name in names if name in case.inputs), names[0]))


class Output(Part):
    """One raw output of LIGGGHTS, as ``columns.json`` describes it.

    Frames are expected at ``first_step`` and every ``period_steps`` after it up
    to ``last_step``. If that is None, LIGGGHTS decides during the run: any of
    these steps may be absent, and the last one is not known beforehand.
    """

    name: str = ""
    kind: OutputKind
    binary: bool
    pattern: str
    columns: tuple[str, ...]
    engine_columns: tuple[str, ...] | None
    period_steps: PositiveInt
    first_step: int
    last_step: int | None

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


class Columns(Document):
    """The content of ``columns.json``."""

    remedy = "make it with: dragdeck step render"

    outputs: Mapping[str, Output]


def load_case(run_dir: Path | str) -> Case:
    """Read ``case.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    Case
        Its content, checked for the keys that its scene needs.

    Raises
    ------
    DocumentError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    return Case.read(Path(run_dir) / "case.json")


def load_outputs(run_dir: Path | str) -> dict[str, Output]:
    """Read ``columns.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    dict of str to Output
        The raw outputs by name. An output that is not in it was not written.

    Raises
    ------
    DocumentError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    outputs = Columns.read(Path(run_dir) / "columns.json").outputs
    return {name: output.model_copy(update={"name": name}) for name, output in outputs.items()}

"""A scene as data: what its input script and its ``case.json`` are made from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, Self, TypeVar

from dragdeck import __version__
from dragdeck.decks.outputs import Output
from dragdeck.errors import Caution
from dragdeck.physics.domain_split import ENGINE_CHOOSES
from dragdeck.physics.rounding import round_to
from dragdeck.physics.run_limits import ENGINE_HARD_PA, ENGINE_NEIGHBOURS
from dragdeck.records.run import CaseFile
from dragdeck.study import contact_law as contact_laws


@dataclass(frozen=True)
class PairTable:
    """A coefficient of all pairs of types: LIGGGHTS's property, row by row."""

    name: str
    engine: str
    values: Sequence[float]
    modulus_power: float = 0.0


@dataclass(frozen=True)
class ContactLaw:
    """The contact law of particles and walls alike, as LIGGGHTS writes it.

    Attributes
    ----------
    tables : sequence of PairTable
        The coefficients that some pair has.
    model : str
        Models and their names.
    settings : sequence of str
        Options that follow the models.
    """

    tables: Sequence[PairTable]
    model: str
    settings: Sequence[str]


@dataclass(frozen=True)
class Properties:
    """Young's moduli, one per type, and the coefficients that go with them."""

    youngs_moduli_pa: Sequence[float]
    tables: Sequence[PairTable]


@dataclass(frozen=True)
class Materials:
    """Material constants and the contact law, as LIGGGHTS wants them.

    Attributes
    ----------
    names : sequence of str
        The material of each type, in LIGGGHTS's order; the particles are first.
    youngs_moduli_pa, poissons_ratios : sequence of float
        One per type, as simulated.
    law : ContactLaw
    youngs_modulus_scale : float
        Factor by which the physical Young's moduli were multiplied.
    """

    names: Sequence[str]
    youngs_moduli_pa: Sequence[float]
    poissons_ratios: Sequence[float]
    law: ContactLaw
    youngs_modulus_scale: float = 1.0

    def softened(self, scale: float) -> Properties:
        """What changes if the Young's moduli are multiplied by a further factor."""
        moduli = [round_to(scale * modulus, 12) for modulus in self.youngs_moduli_pa]
        tables = [
            replace(
                table,
                values=[
                    contact_laws.softened(coefficient, table.modulus_power, scale)
                    for coefficient in table.values
                ],
            )
            for table in self.law.tables
            if table.modulus_power
        ]
        return Properties(moduli, tables)


def contact_law(
    pairs: Sequence[Sequence[contact_laws.Pair]], contact: contact_laws.Contact
) -> ContactLaw:
    """The contact law of a square table of pairs: a row and a column for each type."""
    every = [pair for row in pairs for pair in row]
    tables = [
        PairTable(name, row.engine, [getattr(pair, name) for pair in every], row.modulus_power)
        for name, row in contact_laws.present(every).items()
    ]
    return ContactLaw(
        tables, contact_laws.contact_model(every, contact), contact_laws.contact_settings(every)
    )


NOT_OF_LIQUID = (
    "drag of the liquid",
    "added mass",
    "lubrication",
    "buoyancy of the workpiece",
    "liquid bridges",
)
"""What no run models of a liquid."""


@dataclass(frozen=True)
class Liquid:
    """A liquid at rest: the height of its surface, m, and its density, kg/m3."""

    level_m: float
    density_kg_m3: float
    leaves_out: Sequence[str] = NOT_OF_LIQUID


@dataclass(frozen=True, kw_only=True)
class Deck:
    """What every template sees as ``deck``.

    Attributes
    ----------
    source : str
        The data or restart file that the run starts from.
    gravity_direction : (float, float, float)
        Unit vector of gravity.
    liquid : Liquid or None
        It carries a part of the particles' weight.
    checkpoint_steps : int
        Steps between restart points; 0 for none.
    processors : str
        How the ranks are laid out along x, y and z.
    case : str
        Name of the case; empty for a run that cases share.
    rayleigh_time_s : float
        Rayleigh time of the smallest particle; 0 if the time step is not a fraction of it.
    neighbours : int
        Room for neighbours of a particle, facets included.
    clumped : bool
        Whether particles are clumps of spheres.
    """

    title: str
    study: str
    scene: str
    run: str
    source: str
    materials: Materials
    limit_force: bool
    gravity_m_s2: float
    skin_m: float
    timestep_s: float
    outputs: Sequence[Output]
    gravity_direction: tuple[float, float, float] = (0, 0, -1)
    liquid: Liquid | None = None
    thermo_steps: int = 0
    checkpoint_steps: int = 0
    processors: str = ENGINE_CHOOSES
    case: str = ""
    rayleigh_time_s: float = 0.0
    neighbours: int = ENGINE_NEIGHBOURS
    clumped: bool = False
    version: str = __version__
    templates: str = ""

    @property
    def hard(self) -> bool:
        """Whether a modulus is above the engine's usual range."""
        return max(self.materials.youngs_moduli_pa) > ENGINE_HARD_PA

    @property
    def crowded(self) -> bool:
        """Whether a particle may have more neighbours than the engine has room for by itself."""
        return self.neighbours > ENGINE_NEIGHBOURS


@dataclass(frozen=True)
class LeftOut:
    """Why a deck leaves something out.

    Attributes
    ----------
    why : str
    cost : str, optional
        Entry of ``tradeoff.json`` that says what it costs to put it back.
    """

    why: str
    cost: str | None = None


K = TypeVar("K", bound=CaseFile, covariant=True)


@dataclass(frozen=True)
class Scene(Generic[K]):
    """All that one engine run needs, before any file is written.

    Attributes
    ----------
    deck : Deck
    case : CaseFile
    steps : int
        Steps expected; an estimate where the engine decides.
    files : mapping of str to callable
        Other input files: their text by name, made when it is wanted.
    models : mapping of str to str
        What the deck models, and why.
    leaves_out : mapping of str to LeftOut
        What it leaves out.
    warnings : sequence of Caution
        What the user should know before the run.
    override : str, optional
        The template, if it is not the scene's own.
    facets : int
        Of all workpieces.
    """

    deck: Deck
    case: K
    steps: int
    files: Mapping[str, Callable[[], str]] = field(default_factory=dict)
    models: Mapping[str, str] = field(default_factory=dict)
    leaves_out: Mapping[str, LeftOut] = field(default_factory=dict)
    warnings: Sequence[Caution] = ()
    override: str | None = None
    facets: int = 0

    def modelling(self, there: set[str], optional: set[str]) -> Self:
        """The scene with the effects that its script models, of those that it may."""
        why = "by a template of the study"
        models = {what: text for what, text in self.models.items() if what not in optional - there}
        left = {what: text for what, text in self.leaves_out.items() if what not in there}
        left |= {what: LeftOut(why) for what in sorted(set(self.models) & (optional - there))}
        added = {what: why for what in sorted(set(self.leaves_out) & there)}
        return replace(self, models={**added, **models}, leaves_out=left)

    @property
    def template(self) -> str:
        """The template of the input script: the scene's own unless another overrides it."""
        return self.override or f"{self.deck.scene}.in.j2"

    def texts(self) -> dict[str, str]:
        """The text of each of `files`."""
        return {name: text() for name, text in self.files.items()}


AnyScene = Scene[CaseFile]
"""A run of any scene."""


# --- LIGGGHTS's data file: the particles that a run starts with, one by one ----------------------


Vector = tuple[float, float, float]
Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Body:
    """A particle: type from 1, radius m, density kg/m3, place m, velocity m/s, spin rad/s."""

    type: int
    radius_m: float
    density_kg_m3: float
    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0, 0.0)
    spin_rad_s: Vector = (0.0, 0.0, 0.0)


def data_file(title: str, types: int, box: Box, bodies: Sequence[Body]) -> str:
    """The text of a data file; its numbers read back exactly.

    Parameters
    ----------
    title : str
        First line.
    types : int
        Number of material types.
    box : three pairs of float
        Lower and upper bound along x, y and z, m.
    bodies : sequence of Body
        Numbered from 1. Velocities are written if one of them moves.
    """
    bounds = [
        f"{low!r} {high!r} {axis}lo {axis}hi" for axis, (low, high) in zip("xyz", box, strict=True)
    ]
    lines = [title, "", f"{len(bodies)} atoms", f"{types} atom types", "", *bounds]
    lines += ["", "Atoms", ""] if bodies else []
    lines += [
        f"{number} {body.type} {2 * body.radius_m!r} {body.density_kg_m3!r} "
        + _numbers(body.position_m)
        for number, body in enumerate(bodies, start=1)
    ]
    if any(any(body.velocity_m_s) or any(body.spin_rad_s) for body in bodies):
        lines += ["", "Velocities", ""]
        lines += [
            f"{number} {_numbers((*body.velocity_m_s, *body.spin_rad_s))}"
            for number, body in enumerate(bodies, start=1)
        ]
    return "\n".join([*lines, ""])


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)

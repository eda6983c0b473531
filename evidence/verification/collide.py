"""A few particles and plane walls, placed and set in motion one by one."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from dragdeck import __version__
from dragdeck.decks import outputs
from dragdeck.decks.case_file import CaseFile, CountOfRun, RanksOfRun
from dragdeck.decks.data_file import Body as DataBody
from dragdeck.decks.data_file import Vector, data_file
from dragdeck.decks.deck import Deck, LeftOut, Materials, Scene, contact_law
from dragdeck.documents import Part
from dragdeck.physics.rounding import round_to
from dragdeck.study.contact_law import Pair
from dragdeck.study.material import Material

_FRAMES_TIMES_BODIES = 25_000
"""Rows of the largest output of a run: every step for two particles, fewer frames for a rack."""


@dataclass(frozen=True)
class Wall:
    """An exact plane.

    Attributes
    ----------
    name : str
        Of the engine's fix, and of its force columns.
    type : int
        Material type, from 1.
    shape : str
        As the engine wants it, for example ``zplane 0.0``.
    """

    name: str
    type: int
    shape: str


class Body(Part):
    """A particle: material type from 1, radius m, place m, velocity m/s and spin rad/s."""

    type: int
    radius_m: float
    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0, 0.0)
    spin_rad_s: Vector = (0.0, 0.0, 0.0)


class ContactFacts(Part):
    """A contact of an experiment: particles by number, or ``plane``; the value that is varied."""

    particle: int
    partner: int | str
    value: float


class ExperimentFacts(Part):
    """What an experiment tests.

    Attributes
    ----------
    test, number : str, int
        Name and number of the test in the suite.
    heading, series : str
        For readers: the test, and the materials that meet.
    vary : str
        What differs from contact to contact.
    steps_per_contact : int
        Time steps in the shortest contact of the run.
    impacts, angle_deg : int, float
        Of a bouncing particle and of an incline alone.
    """

    test: str
    number: int
    heading: str
    series: str
    vary: str
    steps_per_contact: int
    contacts: Sequence[ContactFacts]
    impacts: int | None = None
    angle_deg: float | None = None


class NamedMaterial(Material):
    """A type's material."""

    name: str


class MeetingPair(Pair):
    """What two types do to each other."""

    types: tuple[int, int]


class CollideCase(CaseFile, ExperimentFacts):
    """A few particles and walls, one by one."""

    remedy = "run `snakemake verify`"

    scene: Literal["collide"] = "collide"
    gravity_m_s2: Vector
    limit_force: bool
    fidelity: RanksOfRun
    media: CountOfRun
    types: Sequence[NamedMaterial]
    pairs: Sequence[MeetingPair]
    bodies: Sequence[Body]
    walls: Sequence[Wall]

    def type_of(self, body: int | str) -> int:
        """Type of a particle, by its number, or of a wall, by its name."""
        if isinstance(body, int):
            return self.bodies[body - 1].type
        return next(wall.type for wall in self.walls if wall.name == body)


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """What a run of this scene models.

    Attributes
    ----------
    group, run, title : str
        Name of the group of results, run id, and a title.
    types : sequence of (str, Material)
        A name and a material for each type.
    pairs : mapping of (int, int) to Pair
        Types (from 1, the smaller first) that meet, and what they do to each other.
    gravity_m_s2 : (float, float, float)
        The vector.
    facts : ExperimentFacts
        What is tested, for ``case.json``.
    """

    group: str
    run: str
    title: str
    types: Sequence[tuple[str, Material]]
    pairs: Mapping[tuple[int, int], Pair]
    bodies: Sequence[Body]
    walls: Sequence[Wall]
    limit_force: bool
    timestep_s: float
    rayleigh_time_s: float
    steps: int
    gravity_m_s2: Vector = (0.0, 0.0, 0.0)
    period: int | None = None
    facts: ExperimentFacts


@dataclass(frozen=True, kw_only=True)
class _CollideDeck(Deck):
    """What the collide template sees."""

    walls: Sequence[Wall]
    steps: int


def collide_scene(experiment: Experiment) -> Scene[CollideCase]:
    """The scene of an experiment: one engine process, no checkpoints, no pair output."""
    every = experiment.period or frame_period(experiment.steps, len(experiment.bodies))
    last = experiment.steps // every * every
    look = max(1, experiment.steps // 10)
    size = math.hypot(*experiment.gravity_m_s2)
    deck = _CollideDeck(
        title=experiment.title,
        study=experiment.group,
        scene="collide",
        run=experiment.run,
        source="bodies.data",
        materials=_pair_table(experiment.types, experiment.pairs),
        limit_force=experiment.limit_force,
        gravity_m_s2=size,
        gravity_direction=_direction(experiment.gravity_m_s2, size),
        skin_m=_skin(experiment.bodies),
        timestep_s=experiment.timestep_s,
        outputs=(
            outputs.thermo(look, experiment.steps // look * look),
            outputs.bodies(every, last, [wall.name for wall in experiment.walls]),
        ),
        thermo_steps=look,
        walls=experiment.walls,
        steps=experiment.steps,
    )
    return Scene(
        deck=deck,
        case=_case(experiment),
        steps=experiment.steps,
        files={"bodies.data": lambda: _bodies_data(experiment)},
        models={"every particle": "placed and set in motion by hand", "exact walls": "planes"},
        leaves_out={
            "output of pairs": LeftOut("forces on so few particles say all"),
            "n_checkpoints": LeftOut("the run takes seconds"),
        },
    )


def frame_period(steps: int, bodies: int) -> int:
    """Steps between frames, so that a run of many particles stays small."""
    return max(1, math.ceil(steps * bodies / _FRAMES_TIMES_BODIES))


def _skin(bodies: Sequence[Body]) -> float:
    """Neighbour skin, m: a fifth of the smallest radius."""
    return round_to(0.2 * min(body.radius_m for body in bodies), 3)


def _pair_table(
    types: Sequence[tuple[str, Material]], pairs: Mapping[tuple[int, int], Pair]
) -> Materials:
    """The engine's constants; pairs that never meet repeat one that does."""
    other = next(iter(pairs.values()))
    size = range(1, len(types) + 1)
    law = contact_law([[pairs.get((min(i, j), max(i, j)), other) for j in size] for i in size])
    return Materials(
        names=[name for name, _ in types],
        youngs_moduli_pa=[material.youngs_modulus_pa for _, material in types],
        poissons_ratios=[material.poissons_ratio for _, material in types],
        law=law,
    )


def _bodies_data(experiment: Experiment) -> str:
    """The data file, with a box that no particle can leave."""
    duration = experiment.steps * experiment.timestep_s
    x, y, z = (_side(experiment, axis, duration) for axis in range(3))
    densities = [material.density_kg_m3 for _, material in experiment.types]
    bodies = [
        DataBody(density_kg_m3=densities[body.type - 1], **dict(body)) for body in experiment.bodies
    ]
    return data_file(experiment.title, len(experiment.types), (x, y, z), bodies)


def _side(experiment: Experiment, axis: int, duration_s: float) -> tuple[float, float]:
    """Bounds of the box along an axis: where the fastest particle could get, and some room, m."""
    places = [body.position_m[axis] for body in experiment.bodies]
    speed = max(math.hypot(*body.velocity_m_s) for body in experiment.bodies)
    fall = 0.5 * math.hypot(*experiment.gravity_m_s2) * duration_s**2
    walled = len(experiment.walls) > 0 and axis == 2
    reach = 0.0 if walled else 2 * speed * duration_s + fall
    room = reach + 4 * max(body.radius_m for body in experiment.bodies)
    return round_to(min(places) - room, 6), round_to(max(places) + room, 6)


def _direction(vector: Vector, size: float) -> Vector:
    if size == 0:
        return (0, 0, -1)
    x, y, z = (component / size for component in vector)
    return (x, y, z)


def _case(experiment: Experiment) -> CollideCase:
    return CollideCase(
        study=experiment.group,
        title=experiment.title,
        run=experiment.run,
        timestep_s=experiment.timestep_s,
        rayleigh_time_s=experiment.rayleigh_time_s,
        versions={"dragdeck": __version__},
        gravity_m_s2=experiment.gravity_m_s2,
        limit_force=experiment.limit_force,
        fidelity=RanksOfRun(ranks=1),
        media=CountOfRun(count=len(experiment.bodies)),
        types=[
            NamedMaterial(name=name, **material.model_dump()) for name, material in experiment.types
        ],
        pairs=[
            MeetingPair(types=types, **pair.model_dump())
            for types, pair in experiment.pairs.items()
        ],
        bodies=experiment.bodies,
        walls=experiment.walls,
        **dict(experiment.facts),
    )

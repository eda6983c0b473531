"""A few particles and plane walls, placed and set in motion one by one: a run of the suite."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic.dataclasses import dataclass as checked

from dragdeck import __version__
from dragdeck.cases.case import digest
from dragdeck.decks import outputs
from dragdeck.decks.deck import Body as DataBody
from dragdeck.decks.deck import Materials, Scene, Vector, contact_law, data_file
from dragdeck.parts import omitted
from dragdeck.physics.contact_mechanics import rayleigh_time
from dragdeck.physics.rounding import round_to
from dragdeck.records.run import CaseFile, CountOfRun, RanksOfRun
from dragdeck.study.contact_law import Contact, Pair, RollingModel
from dragdeck.study.workpiece import Material
from evidence.placed import CollideDeck, ExactPlane

_FRAMES_TIMES_BODIES = 25_000
"""Rows of the largest output of a run: every step for two particles, fewer frames for a rack."""


@checked(frozen=True)
class PlacedSphere:
    """A particle: material type from 1, radius m, place m, velocity m/s and spin rad/s."""

    type: int
    radius_m: float
    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0, 0.0)
    spin_rad_s: Vector = (0.0, 0.0, 0.0)


@checked(frozen=True)
class ContactFacts:
    """A contact of an experiment: particles by number, or ``plane``; the value that is varied."""

    particle: int
    partner: int | str
    value: float


class NamedMaterial(Material):
    """A type's material."""

    name: str


class MeetingPair(Pair):
    """What two types do to each other."""

    types: tuple[int, int]


class CollideCase(CaseFile):
    """A few particles and walls, one by one, and what they test.

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
    rolling_model : str
        Of the study's contact law.
    impacts, angle_deg : int, float
        Of a bouncing particle and of an incline alone.
    """

    remedy = "run `./run verify`"

    study_name: str = "verification"
    scene: Literal["collide"] = "collide"
    run: str = ""
    versions: Mapping[str, str] = {"dragdeck": __version__}
    test: str
    number: int
    heading: str
    series: str
    vary: str
    steps_per_contact: int
    contacts: Sequence[ContactFacts]
    impacts: int | None = None
    angle_deg: float | None = None
    gravity_m_s2: Vector = (0.0, 0.0, 0.0)
    limit_force: bool = True
    rolling_model: RollingModel = omitted("epsd2")
    fidelity: RanksOfRun = RanksOfRun(ranks=1)
    media: CountOfRun
    types: Sequence[NamedMaterial]
    pairs: Sequence[MeetingPair]
    bodies: Sequence[PlacedSphere]
    walls: Sequence[ExactPlane] = ()

    def type_of(self, body: int | str) -> int:
        """Type of a particle, by its number, or of a wall, by its name."""
        if isinstance(body, int):
            return self.bodies[body - 1].type
        return next(wall.type for wall in self.walls if wall.name == body)


Experiment = Scene[CollideCase]
"""A run of the suite."""


def experiment(
    test: str,
    number: int,
    heading: str,
    slug: Sequence[str],
    *,
    types: Sequence[tuple[str, Material]],
    pairs: Mapping[tuple[int, int], Pair],
    bodies: Sequence[PlacedSphere],
    steps: int,
    period: int | None = None,
    **more: Any,
) -> Experiment:
    """An experiment with its run id: a slug and 8 hex digits of all it depends on.

    Parameters
    ----------
    test, number, heading
        Of the test.
    slug : sequence of str
        The readable part of the run id, after the name.
    types : sequence of (str, Material)
        A name and a material for each type.
    pairs : mapping of (int, int) to Pair
        Types (from 1, the smaller first) that meet, and what they do to each other.
    bodies : sequence of PlacedSphere
        The first sets the Rayleigh time.
    steps, period : int
        Of the run, and between frames if given.
    **more
        Further fields of `CollideCase`.
    """
    case = CollideCase(
        **{"title": heading, **more},
        test=test,
        number=number,
        heading=heading,
        rayleigh_time_s=rayleigh_time(types[0][1], bodies[0].radius_m),
        media=CountOfRun(count=len(bodies)),
        types=[NamedMaterial(name=name, **material.model_dump()) for name, material in types],
        pairs=[MeetingPair(types=met, **pair.model_dump()) for met, pair in pairs.items()],
        bodies=bodies,
    )
    silent = {"title", "heading", "versions", "study_name"}
    content = case.model_dump(mode="json", by_alias=True, exclude=silent)
    content["study"] = case.study_name
    run = "-".join([test, *slug, digest({**content, "steps": steps})])
    return _scene(case.model_copy(update={"run": run}), steps, period)


def _scene(case: CollideCase, steps: int, period: int | None) -> Experiment:
    """One engine process, no checkpoints, no pair output; a run of many particles stays small."""
    every = period or max(1, math.ceil(steps * len(case.bodies) / _FRAMES_TIMES_BODIES))
    look = max(1, steps // 10)
    (x, y, z), size = case.gravity_m_s2, math.hypot(*case.gravity_m_s2)
    deck = CollideDeck(
        title=case.title,
        study=case.study_name,
        scene=case.scene,
        run=case.run,
        source="bodies.data",
        materials=_pair_table(case),
        limit_force=case.limit_force,
        gravity_m_s2=size,
        gravity_direction=(x / size, y / size, z / size) if size else (0, 0, -1),
        skin_m=round_to(0.2 * min(body.radius_m for body in case.bodies), 3),
        timestep_s=case.timestep_s,
        outputs=(
            outputs.thermo(look, steps // look * look),
            outputs.bodies(every, steps // every * every, [wall.name for wall in case.walls]),
        ),
        thermo_steps=look,
        walls=case.walls,
        steps=steps,
    )
    return Scene(
        deck=deck,
        case=case,
        steps=steps,
        files={"bodies.data": lambda: _bodies_data(case, steps * case.timestep_s)},
    )


def _pair_table(case: CollideCase) -> Materials:
    """The engine's constants; pairs that never meet repeat one that does."""
    pairs, size = {pair.types: pair for pair in case.pairs}, range(1, len(case.types) + 1)
    other = case.pairs[0]
    table = [[pairs.get((min(i, j), max(i, j)), other) for j in size] for i in size]
    law = contact_law(table, Contact(rolling_model=case.rolling_model))
    return Materials(
        names=[material.name for material in case.types],
        youngs_moduli_pa=[material.youngs_modulus_pa for material in case.types],
        poissons_ratios=[material.poissons_ratio for material in case.types],
        law=law,
    )


def _bodies_data(case: CollideCase, duration_s: float) -> str:
    """The data file, with a box that no particle can leave."""
    x, y, z = (_side(case, axis, duration_s) for axis in range(3))
    bodies = [
        DataBody(density_kg_m3=case.types[body.type - 1].density_kg_m3, **vars(body))
        for body in case.bodies
    ]
    return data_file(case.title, len(case.types), (x, y, z), bodies)


def _side(case: CollideCase, axis: int, duration_s: float) -> tuple[float, float]:
    """Bounds of the box along an axis: where the fastest particle could get, and some room, m."""
    places = [body.position_m[axis] for body in case.bodies]
    speed = max(math.hypot(*body.velocity_m_s) for body in case.bodies)
    fall = 0.5 * math.hypot(*case.gravity_m_s2) * duration_s**2
    walled = len(case.walls) > 0 and axis == 2
    reach = 0.0 if walled else 2 * speed * duration_s + fall
    room = reach + 4 * max(body.radius_m for body in case.bodies)
    return round_to(min(places) - room, 6), round_to(max(places) + room, 6)

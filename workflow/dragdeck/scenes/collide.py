"""A few balls and plane walls, placed and set in motion one by one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from dragdeck import __version__, outputs
from dragdeck.scenes.common import Deck, LeftOut, Materials, Scene, round_to
from dragdeck.study import Material, Pair

Vector = tuple[float, float, float]

FRAMES_TIMES_BODIES = 25_000
"""Rows of the largest output of a run: every step for two balls, fewer frames for a rack."""


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


@dataclass(frozen=True)
class Body:
    """A ball: material type (from 1), radius (m), place (m), velocity (m/s) and spin (rad/s)."""

    type: int
    radius_m: float
    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0, 0.0)
    spin_rad_s: Vector = (0.0, 0.0, 0.0)


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
    facts : mapping
        What else goes into ``case.json``.
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
    facts: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class CollideDeck(Deck):
    """What the collide template sees."""

    walls: Sequence[Wall]
    steps: int


def collide_scene(experiment: Experiment) -> Scene:
    """The scene of an experiment: one engine process, no checkpoints, no pair output."""
    every = experiment.period or frame_period(experiment.steps, len(experiment.bodies))
    last = experiment.steps // every * every
    look = max(1, experiment.steps // 10)
    size = math.hypot(*experiment.gravity_m_s2)
    deck = CollideDeck(
        title=experiment.title,
        study=experiment.group,
        scene="collide",
        run=experiment.run,
        source="bodies.data",
        materials=pair_table(experiment.types, experiment.pairs),
        limit_force=experiment.limit_force,
        gravity_m_s2=size,
        gravity_direction=_direction(experiment.gravity_m_s2, size),
        skin_m=skin(experiment.bodies),
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
        case=_case(experiment, deck),
        steps=experiment.steps,
        files={"bodies.data": bodies_data(experiment)},
        models={"every ball": "placed and set in motion by hand", "exact walls": "planes"},
        leaves_out={
            "output of pairs": LeftOut("forces on so few balls say all"),
            "checkpoints": LeftOut("the run takes seconds"),
        },
    )


def frame_period(steps: int, bodies: int) -> int:
    """Steps between frames, so that a run of many balls stays small."""
    return max(1, math.ceil(steps * bodies / FRAMES_TIMES_BODIES))


def skin(bodies: Sequence[Body]) -> float:
    """Neighbour skin, m: a fifth of the smallest radius."""
    return round_to(0.2 * min(body.radius_m for body in bodies), 3)


def pair_table(
    types: Sequence[tuple[str, Material]], pairs: Mapping[tuple[int, int], Pair]
) -> Materials:
    """The engine's constants; pairs that never meet repeat one that does."""
    other = next(iter(pairs.values()))
    size = range(1, len(types) + 1)
    table = [pairs.get((min(i, j), max(i, j)), other) for i in size for j in size]
    return Materials(
        names=[name for name, _ in types],
        youngs_moduli_pa=[material.youngs_modulus_pa for _, material in types],
        poissons_ratios=[material.poissons_ratio for _, material in types],
        restitutions=[pair.restitution for pair in table],
        frictions=[pair.friction for pair in table],
    )


def bodies_data(experiment: Experiment) -> str:
    """The engine's data file, with a box that no ball can leave."""
    duration = experiment.steps * experiment.timestep_s
    sides = [_side(experiment, axis, duration) for axis in range(3)]
    box = "".join(
        f"{low!r} {high!r} {axis}lo {axis}hi\n"
        for axis, (low, high) in zip("xyz", sides, strict=True)
    )
    atoms, velocities = "", ""
    for number, body in enumerate(experiment.bodies, start=1):
        density = experiment.types[body.type - 1][1].density_kg_m3
        place = " ".join(repr(float(x)) for x in body.position_m)
        atoms += f"{number} {body.type} {2 * body.radius_m!r} {density!r} {place}\n"
        motion = " ".join(repr(float(x)) for x in (*body.velocity_m_s, *body.spin_rad_s))
        velocities += f"{number} {motion}\n"
    count, types = len(experiment.bodies), len(experiment.types)
    return (
        f"{experiment.title}\n\n{count} atoms\n{types} atom types\n"
        f"\n{box}\nAtoms\n\n{atoms}\nVelocities\n\n{velocities}"
    )


def _side(experiment: Experiment, axis: int, duration_s: float) -> tuple[float, float]:
    """Bounds of the box along an axis: where the fastest ball could get, and some room, m."""
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


def _case(experiment: Experiment, deck: CollideDeck) -> dict[str, Any]:
    return {
        "schema": 1,
        "study": experiment.group,
        "title": experiment.title,
        "scene": "collide",
        "run": experiment.run,
        "timestep_s": experiment.timestep_s,
        "rayleigh_time_s": experiment.rayleigh_time_s,
        "gravity_m_s2": list(experiment.gravity_m_s2),
        "limit_force": experiment.limit_force,
        "fidelity": {"ranks": 1, "skin_m": deck.skin_m},
        "media": {"count": len(experiment.bodies)},
        "types": [
            {"name": name, **material.model_dump(mode="json")}
            for name, material in experiment.types
        ],
        "pairs": [
            {"types": list(types), **pair.model_dump(mode="json")}
            for types, pair in experiment.pairs.items()
        ],
        "bodies": [asdict(body) for body in experiment.bodies],
        "walls": [asdict(wall) for wall in experiment.walls],
        "phases": [],
        "versions": {"dragdeck": __version__},
        **experiment.facts,
    }

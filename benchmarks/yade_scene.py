"""Run by Yade's own Python: the scene of a JSON file, its times and its drag into another.

    yade -n -x -j 1 yade_scene.py scene.json result.json

``yade.py`` writes the first file and describes both.
"""

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

from yade import (
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Facet_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    Law2_ScGeom_MindlinPhys_Mindlin,
    MatchMaker,
    NewtonIntegrator,
    O,
    PyRunner,
    RotationEngine,
    TranslationEngine,
    config,
    utils,
)

Point = tuple[float, float, float]


def bowl(radius: float, height: float, sides: int) -> list[list[Point]]:
    """One triangle as the floor and, outside the circle, two for every side of a polygon."""
    floor = [(2 * radius * math.cos(a), 2 * radius * math.sin(a), 0.0) for a in _corners(3)]
    outer = radius / math.cos(math.pi / sides)
    ring = [(outer * math.cos(angle), outer * math.sin(angle)) for angle in _corners(sides)]
    triangles = [floor]
    for (x0, y0), (x1, y1) in zip(ring, [*ring[1:], ring[0]], strict=True):
        triangles.append([(x0, y0, 0.0), (x1, y1, 0.0), (x1, y1, height)])
        triangles.append([(x0, y0, 0.0), (x1, y1, height), (x0, y0, height)])
    return triangles


def _corners(sides: int) -> list[float]:
    return [2 * math.pi * number / sides for number in range(sides)]


def pairs(contacts: list[dict[str, Any]], name: str) -> MatchMaker:
    """A value for each pair of materials; facets never touch facets."""
    matches = [(one["first"], one["second"], one[name]) for one in contacts]
    return MatchMaker(matches=matches)


def build(scene: dict[str, Any]) -> list[int]:
    """Bodies and engines of the scene; the workpiece's ids."""
    for young, poisson in scene["materials"]:
        O.materials.append(FrictMat(young=young, poisson=poisson, density=scene["density_kg_m3"]))
    for x, y, z, radius, *motion in scene["particles"]:
        number = O.bodies.append(utils.sphere((x, y, z), radius, material=0))
        O.bodies[number].state.vel = motion[:3]
        O.bodies[number].state.angVel = motion[3:]
    walls = bowl(scene["bowl_radius_m"], scene["bowl_height_m"], scene["bowl_sides"])
    O.bodies.append([utils.facet(triangle, material=1) for triangle in walls])
    facets = [utils.facet(triangle, material=2) for triangle in scene["workpiece"]]
    workpiece = O.bodies.append(facets)
    contacts = scene["contacts"]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=scene["verlet_m"]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
            [
                Ip2_FrictMat_FrictMat_MindlinPhys(
                    frictAngle=pairs(contacts, "friction_angle_rad"),
                    betan=pairs(contacts, "damping_ratio"),
                )
            ],
            [Law2_ScGeom_MindlinPhys_Mindlin()],
        ),
        *(engine(leg, workpiece) for leg in scene["legs"]),
        NewtonIntegrator(damping=0, gravity=(0, 0, -scene["gravity_m_s2"])),
        PyRunner(command="sample()", iterPeriod=scene["sample_steps"], label="sampler", dead=True),
    ]
    O.dt = scene["timestep_s"]
    return workpiece


def engine(leg: dict[str, Any], workpiece: list[int]) -> TranslationEngine | RotationEngine:
    """The engine that moves the workpiece along a leg, at first switched off."""
    if "velocity_m_s" in leg:
        velocity = leg["velocity_m_s"]
        speed = math.hypot(*velocity)
        axis = [part / speed for part in velocity]
        return TranslationEngine(velocity=speed, translationAxis=axis, ids=workpiece, dead=True)
    return RotationEngine(
        angularVelocity=leg["angular_speed_rad_s"],
        rotationAxis=(0, 0, 1),
        rotateAroundZero=True,
        zeroPoint=(0, 0, 0),
        ids=workpiece,
        dead=True,
    )


def sample() -> None:
    """Force on the workpiece along its direction of motion, which turns with its path."""
    turned = SCENE["direction_rad"]
    turned += SCENE["legs"][-1].get("angular_speed_rad_s", 0.0) * (O.iter - FIRST) * O.dt
    direction = (math.cos(turned), math.sin(turned), 0.0)
    DRAG.append((O.iter - FIRST, utils.sumForces(WORKPIECE, direction)))


def inside() -> int:
    """Particles whose centre is in the bowl."""
    radius, height = SCENE["bowl_radius_m"], SCENE["bowl_height_m"]
    places = [O.bodies[number].state.pos for number in range(len(SCENE["particles"]))]
    return sum(math.hypot(x, y) < radius and 0 < z < height for x, y, z in places)


source, target = sys.argv[-2:]
SCENE = json.loads(Path(source).read_text())
WORKPIECE = build(SCENE)
DRAG: list[tuple[int, float]] = []
motions = [one for one in O.engines if isinstance(one, TranslationEngine | RotationEngine)]
phases = []
for leg, motion in zip(SCENE["legs"], motions, strict=True):
    motion.dead = False
    sampler.dead = leg is not SCENE["legs"][-1]  # noqa: F821 (Yade makes the label a name)
    FIRST = O.iter
    wall, cpu = time.perf_counter(), time.process_time()
    O.run(leg["steps"], True)
    phases.append(
        {
            "name": leg["name"],
            "steps": leg["steps"],
            "wall_s": time.perf_counter() - wall,
            "cpu_s": time.process_time() - cpu,
            "kinetic_energy_j": utils.kineticEnergy(),
        }
    )
    motion.dead = True
result = {
    "version": config.version,
    "phases": phases,
    "drag": DRAG,
    "contacts": O.interactions.countReal(),
    "particles_in_bowl": inside(),
}
Path(target).write_text(json.dumps(result))

"""The walls of a script where they are at a step: planes, cylinders, and meshes that move."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.physics.contact_mechanics import touching_pairs
from dragdeck.script.facts import Facts, Fix, number, numbers

Towards = Callable[[Floats, Floats, float], Floats]
Place = Callable[[Floats, float], Floats]
"""Points of a wall, (..., 3), at a time step."""


@dataclass(frozen=True)
class Wall:
    """A wall: its type from 0, and what it is.

    Attributes
    ----------
    type : int
    towards : callable
        Vectors from (N, 3) centres to the nearest points of the wall at a step, for spheres of (N,)
        radii; NaN where it is out of reach.
    begin, end : float
        Steps between which it is there.
    """

    type: int
    towards: Towards
    begin: float
    end: float


def walls_of(facts: Facts) -> tuple[list[Wall], list[str]]:
    """The walls whose places are known, and names of the others."""
    walls: list[Wall] = []
    unknown: list[str] = []
    meshes = {fix.id: fix for fix in facts.present("mesh/surface")}
    for fix in facts.present("wall/gran"):
        begin, end = _span(facts, fix)
        if fix.end == math.inf:
            begin = -math.inf  # nothing is known of frames before
        elif math.isnan(begin):
            unknown.append(fix.id)
            continue
        type_ = [*facts.wall_types(fix), 1][0] - 1
        for name, towards in _shapes(facts, fix, meshes):
            if towards is None:
                unknown.append(name)
            else:
                walls.append(Wall(type_, towards, begin, end if fix.end < math.inf else math.inf))
    return walls, unknown


def _shapes(
    facts: Facts, fix: Fix, meshes: Mapping[str, Fix]
) -> Iterator[tuple[str, Towards | None]]:
    """The shapes of a wall; None for one that is not known."""
    if "primitive" in fix.words:
        shape = "".join(fix.after("type", 2)[1:])
        sizes = numbers(fix.after(shape, 1 if "plane" in shape else 3)) if shape else None
        yield fix.id, _primitive(shape, sizes) if sizes else None
    for name in facts.meshes_of(fix):
        triangles = _triangles(meshes[name], facts.script.file.parent) if name in meshes else None
        motions = _motions(facts, name)
        known = triangles is not None and motions is not None
        yield name, _mesh(triangles, motions) if known else None  # type: ignore[arg-type]


def contacts_with(
    centre: Floats, radius: Floats, walls: Sequence[Wall], step: float
) -> tuple[Ints, Floats, Floats]:
    """Contacts of particles with each other and with walls, whose bodies are N, N + 1, ...

    Returns
    -------
    (2, M), (M, 3) and (M,) ndarray
        As `dragdeck.physics.contact_mechanics.touching`.
    """
    parts = [touching_pairs(centre, radius)]
    for body, wall in enumerate(walls, start=len(radius)):
        if not wall.begin <= step <= wall.end:
            continue
        away = wall.towards(centre, radius, step)
        distance = np.linalg.norm(away, axis=1)
        hit = np.flatnonzero((distance < radius) & (distance > 0))
        bodies = np.stack([hit, np.full(len(hit), body)])
        parts.append((bodies, away[hit] / distance[hit, None], radius[hit] - distance[hit]))
    every, normals, overlaps = zip(*parts, strict=True)
    return np.concatenate(every, axis=1), np.concatenate(normals), np.concatenate(overlaps)


def _primitive(shape: str, sizes: Sequence[float]) -> Towards:
    axis = "xyz".index(shape[0])

    def plane(centre: Floats, radius: Floats, step: float) -> Floats:
        away = np.zeros_like(centre)
        away[:, axis] = sizes[0] - centre[:, axis]
        return away

    def cylinder(centre: Floats, radius: Floats, step: float) -> Floats:
        away = np.zeros_like(centre)
        across = [number for number in range(3) if number != axis]
        out = centre[:, across] - sizes[1:3]
        distance = np.linalg.norm(out, axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):
            away[:, across] = out / distance * (sizes[0] - distance)
        return away

    return plane if "plane" in shape else cylinder


def _mesh(triangles: Floats, place: Place) -> Towards:
    middle = triangles.mean(axis=1)
    size = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1)

    def towards(centre: Floats, radius: Floats, step: float) -> Floats:
        from scipy.spatial import KDTree
        from trimesh.triangles import closest_point

        moved = place(triangles, step)
        near = KDTree(centre).query_ball_point(moved.mean(axis=1), size + radius.max())
        rows = np.concatenate([np.empty(0, np.int64), *map(np.int64, filter(None, near))])
        facets = np.repeat(np.arange(len(moved)), [len(each) for each in near])
        ways = closest_point(moved[facets], centre[rows]) - centre[rows]
        farthest_first = np.argsort(-np.linalg.norm(ways, axis=1))
        away = np.full_like(centre, np.nan)
        away[rows[farthest_first]] = ways[farthest_first]
        return away

    return towards


def _triangles(mesh: Fix, folder: Path) -> Floats | None:
    """Corners of the facets of a mesh as it is loaded, (F, 3, 3); None if they are not known."""
    import trimesh

    file = folder / "".join(mesh.after("file"))
    if not file.is_file() or any("$" in word for word in mesh.words):
        return None
    loaded = trimesh.load_mesh(file, process=False)
    corners = np.asarray(loaded.triangles, dtype=np.float64)
    for at, word in enumerate(mesh.words):
        values = mesh.words[at + 1 : at + 7]
        if word == "scale":
            corners = corners * float(values[0])
        elif word == "move":
            corners = corners + np.array(values[:3], dtype=float)
        elif word == "rotate" and values[0] == "axis":
            turn = _turn(np.array(values[1:4], dtype=float), math.radians(float(values[5])))
            corners = corners @ turn.T
    return corners


def _turn(axis: Floats, angle: float) -> Floats:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix())


def _motions(facts: Facts, mesh: str) -> Place | None:
    """How a mesh moves; None where that cannot be followed."""
    motions = [fix for fix in facts.present("move/mesh") if mesh in fix.words]
    spans = sorted((*_span(facts, fix), fix.words[3:]) for fix in motions)
    if any(first[1] > second[0] for first, second in pairwise(spans)) or facts.timestep_s is None:
        return None if motions else lambda points, step: points
    acts = []
    for begin, end, words in spans:
        act = _act(words, facts.timestep_s)
        if act is None or math.isnan(begin):
            return None
        acts.append((begin, end, act))

    def place(points: Floats, step: float) -> Floats:
        for begin, end, act in acts:
            points = act(points, max(min(step, end) - begin, 0.0))
        return points

    return place


def _act(words: Sequence[str], timestep_s: float) -> Place | None:
    """Points after so many steps of a motion."""
    if any("$" in word for word in words):
        return None
    match list(words):
        case ["linear", *velocity]:
            way = np.array(velocity[:3], dtype=float)
            return lambda points, steps: points + way * steps * timestep_s
        case ["rotate", "origin", x, y, z, "axis", u, v, w, "period", period]:
            origin, axis = np.array([x, y, z], dtype=float), np.array([u, v, w], dtype=float)
            rate = 2 * math.pi * timestep_s / float(period)
            return lambda points, steps: (points - origin) @ _turn(axis, rate * steps).T + origin
        case ["wiggle", "amplitude", x, y, z, "period", period]:
            amplitude = np.array([x, y, z], dtype=float)
            rate = 2 * math.pi * timestep_s / float(period)
            return lambda points, steps: points + amplitude * math.sin(rate * steps)
    return None


def _span(facts: Facts, fix: Fix) -> tuple[float, float]:
    """First and last step of a fix; NaN if not known."""
    commands = facts.script.commands
    begin = next((c for c in commands[int(fix.begin) :] if c.words[0] == "run"), None)
    end = math.inf if fix.end == math.inf else commands[int(fix.end)].step
    known = begin is not None and begin.step is not None and end is not None
    return (begin.step, end) if known else (math.nan, math.nan)  # type: ignore[union-attr,return-value]


def speeds(facts: Facts, bounds_m: Floats) -> Iterator[float]:
    """Speeds of insertions, meshes and rims, m/s; NaN for one that is not known.

    Parameters
    ----------
    facts : Facts
    bounds_m : (2, 3) ndarray
        Of the particles: a rim is where they are.
    """
    for fix in facts.present(""):
        words = fix.words
        if words[0].startswith("insert/"):
            yield _length(fix, "constant")
        elif words[0] == "move/mesh" and words[3:4] in (["linear"], ["rotate"], ["wiggle"]):
            yield _length(fix, "linear")
            rate = 2 * math.pi / abs(_number(fix, "period") or math.inf)
            yield rate * (_length(fix, "amplitude") or _reach(fix, bounds_m))
        elif words[0].startswith("mesh/surface"):
            yield _length(fix, "surface_vel")
            yield abs(_number(fix, "omega")) * _reach(fix, bounds_m)
        elif words[0] in ("move", "move/mesh", "adapt", "setforce"):
            yield math.nan


def _number(fix: Fix, keyword: str) -> float:
    """The number after a keyword; 0 without it, NaN if it is not known."""
    value = number("".join(fix.after(keyword) or ["0"]))
    return math.nan if value is None else value


def _length(fix: Fix, keyword: str) -> float:
    """Length of the vector after a keyword; 0 without it, NaN if it is not known."""
    values = numbers(fix.after(keyword, 3))
    return math.nan if values is None else math.hypot(*values)


def _reach(fix: Fix, bounds_m: Floats) -> float:
    """Largest distance of particles from the axis of a rotation, m; 0 without one."""
    origin, axis = numbers(fix.after("origin", 3)), numbers(fix.after("axis", 3))
    if not origin or not axis:
        return 0.0 if origin == axis == [] else math.nan
    corners = np.array(np.meshgrid(*bounds_m.T)).reshape(3, -1).T - origin
    return float(np.linalg.norm(np.cross(corners, axis), axis=1).max() / np.linalg.norm(axis))

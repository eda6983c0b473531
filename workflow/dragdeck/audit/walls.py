"""The walls of a script where they are at a step: planes, cylinders, and meshes that move."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.errors import InputError
from dragdeck.physics.facets import nearest_of
from dragdeck.physics.walls import from_primitive
from dragdeck.script.facts import Facts, Fix, as_numbers
from dragdeck.study.rotations import by_vector

Place = Callable[[Floats, float], Floats]
"""Points of a wall, (..., 3), at a time step."""

Shape = Callable[[float, float, Floats], tuple[Floats, Floats]]
"""At a time step, distances of points from a wall, where they are within a reach, m."""

_PRIMITIVES = {f"{axis}{shape}": sizes for axis in "xyz"
               for shape, sizes in (("plane", 1), ("cylinder", 3))}  # fmt: skip
"""Shapes of walls without a mesh, and how many sizes each has."""


class WallAtStep(NamedTuple):
    """A wall at a time step, of which particles touch both sides.

    Attributes
    ----------
    name : str
    type : int
        From 0.
    distances : callable
        Distances of (N, 3) points, (N,), and unit vectors away from the wall, (N, 3). Those of a
        plane or cylinder are negative on one side, where the vector leads to it.
    """

    name: str
    type: int
    distances: Callable[[Floats], tuple[Floats, Floats]]

    def contacts(self, centre_m: Floats) -> tuple[Floats, Floats]:
        """Distances, (N,), and normals to the points, (N, 3), of (N, 3) points."""
        distance, normal = self.distances(centre_m)
        return np.abs(distance), np.where(distance < 0, -1.0, 1.0)[:, None] * normal


class Walls:
    """The walls of a script; `unknown` are the names of those whose places are not known."""

    def __init__(self, facts: Facts) -> None:
        self.unknown: list[str] = []
        self.known: list[tuple[float, float, str, int, Shape]] = []
        for fix in facts.present("wall/gran"):
            begin, end = _span(facts, fix)
            begin = -math.inf if fix.end == math.inf else begin  # whatever was before
            sure = fix.command.words[2] == "all" and not fix.command.uncertain
            for name, shape in _shapes(facts, fix):
                if shape is None or math.isnan(begin) or not sure:
                    self.unknown.append(name)
                else:
                    type_ = [*facts.wall_types(fix), 1][0] - 1
                    self.known.append((begin, end, name, type_, shape))

    def at(self, step: float, reach_m: float) -> list[WallAtStep]:
        """Those that are there at a step; their distances beyond the reach may be infinite."""
        return [
            WallAtStep(name, type_, partial(shape, step, reach_m))
            for begin, end, name, type_, shape in self.known
            if begin <= step <= end
        ]


def _shapes(facts: Facts, fix: Fix) -> Iterator[tuple[str, Shape | None]]:
    """The shapes of a wall; None for one that is not known."""
    if "primitive" in fix.words:
        shape = "".join(fix.after("type", 2)[1:])
        count = _PRIMITIVES.get(shape, 0)
        sizes = as_numbers(fix.after(shape, count), count) if count else None
        yield fix.id, partial(_from_primitive, shape, sizes) if sizes else None
    for name in facts.meshes_of(fix):
        triangles = _triangles(facts, facts.meshes[name]) if name in facts.meshes else None
        place = _place(facts, name)
        if triangles is None or place is None:
            yield name, None
        else:
            yield name, partial(_from_facets, triangles, place)


def _from_primitive(
    shape: str, sizes: Sequence[float], step: float, reach_m: float, centre_m: Floats
) -> tuple[Floats, Floats]:
    return from_primitive(shape, sizes, centre_m)


def _from_facets(
    triangles: Floats, place: Place, step: float, reach_m: float, centre_m: Floats
) -> tuple[Floats, Floats]:
    """Distances of points from the nearest of (F, 3, 3) facets; infinite beyond the reach."""
    from scipy.spatial import KDTree

    corners = place(triangles, step)
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    near = KDTree(centre_m).query_ball_point(middle, size + reach_m)
    facets = np.repeat(np.arange(len(near)), [len(points) for points in near])
    points = np.concatenate([np.empty(0, np.int64), *map(np.int64, filter(None, near))])
    return nearest_of(centre_m, corners, points, facets)


def _triangles(facts: Facts, mesh: Fix) -> Floats | None:
    """Corners of the facets of a mesh as it is loaded, (F, 3, 3); None if they are not known."""
    from dragdeck.mesh.files import read

    try:
        corners = np.asarray(read(facts.script.file.parent / mesh.word("file"), "m").triangles)
    except (InputError, OSError):
        return None
    for at, word in enumerate(mesh.words):
        counts = {"scale": (1,), "move": (1, 2, 3), "rotate": (2, 3, 4, 6)}.get(word, ())
        sizes = as_numbers(["".join(mesh.words[at + n : at + n + 1]) for n in counts])
        if sizes is None:
            return None
        if word == "rotate":
            corners = _turned(corners, sizes[:3], math.radians(sizes[3]))
        elif counts:
            corners = corners * sizes[0] if word == "scale" else corners + sizes
    return corners


def _turned(points: Floats, axis: Sequence[float], angle: float) -> Floats:
    return points @ by_vector(np.array(axis) * angle / (math.hypot(*axis) or 1.0)).T


def _place(facts: Facts, mesh: str) -> Place | None:
    """Where a mesh is; None where its motion cannot be followed."""
    motions = [fix for fix in facts.present("move/mesh") if mesh in fix.words]
    acts = sorted(((*_span(facts, fix), _motion(fix, facts.timestep_s)) for fix in motions),
                  key=lambda act: act[:2])  # fmt: skip
    apart = all(first[1] <= second[0] for first, second in pairwise(acts))
    if not apart or any(act is None or math.isnan(begin) for begin, _, act in acts):
        return None

    def place(points: Floats, step: float) -> Floats:
        for begin, end, act in acts:
            points = act(points, max(min(step, end) - begin, 0.0)) if act else points
        return points

    return place


def _motion(motion: Fix, timestep_s: float | None) -> Place | None:
    """Points after so many steps of a motion; None where it cannot be followed."""
    kind, period = "".join(motion.words[3:4]), motion.number("period")
    way = motion.vector("linear") or motion.vector("amplitude")
    rate = 2 * math.pi * timestep_s / period if timestep_s and period else math.nan
    if kind == "linear" and way and timestep_s:
        return lambda points, steps: points + np.array(way) * steps * timestep_s
    if kind == "wiggle" and way and not math.isnan(rate):
        return lambda points, steps: points + np.array(way) * math.sin(rate * steps)
    origin, axis = motion.vector("origin"), motion.vector("axis")
    if kind == "rotate" and origin and axis and not math.isnan(rate):
        return lambda points, steps: _turned(points - origin, axis, rate * steps) + origin
    return None


def _span(facts: Facts, fix: Fix) -> tuple[float, float]:
    """First and last step of a fix; NaN if not known."""
    commands = facts.script.commands
    begin = next((c.step for c in commands[int(fix.begin) :] if c.words[0] == "run"), None)
    end = math.inf if fix.end == math.inf else commands[int(fix.end)].step
    return (math.nan, math.nan) if begin is None or end is None else (begin, end)


def speeds(facts: Facts, bounds_m: Floats) -> Iterator[float | None]:
    """Speeds of insertions, meshes and rims, m/s; None for one that is not known.

    Parameters
    ----------
    facts : Facts
    bounds_m : (2, 3) ndarray
        Of the particles: a rim is where they are.
    """
    corners = np.array(np.meshgrid(*bounds_m.T)).reshape(3, -1).T
    for fix in facts.present(""):
        style, act = fix.words[0], _motion(fix, facts.timestep_s)
        if style == "move/mesh" and act and facts.timestep_s:
            away = act(corners, 1.0) - act(corners, 0.0)
            yield float(np.linalg.norm(away, axis=1).max()) / facts.timestep_s
        elif style in ("move", "move/mesh", "adapt", "setforce"):
            yield None
        elif style.startswith("insert/") and fix.word("vel"):
            count = {"constant": 4, "uniform": 7}.get(fix.word("vel"), 0)
            yield _length(as_numbers(fix.after("vel", count)[1:], 3))
        elif "surface_vel" in fix.words:
            yield _length(fix.vector("surface_vel"))
        elif "omega" in fix.words:
            axis, origin, rate = fix.vector("axis"), fix.vector("origin"), fix.number("omega")
            if axis and any(axis) and origin and rate is not None:
                reach = np.linalg.norm(np.cross(corners - origin, axis), axis=1).max()
                yield abs(rate) * float(reach) / math.hypot(*axis)
            else:
                yield None
        elif "shear" in fix.words:  # m/s; of a cylinder rad/s, unless along its axis
            speed, cylinder = as_numbers(fix.after("shear", 2)[1:], 1), fix.after("type", 3)[1:]
            radius = as_numbers(cylinder[1:], 1) if "cylinder" in "".join(cylinder[:1]) else [1.0]
            yield abs(speed[0]) * max(radius[0], 1.0) if speed and radius else None


def _length(vectors: Sequence[float] | None) -> float | None:
    """Sum of the lengths of a vector and of one that may follow; None if they are not known."""
    return math.hypot(*vectors[:3]) + math.hypot(*vectors[3:]) if vectors else None

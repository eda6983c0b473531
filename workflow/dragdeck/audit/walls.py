"""The walls of a script where they are at a step: planes, cylinders, and meshes that move."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.errors import InputError
from dragdeck.physics.facets import nearest_of
from dragdeck.physics.walls import from_primitive
from dragdeck.script.facts import Facts, Fix, as_number, as_numbers
from dragdeck.study.drive import by_vector

Place = Callable[[Floats, float], Floats]
"""Points of a wall, (..., 3), at a time step."""

Distances = Callable[[Floats], tuple[Floats, Floats]]
Shape = Callable[[float, float], Distances]
"""Distances of points from a wall at a time step, where they are within a reach, m."""

_PRIMITIVES = {
    f"{axis}{shape}": count for axis in "xyz" for shape, count in (("plane", 1), ("cylinder", 3))
}
"""Shapes of walls without a mesh, and how many sizes each has."""


@dataclass(frozen=True)
class WallAtStep:
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
    distances: Distances

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
            if fix.end == math.inf:
                begin = -math.inf  # nothing is known of frames before
            sure = fix.command.words[2] == "all" and not fix.command.uncertain
            type_ = [*facts.wall_types(fix), 1][0] - 1
            for name, shape in _shapes(facts, fix):
                if shape is None or math.isnan(begin) or not sure:
                    self.unknown.append(name)
                else:
                    self.known.append((begin, end, name, type_, shape))

    def at(self, step: float, reach_m: float) -> list[WallAtStep]:
        """Those that are there at a step; their distances beyond the reach may be infinite."""
        return [
            WallAtStep(name, type_, shape(step, reach_m))
            for begin, end, name, type_, shape in self.known
            if begin <= step <= end
        ]


def _shapes(facts: Facts, fix: Fix) -> Iterator[tuple[str, Shape | None]]:
    """The shapes of a wall; None for one that is not known."""
    if "primitive" in fix.words:
        shape = "".join(fix.after("type", 2)[1:])
        count = _PRIMITIVES.get(shape, 0)
        sizes = as_numbers(fix.after(shape, count), count) if count else None
        yield fix.id, (lambda *_: partial(from_primitive, shape, sizes)) if sizes else None
    for name in facts.meshes_of(fix):
        triangles = _triangles(facts, facts.meshes[name]) if name in facts.meshes else None
        place = _place(facts, name)
        if triangles is None or place is None:
            yield name, None
        else:
            yield name, partial(_moved, triangles, place)


def _moved(triangles: Floats, place: Place, step: float, reach_m: float) -> Distances:
    return partial(_from_facets, place(triangles, step), reach_m)


def _from_facets(corners_m: Floats, reach_m: float, centre_m: Floats) -> tuple[Floats, Floats]:
    """Distances of points from the nearest of (F, 3, 3) facets; infinite beyond the reach."""
    from scipy.spatial import KDTree

    middle = corners_m.mean(axis=1)
    size = np.linalg.norm(corners_m - middle[:, None], axis=2).max(axis=1)
    near = KDTree(centre_m).query_ball_point(middle, size + reach_m)
    triangles = np.repeat(np.arange(len(near)), [len(points) for points in near])
    points = np.concatenate([np.empty(0, np.int64), *map(np.int64, filter(None, near))])
    return nearest_of(centre_m, corners_m, points, triangles)


def _triangles(facts: Facts, mesh: Fix) -> Floats | None:
    """Corners of the facets of a mesh as it is loaded, (F, 3, 3); None if they are not known."""
    from dragdeck.mesh.files import read

    corners: Floats | None
    try:
        corners = np.asarray(read(facts.script.folder / mesh.word("file"), "m").triangles)
    except (InputError, OSError):
        return None
    for at, word in enumerate(mesh.words):
        if word == "scale":
            factor = as_numbers(mesh.words[at + 1 : at + 2], 1)
            corners = corners * factor if factor else None
        elif word == "move":
            shift = as_numbers(mesh.words[at + 1 : at + 4], 3)
            corners = corners + shift if shift else None
        elif word == "rotate":
            turn = as_numbers([*mesh.words[at + 2 : at + 5], *mesh.words[at + 6 : at + 7]], 4)
            corners = _turned(corners, turn[:3], math.radians(turn[3])) if turn else None
        if corners is None:
            return None
    return corners


def _turned(points: Floats, axis: Sequence[float], angle: float) -> Floats:
    return points @ by_vector(np.array(axis) * angle / (math.hypot(*axis) or 1.0)).T


def _place(facts: Facts, mesh: str) -> Place | None:
    """Where a mesh is; None where its motion cannot be followed."""
    motions = [fix for fix in facts.present("move/mesh") if mesh in fix.words]
    spans = sorted([(*_span(facts, fix), at) for at, fix in enumerate(motions)])
    acts = [(begin, end, _act(motions[at], facts.timestep_s)) for begin, end, at in spans]
    apart = all(first[1] <= second[0] for first, second in pairwise(spans))
    if not apart or any(act is None or math.isnan(begin) for begin, _, act in acts):
        return None

    def place(points: Floats, step: float) -> Floats:
        for begin, end, act in acts:
            if act is not None:
                points = act(points, max(min(step, end) - begin, 0.0))
        return points

    return place


def _act(motion: Fix, timestep_s: float | None) -> Place | None:
    """Points after so many steps of a motion."""
    kind, period = "".join(motion.words[3:4]), as_number(motion.word("period"))
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


def speeds(facts: Facts, bounds_m: Floats) -> Iterator[float]:
    """Speeds of insertions, meshes and rims, m/s; NaN for one that is not known.

    Parameters
    ----------
    facts : Facts
    bounds_m : (2, 3) ndarray
        Of the particles: a rim is where they are.
    """
    corners = np.array(np.meshgrid(*bounds_m.T)).reshape(3, -1).T
    for fix in facts.present(""):
        style = fix.words[0]
        if style.startswith("insert/"):
            yield _length(fix.vector("constant"))
        elif style == "move/mesh" and (act := _act(fix, facts.timestep_s)):
            away = act(corners, 1.0) - act(corners, 0.0)
            yield float(np.linalg.norm(away, axis=1).max()) / (facts.timestep_s or 1.0)
        elif style.startswith("mesh/surface"):
            yield _length(fix.vector("surface_vel"))
            axis, origin = fix.vector("axis"), fix.vector("origin")
            rate = as_number(fix.word("omega") or "0")
            if rate and axis and origin and any(axis):
                reach = np.linalg.norm(np.cross(corners - origin, axis), axis=1).max()
                yield abs(rate) * float(reach) / math.hypot(*axis)
            elif rate != 0:
                yield math.nan
        elif style in ("move", "move/mesh", "adapt", "setforce"):
            yield math.nan


def _length(vector: Sequence[float] | None) -> float:
    """Length of a vector; 0 of none, NaN if it is not known."""
    return math.nan if vector is None else math.hypot(*vector)

"""Triangle surfaces for the engine: made, read, checked, placed and written.

Everything inside is in metres. A *tool* stands upright: +z points along its
axis, away from the floor, and its reference point, the origin, is the middle
of its bounding box in x and y at its lowest z. `cylinder` makes meshes that
stand so; `place` moves a user's mesh there.

The limits that `findings` tests are those of LIGGGHTS 3.8.0, fix mesh/surface.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dragdeck.errors import InputError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
"""Length units that a mesh file may be declared in, in metres."""

NODE_PRECISION_M = 1e-8
"""Nodes closer than this are one node to the engine (its `precision`)."""

CURVATURE_DEG = 0.256235
"""Default of the engine's `curvature`; no facet may have a smaller angle."""

ANGLE_WARNING_DEG = 0.5
"""Below this smallest angle the engine warns of a skewed element."""

MAX_NEIGHBOURS = 5
"""Facets that may share an edge with a facet."""

MAX_FACETS = 200_000
"""More facets than any tool needs: a facet size in the wrong unit."""

MIN_SIDES = 8
"""The coarsest polygon that still passes for a circle."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface made of triangles.

    Parameters
    ----------
    points : (N, 3) float array
        The nodes, in metres.
    triangles : (M, 3) integer array
        Three rows of `points` a facet, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        If the shapes are wrong or a facet names a node that is not there.
    """

    points: Floats
    triangles: Integers

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(self.triangles, dtype=np.int64).reshape(-1, 3)
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(points):
            raise ValueError(f"a facet names a node outside 0 ... {len(points) - 1}")
        points.flags.writeable = triangles.flags.writeable = False
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "triangles", triangles)

    @property
    def bounds(self) -> Floats:
        """(2, 3) array: the lowest and the highest coordinates of the facets, in metres."""
        used = self.points[np.unique(self.triangles)]
        return np.array([used.min(axis=0), used.max(axis=0)])

    @property
    def extent(self) -> Floats:
        """(3,) array: the size of the bounding box, in metres."""
        low, high = self.bounds
        return np.asarray(high - low, dtype=np.float64)

    @cached_property
    def corners(self) -> Floats:
        """(M, 3, 3) array: facet, corner, coordinate, in metres."""
        return self.points[self.triangles]

    @cached_property
    def edge_vectors(self) -> Floats:
        """(M, 3, 3) array: from corner k of a facet to the next one, in metres."""
        return np.asarray(np.roll(self.corners, -1, axis=1) - self.corners)

    @cached_property
    def facet_areas(self) -> Floats:
        """(M,) array, in square metres."""
        return np.asarray(np.linalg.norm(self._area_vectors, axis=1))

    @cached_property
    def normals(self) -> Floats:
        """(M, 3) array of unit vectors; zero for a facet without area."""
        return _unit(self._area_vectors)

    @cached_property
    def angles_deg(self) -> Floats:
        """(M, 3) array: the inner angle at every corner; zero beside an edge without length."""
        edges = _unit(self.edge_vectors)
        backwards = -np.roll(edges, 1, axis=1)
        sine = np.linalg.norm(np.cross(edges, backwards), axis=2)
        cosine = np.einsum("mkc,mkc->mk", edges, backwards)
        return np.asarray(np.degrees(np.arctan2(sine, cosine)))

    @cached_property
    def volume(self) -> float:
        """Enclosed volume in cubic metres; positive if the normals of a closed mesh point out."""
        first, second, third = np.moveaxis(self.corners - self.bounds[0], 1, 0)
        return float(np.einsum("mc,mc->", first, np.cross(second, third)) / 6.0)

    @property
    def closed(self) -> bool:
        """Whether every edge belongs to exactly two facets."""
        return len(self.triangles) > 0 and bool(np.all(self._edge_use == 2))

    @property
    def oriented(self) -> bool:
        """Whether facets that share an edge run along it in opposite directions."""
        directed = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        return len(np.unique(directed, axis=0)) == len(directed)

    @property
    def neighbours(self) -> Integers:
        """(M,) array: how many facets share an edge with a facet."""
        return np.asarray((self._edge_use[self._edge_of] - 1).sum(axis=1))

    @cached_property
    def _area_vectors(self) -> Floats:
        edges = self.edge_vectors
        return np.asarray(np.cross(edges[:, 0], edges[:, 1]) / 2.0)

    @cached_property
    def _edges(self) -> tuple[Integers, Integers]:
        pairs = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        _, index, use = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
        return index.reshape(-1, 3), use

    @property
    def _edge_of(self) -> Integers:
        """(M, 3) array: the number of the edge after every corner."""
        return self._edges[0]

    @property
    def _edge_use(self) -> Integers:
        """How many facets have an edge."""
        return self._edges[1]


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


# --- making -----------------------------------------------------------------


def polygon_sides(radius_m: float, facet_size_m: float) -> int:
    """Sides of the polygon that stands for a circle: a multiple of four, at least eight.

    Four-fold symmetry keeps the axis in the middle of the bounding box.

    Parameters
    ----------
    radius_m, facet_size_m : float
        The circle, and the longest side wanted, in metres.
    """
    quarter = math.ceil(math.pi * radius_m / (2.0 * facet_size_m) - 1e-9)
    return max(MIN_SIDES, 4 * quarter)


def polygon_radius(radius_m: float, sides: int) -> float:
    """Distance of the corners from the axis if the polygon is as long as the circle.

    By Cauchy's theorem (1841) the mean width of a convex outline is its
    perimeter over pi, so a polygon of the circle's perimeter is, averaged over
    the directions of motion, exactly as wide as the circle; a ball's radius
    adds to both alike. Width is what a tool shows to the bed it is dragged
    through, hence this choice and not the inscribed polygon, which is too
    narrow, nor the one of equal area, which is too wide. The corners stand out
    by (pi / sides)^2 / 6 of the radius and the middles of the sides lie inside
    by (pi / sides)^2 / 3, to leading order: 0.16 % and 0.32 % for 32 sides.
    """
    return radius_m * (math.pi / sides) / math.sin(math.pi / sides)


def cylinder(radius_m: float, length_m: float, facet_size_m: float) -> Mesh:
    """Make a closed upright cylinder, its bottom's centre in the origin.

    The outline is a polygon of the circle's perimeter (see `polygon_radius`).
    The side is made of flat strips, one for each side of the polygon, cut into
    right triangles, so that a ball which slides along the axis keeps its
    contact history; the caps are Delaunay triangulations.

    Parameters
    ----------
    radius_m, length_m : float
        In metres.
    facet_size_m : float
        The longest leg of a triangle on the side, in metres; at most the radius.

    Raises
    ------
    InputError
        If a length is not a positive number, or the facets are coarser than
        the radius or too many.
    """
    _require_positive(radius_m=radius_m, length_m=length_m, facet_size_m=facet_size_m)
    _require_facet_size(facet_size_m, radius_m, length_m)
    sides = polygon_sides(radius_m, facet_size_m)
    return prism(sides, polygon_radius(radius_m, sides), length_m, facet_size_m)


def prism(sides: int, corner_radius_m: float, length_m: float, facet_size_m: float) -> Mesh:
    """Make a closed upright bar with a regular polygon as its section.

    Parameters
    ----------
    sides : int
        Corners of the section; the first lies on the x axis.
    corner_radius_m : float
        Distance of the corners from the axis, in metres.
    length_m, facet_size_m : float
        Length, and longest facet edge along the axis, in metres.
    """
    plane, disc = _disc(sides, corner_radius_m, facet_size_m)
    side = _side(sides, corner_radius_m, length_m, facet_size_m)
    bottom = Mesh(_lift(plane, 0.0), disc[:, ::-1])
    top = Mesh(_lift(plane, length_m), disc)
    return _join(bottom, side, top)


def bowl(radius_m: float, height_m: float, facet_size_m: float) -> Mesh:
    """Make an open bowl: a floor in z = 0 and a side, the normals pointing in.

    The sides of the polygon touch the circle from outside, so a bed that was
    filled into the round bowl of the same radius fits without an overlap. The
    corners stand out by (pi / sides)^2 / 2 of the radius: the simulation box
    must hold them.

    Parameters
    ----------
    radius_m, height_m : float
        In metres.
    facet_size_m : float
        The longest leg of a triangle on the side, in metres; at most the radius.

    Raises
    ------
    InputError
        As `cylinder`.
    """
    _require_positive(radius_m=radius_m, height_m=height_m, facet_size_m=facet_size_m)
    _require_facet_size(facet_size_m, radius_m, height_m)
    sides = polygon_sides(radius_m, facet_size_m)
    corner_radius_m = radius_m / math.cos(math.pi / sides)
    plane, disc = _disc(sides, corner_radius_m, facet_size_m)
    outside = _side(sides, corner_radius_m, height_m, facet_size_m)
    inside = replace(outside, triangles=outside.triangles[:, ::-1])
    return _join(Mesh(_lift(plane, 0.0), disc), inside)


def _require_positive(**lengths_m: float) -> None:
    for field, value in lengths_m.items():
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(
                "a mesh needs a positive length",
                field=field,
                value=value,
                limit="a finite number above 0, in metres",
            )


def _require_facet_size(facet_size_m: float, radius_m: float, length_m: float) -> None:
    if facet_size_m > radius_m:
        raise InputError(
            "the facets are too coarse for the curve they stand for",
            field="facet_size_m",
            value=facet_size_m,
            limit=f"at most the radius, {radius_m:g} m",
            remedy="ask for a smaller facet size",
        )
    facets = 2.0 * math.tau * radius_m * (length_m + radius_m) / facet_size_m**2
    if facets > MAX_FACETS:
        raise InputError(
            f"about {facets:.3g} facets would be needed",
            field="facet_size_m",
            value=facet_size_m,
            limit=f"at most {MAX_FACETS} facets",
            remedy="ask for a larger facet size, in metres",
        )


def _ring(count: int, radius_m: float, start_rad: float = 0.0) -> Floats:
    angle = start_rad + math.tau * np.arange(count) / count
    return np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle)])


def _lift(plane: Floats, z_m: float) -> Floats:
    return np.column_stack([plane, np.full(len(plane), z_m)])


def _disc(sides: int, corner_radius_m: float, facet_size_m: float) -> tuple[Floats, Integers]:
    """Triangulate a polygon: (N, 2) points on rings, outermost last, and (M, 3) triangles."""
    import pyvista

    rings = max(1, round(corner_radius_m / facet_size_m))
    parts = [np.zeros((1, 2))]
    for ring in range(1, rings):
        count = max(5, round(sides * ring / rings))
        parts.append(_ring(count, corner_radius_m * ring / rings, math.pi * (ring % 2) / count))
    parts.append(_ring(sides, corner_radius_m))
    plane = np.concatenate(parts)
    scaled = pyvista.PolyData(_lift(plane / corner_radius_m, 0.0))
    triangles = np.asarray(scaled.delaunay_2d().faces, dtype=np.int64).reshape(-1, 4)[:, 1:]
    if len(triangles) != 2 * len(plane) - 2 - sides:
        raise RuntimeError(f"the triangulation of a cap of {sides} sides failed")
    return plane, _counter_clockwise(plane, triangles)


def _counter_clockwise(plane: Floats, triangles: Integers) -> Integers:
    first, second, third = np.moveaxis(plane[triangles], 1, 0)
    (ax, ay), (bx, by) = (second - first).T, (third - first).T
    clockwise = ax * by - ay * bx < 0.0
    return np.where(clockwise[:, None], triangles[:, ::-1], triangles)


def _side(sides: int, corner_radius_m: float, length_m: float, facet_size_m: float) -> Mesh:
    levels = math.ceil(length_m / facet_size_m - 1e-9)
    ring = _ring(sides, corner_radius_m)
    points = np.concatenate([_lift(ring, length_m * k / levels) for k in range(levels + 1)])
    lower = np.arange(levels * sides).reshape(levels, sides)
    beside = np.roll(lower, -1, axis=1)
    one = np.stack([lower, beside, beside + sides], axis=-1)
    other = np.stack([lower, beside + sides, lower + sides], axis=-1)
    return Mesh(points, np.stack([one, other], axis=2).reshape(-1, 3))


def _join(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0, *(len(mesh.points) for mesh in meshes[:-1])])
    points = np.concatenate([mesh.points for mesh in meshes])
    triangles = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=True)]
    return weld(Mesh(points, np.concatenate(triangles)))


# --- changing ---------------------------------------------------------------


def weld(mesh: Mesh, precision_m: float = NODE_PRECISION_M) -> Mesh:
    """Make one node of all that lie within the engine's precision of each other.

    Nodes that no facet uses are dropped; facets stay as many as they were.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    if not len(mesh.triangles) or not np.isfinite(mesh.points).all():
        return mesh
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    points = mesh.points[used]
    first, second = KDTree(points).query_pairs(precision_m, output_type="ndarray").T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(len(points),) * 2)
    count, label = connected_components(links, directed=False)
    kept = np.full(count, len(points))
    np.minimum.at(kept, label, np.arange(len(points)))
    return Mesh(points[kept], label[triangles].reshape(-1, 3))


def place(mesh: Mesh) -> Mesh:
    """Move a mesh to the tool's coordinates.

    The origin becomes the middle of the bounding box in x and y, at its lowest
    z. The axes keep their directions: a tool is drawn upright, +z away from
    the floor.
    """
    low, high = mesh.bounds
    origin = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    return replace(mesh, points=mesh.points - origin)


# --- measuring --------------------------------------------------------------


@dataclass(frozen=True)
class Envelope:
    """The upright cylinder around the z axis that just holds a tool.

    Parameters
    ----------
    radius_m : float
        Distance of the outermost node from the axis, in metres: how near to a
        wall the tool's reference point may come, whichever way the tool turns.
    bottom_m, top_m : float
        Lowest and highest z, in metres.
    """

    radius_m: float
    bottom_m: float
    top_m: float

    @property
    def length_m(self) -> float:
        """Height of the cylinder, in metres."""
        return self.top_m - self.bottom_m


def envelope(mesh: Mesh) -> Envelope:
    """Measure the cylinder around the z axis that holds the mesh where it stands."""
    used = mesh.points[np.unique(mesh.triangles)]
    return Envelope(
        radius_m=float(np.hypot(used[:, 0], used[:, 1]).max()),
        bottom_m=float(used[:, 2].min()),
        top_m=float(used[:, 2].max()),
    )


# --- checking ---------------------------------------------------------------


@dataclass(frozen=True)
class Surroundings:
    """What a tool is to work in, to tell whether its size makes sense.

    Parameters
    ----------
    bowl_radius_m, ball_radius_m : float
        In metres; the ball's is the mean.
    """

    bowl_radius_m: float
    ball_radius_m: float


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or doubtful, with a mesh.

    Parameters
    ----------
    severity : {"error", "warning"}
        An error is what the engine, or the physics, does not stand.
    problem, value, limit, remedy : str
        The parts of the message.
    """

    severity: Literal["error", "warning"]
    problem: str
    value: str
    limit: str
    remedy: str


def check(
    mesh: Mesh,
    *,
    file: Path | str | None = None,
    field: str | None = None,
    tool: bool = True,
    surroundings: Surroundings | None = None,
    curvature_deg: float = CURVATURE_DEG,
) -> list[Finding]:
    """Refuse a mesh that the engine would refuse or that makes no sense.

    Parameters
    ----------
    mesh : Mesh
        In metres, welded, as `read` and the makers return it.
    file, field : optional
        Where the mesh comes from, for the message.
    tool, surroundings, curvature_deg
        As in `findings`.

    Returns
    -------
    list of Finding
        The warnings.

    Raises
    ------
    InputError
        For the first error found.
    """
    found = findings(mesh, tool=tool, surroundings=surroundings, curvature_deg=curvature_deg)
    for finding in found:
        if finding.severity == "error":
            raise InputError(
                finding.problem,
                file=file,
                field=field,
                value=finding.value,
                limit=finding.limit,
                remedy=finding.remedy,
            )
    return found


def findings(
    mesh: Mesh,
    *,
    tool: bool = True,
    surroundings: Surroundings | None = None,
    curvature_deg: float = CURVATURE_DEG,
) -> list[Finding]:
    """List what is wrong with a mesh, the root causes first.

    Parameters
    ----------
    mesh : Mesh
        In metres, welded.
    tool : bool
        Whether the mesh is a body and must be closed with its normals out.
    surroundings : Surroundings, optional
        To see whether the size is plausible.
    curvature_deg : float
        The deck's `curvature`: no angle of a facet may be smaller, in degrees.
    """
    broken = _empty(mesh) or _not_finite(mesh)
    if broken:
        return broken
    found = _implausible_size(mesh, surroundings) if surroundings else []
    degenerate = _degenerate(mesh)
    found += degenerate + _duplicates(mesh)
    if not degenerate:
        found += _sharp_angles(mesh, curvature_deg) + _overlaps(mesh, curvature_deg)
    found += _crowded_edges(mesh)
    if tool:
        found += _not_a_body(mesh)
    return sorted(found, key=lambda finding: finding.severity)


def _error(problem: str, value: str, limit: str, remedy: str) -> list[Finding]:
    return [Finding("error", problem, value, limit, remedy)]


def _which(bad: NDArray[np.bool_]) -> str:
    numbers = np.flatnonzero(bad)
    shown = ", ".join(str(number) for number in numbers[:5])
    more = ", ..." if len(numbers) > 5 else ""
    return f"{len(numbers)} of {len(bad)} facets (counted from 0: {shown}{more})"


def _empty(mesh: Mesh) -> list[Finding]:
    if len(mesh.triangles):
        return []
    return _error(
        "the mesh is empty", "0 facets", "at least one facet", "export the surface as triangles"
    )


def _not_finite(mesh: Mesh) -> list[Finding]:
    bad = ~np.isfinite(mesh.corners).all(axis=(1, 2))
    if not bad.any():
        return []
    return _error(
        "a coordinate is not a number", _which(bad), "finite numbers", "export the mesh again"
    )


def _implausible_size(mesh: Mesh, scene: Surroundings) -> list[Finding]:
    size = float(mesh.extent.max())
    if _plausible(mesh, 1.0, scene):
        return []
    limit = (
        f"narrower than the bowl (diameter {2 * scene.bowl_radius_m:g} m), no longer than ten "
        f"bowls, no smaller than a ball's radius ({scene.ball_radius_m:g} m)"
    )
    return _error(
        "the size of the tool makes no sense in this bowl",
        " x ".join(f"{length:.4g}" for length in mesh.extent) + " m",
        limit,
        _unit_remedy(mesh, scene) if size > 0.0 else "export the mesh again",
    )


def _plausible(mesh: Mesh, factor: float, scene: Surroundings) -> bool:
    width, depth, height = factor * mesh.extent
    bowl_m = 2.0 * scene.bowl_radius_m
    longest = max(width, depth, height)
    narrow = max(width, depth) < bowl_m
    return bool(narrow and scene.ball_radius_m <= longest <= 10.0 * bowl_m)


def _unit_remedy(mesh: Mesh, scene: Surroundings) -> str:
    if _plausible(mesh, 1e-3, scene):
        return "check the unit: in millimetres, declared as metres?"
    if _plausible(mesh, 1e3, scene):
        return "check the unit: in metres, declared as millimetres?"
    return "check the unit that the file is declared in, or use a tool of another size"


def _degenerate(mesh: Mesh) -> list[Finding]:
    edges = np.linalg.norm(mesh.edge_vectors, axis=2)
    longest = edges.max(axis=1)
    height = np.divide(
        2.0 * mesh.facet_areas, longest, out=np.zeros_like(longest), where=longest > 0
    )
    repeated = (mesh.triangles == np.roll(mesh.triangles, 1, axis=1)).any(axis=1)
    bad = repeated | (height <= NODE_PRECISION_M)
    if not bad.any():
        return []
    return _error(
        "a facet has no area",
        _which(bad),
        f"higher than the engine's precision, {NODE_PRECISION_M:g} m",
        "remove degenerate facets in a mesh tool and export again",
    )


def _duplicates(mesh: Mesh) -> list[Finding]:
    nodes = np.sort(mesh.triangles, axis=1)
    _, first = np.unique(nodes, axis=0, return_index=True)
    bad = np.ones(len(nodes), dtype=np.bool_)
    bad[first] = False
    if not bad.any():
        return []
    return _error(
        "a facet is there twice",
        _which(bad),
        "every facet once",
        "remove duplicate facets in a mesh tool and export again",
    )


def _sharp_angles(mesh: Mesh, curvature_deg: float) -> list[Finding]:
    smallest = mesh.angles_deg.min(axis=1)
    error, warning = smallest <= curvature_deg, smallest <= ANGLE_WARNING_DEG
    if error.any():
        return _error(
            "the angle of a facet is too sharp for the engine",
            f"{smallest.min():.4g} degrees; {_which(error)}",
            f"above the curvature of the mesh, {curvature_deg:g} degrees",
            "remesh with better shaped triangles",
        )
    if not warning.any():
        return []
    limit = f"above {ANGLE_WARNING_DEG:g} degrees"
    value = f"{smallest.min():.4g} degrees; {_which(warning)}"
    remedy = "remesh with better shaped triangles"
    return [Finding("warning", "needle-like facets slow the engine down", value, limit, remedy)]


def _overlaps(mesh: Mesh, curvature_deg: float) -> list[Finding]:
    one, other, inward = _edge_pairs(mesh)
    flat = np.cos(np.radians(curvature_deg))
    coplanar = np.abs(np.einsum("kc,kc->k", mesh.normals[one], mesh.normals[other])) >= flat
    same_side = np.einsum("kc,kc->k", inward[:, 0], inward[:, 1]) > 0.0
    different = (np.sort(mesh.triangles[one]) != np.sort(mesh.triangles[other])).any(axis=1)
    bad = np.zeros(len(mesh.triangles), dtype=np.bool_)
    bad[one[coplanar & same_side & different]] = True
    if not bad.any():
        return []
    return _error(
        "two facets of one plane lie on top of each other",
        _which(bad),
        "facets that share an edge lie on both sides of it",
        "repair the mesh: one surface, without folds",
    )


def _edge_pairs(mesh: Mesh) -> tuple[Integers, Integers, Floats]:
    """Facets that share an edge: two (K,) arrays, and (K, 2, 3), from the edge into each."""
    edge = mesh._edge_of.ravel()
    order = np.argsort(edge, kind="stable")
    pair = np.flatnonzero(edge[order[1:]] == edge[order[:-1]])
    slots = np.stack([order[pair], order[pair + 1]], axis=1)
    facet, corner = slots // 3, slots % 3
    along = _unit(mesh.edge_vectors[facet, corner])
    inward = mesh.corners[facet, (corner + 2) % 3] - mesh.corners[facet, corner]
    inward = inward - np.einsum("kfc,kfc->kf", inward, along)[..., None] * along
    return facet[:, 0], facet[:, 1], inward


def _crowded_edges(mesh: Mesh) -> list[Finding]:
    neighbours = mesh.neighbours
    bad = neighbours > MAX_NEIGHBOURS
    if not bad.any():
        return []
    return _error(
        "too many facets meet at the edges of one",
        f"{neighbours.max()} neighbours; {_which(bad)}",
        f"at most {MAX_NEIGHBOURS} neighbours",
        "repair the mesh: a surface has two facets at an edge",
    )


def _not_a_body(mesh: Mesh) -> list[Finding]:
    loose = int(np.count_nonzero(mesh._edge_use != 2))
    if loose:
        return _error(
            "the mesh is not closed",
            f"{loose} of {len(mesh._edge_use)} edges do not join exactly two facets",
            "a tool is a body: exactly two facets at every edge",
            "close the holes and remove inner walls in a mesh tool, then export again",
        )
    if mesh.oriented and mesh.volume > 0.0:
        return []
    value = f"enclosed volume {mesh.volume:.4g} m3" if mesh.oriented else "mixed directions"
    limit = "corners counter-clockwise, seen from outside"
    remedy = "make the normals of the mesh consistent and outward"
    problem = "the normals do not all point out of the body"
    return [Finding("warning", problem, value, limit, remedy)]


# --- reading and writing ----------------------------------------------------


def read(path: Path | str, unit: str) -> Mesh:
    """Read a surface from STL (ASCII or binary), OBJ, PLY or VTK.

    Quadrilaterals are cut along their shorter diagonal.

    Parameters
    ----------
    path : Path or str
        The file; its suffix tells the format.
    unit : str
        What one is in the file: a key of `UNITS`.

    Returns
    -------
    Mesh
        In metres, welded, where the file puts it.

    Raises
    ------
    InputError
        If the unit or the format is unknown, the file is missing or damaged,
        or holds cells that are no surface.
    """
    path = Path(path)
    if unit not in UNITS:
        raise InputError(
            "unknown length unit", file=path, field="unit", value=unit, limit=", ".join(UNITS)
        )
    content = _load(path)
    points = np.asarray(content.points, dtype=np.float64)
    if points.size and points.shape[1] != 3:
        raise InputError("a surface in space needs three coordinates a node", file=path)
    triangles = [_triangles(block.type, block.data, points, path) for block in content.cells]
    joined = np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles])
    return weld(Mesh(points * UNITS[unit], joined))


def _load(path: Path) -> Any:
    read_format = _readers().get(path.suffix.lower())
    if read_format is None:
        raise InputError(
            "unknown mesh format",
            file=path,
            value=path.suffix or "no suffix",
            limit=", ".join(_readers()),
            remedy="export the surface as STL",
        )
    if not path.is_file():
        raise InputError("there is no such mesh file", file=path)
    try:
        with np.errstate(over="ignore"):  # meshio multiplies 32-bit numbers to spot a binary STL
            return read_format(path)
    except Exception as error:  # meshio lets any parser error out
        raise InputError(
            f"the mesh file is damaged, or no {path.suffix.lower()[1:].upper()} file",
            file=path,
            value=str(error).strip() or type(error).__name__,
            remedy="export it again, as STL if nothing else helps",
        ) from error


def _readers() -> dict[str, Callable[[Path], Any]]:
    """Return meshio's readers by suffix; its general one ends the interpreter on bad files."""
    import meshio

    modules = {".stl": meshio.stl, ".obj": meshio.obj, ".ply": meshio.ply}
    return {suffix: module.read for suffix, module in modules.items()} | {".vtk": _read_vtk}


def _read_vtk(path: Path) -> Any:
    """Read legacy VTK; polygon data, which meshio does not know, by pyvista."""
    import meshio

    with path.open("rb") as stream:
        header = stream.read(1024).upper()
    if b"POLYDATA" not in header:
        return meshio.vtk.read(path)
    import pyvista

    surface = pyvista.PolyData(pyvista.read(path)).triangulate()
    return meshio.Mesh(surface.points, [("triangle", surface.faces.reshape(-1, 4)[:, 1:])])


def _triangles(kind: str, cells: ArrayLike, points: Floats, path: Path) -> Integers:
    if kind in {"vertex", "line"}:
        return np.empty((0, 3), dtype=np.int64)
    nodes = np.asarray(cells, dtype=np.int64)
    if kind == "triangle":
        return nodes
    if kind == "quad":
        return _split(nodes, points)
    raise InputError(
        "the mesh holds cells that are neither triangles nor quadrilaterals",
        file=path,
        value=f"{len(nodes)} of type {kind}",
        limit="triangles or quadrilaterals",
        remedy="export the surface as triangles",
    )


def _split(quads: Integers, points: Floats) -> Integers:
    diagonal = np.linalg.norm(points[quads[:, :2]] - points[quads[:, 2:]], axis=2)
    turned = np.where(diagonal[:, [0]] <= diagonal[:, [1]], quads, np.roll(quads, -1, axis=1))
    return turned[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def write_stl(mesh: Mesh, path: Path | str) -> None:
    """Write an ASCII STL file in metres, as the engine reads it.

    Nine digits keep nodes apart that the engine keeps apart. The same mesh
    gives the same bytes, and the file appears whole or not at all.

    Parameters
    ----------
    mesh : Mesh
        In metres.
    path : Path or str
        The file; an existing one is replaced.
    """
    path = Path(path)
    descriptor, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "w", encoding="ascii", newline="\n") as stream:
            stream.write(stl_text(mesh))
        os.chmod(draft, 0o644)
        os.replace(draft, path)
    except BaseException:
        os.unlink(draft)
        raise


def stl_text(mesh: Mesh, factor: float = 1.0) -> str:
    """Return the ASCII STL text of a mesh, its coordinates times `factor`."""
    corners = factor * mesh.corners + 0.0  # + 0.0 turns -0 into 0
    normals = np.round(mesh.normals, 9) + 0.0
    facets = [
        "facet normal {:.9g} {:.9g} {:.9g}\nouter loop\n".format(*normal)
        + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in facet)
        + "endloop\nendfacet\n"
        for normal, facet in zip(normals.tolist(), corners.tolist(), strict=True)
    ]
    return "solid mesh\n" + "".join(facets) + "endsolid mesh\n"

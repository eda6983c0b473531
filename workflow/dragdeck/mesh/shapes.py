"""Surfaces made from a few lengths: the round workpiece, a bar with edges, the bowl."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.errors import InputError
from dragdeck.mesh.surface import Floats, Integers, surface, weld

if TYPE_CHECKING:
    from trimesh import Trimesh

_MAX_FACETS = 200_000
"""More facets than any workpiece needs: a facet size in the wrong unit."""

_MIN_SIDES = 8
"""The coarsest polygon that still passes for a circle."""


def polygon_sides(radius_m: float, facet_size_m: float) -> int:
    """Sides of the polygon that stands for a circle: a multiple of four, at least eight.

    Four-fold symmetry keeps the axis in the middle of the bounding box.

    Parameters
    ----------
    radius_m, facet_size_m : float
        The circle, and the longest side wanted, in metres.
    """
    quarter = math.ceil(math.pi * radius_m / (2.0 * facet_size_m) - 1e-9)
    return max(_MIN_SIDES, 4 * quarter)


def polygon_radius(radius_m: float, sides: int) -> float:
    """Distance of the corners from the axis if the polygon is as long as the circle.

    By Cauchy's theorem (1841) the mean width of a convex outline is its
    perimeter over pi, so a polygon of the circle's perimeter is, averaged over
    the directions of motion, exactly as wide as the circle; a particle's radius
    adds to both alike. Width is what a workpiece shows to the bed it is dragged
    through, hence this choice and not the inscribed polygon, which is too
    narrow, nor the one of equal area, which is too wide. The corners stand out
    by (pi / sides)^2 / 6 of the radius and the middles of the sides lie inside
    by (pi / sides)^2 / 3, to leading order: 0.16 % and 0.32 % for 32 sides.
    """
    return radius_m * (math.pi / sides) / math.sin(math.pi / sides)


def cylinder(
    radius_m: float, length_m: float, facet_size_m: float, facet_length_m: float | None = None
) -> Trimesh:
    """Make a closed upright cylinder, its bottom's centre in the origin.

    The outline is a polygon of the circle's perimeter (see `polygon_radius`).
    The side is made of flat strips, one for each side of the polygon, cut into
    right triangles, so that a particle which slides along the axis keeps its
    contact history; the caps are Delaunay triangulations.

    Parameters
    ----------
    radius_m, length_m : float
        In metres.
    facet_size_m : float
        The longest leg of a triangle around the axis and on the caps, in
        metres; at most the radius.
    facet_length_m : float, optional
        The longest leg along the axis, in metres; `facet_size_m` if not given.
        Long facets are as round and cost the engine less.

    Raises
    ------
    InputError
        If the facets are coarser than the radius or too many.
    """
    along_m = facet_size_m if facet_length_m is None else facet_length_m
    _require_facet_size(facet_size_m, radius_m, length_m, along_m)
    sides = polygon_sides(radius_m, facet_size_m)
    return prism(sides, polygon_radius(radius_m, sides), length_m, facet_size_m, along_m)


def cylinder_radius(radius_m: float, length_m: float, facet_size_m: float) -> float:
    """Distance of the outermost nodes of a `cylinder` from its axis, without making the mesh.

    Parameters and errors are those of `cylinder`.
    """
    _require_facet_size(facet_size_m, radius_m, length_m, math.inf)
    sides = polygon_sides(radius_m, facet_size_m)
    x, y, _ = _ring(sides, polygon_radius(radius_m, sides)).T
    return float(np.hypot(x, y).max())


def cylinder_facets(
    radius_m: float, length_m: float, facet_size_m: float, facet_length_m: float | None = None
) -> int:
    """Number of facets of a `cylinder`, without making the mesh.

    Parameters and errors are those of `cylinder`.
    """
    along_m = facet_size_m if facet_length_m is None else facet_length_m
    _require_facet_size(facet_size_m, radius_m, length_m, along_m)
    sides = polygon_sides(radius_m, facet_size_m)
    inner = _ring_counts(sides, polygon_radius(radius_m, sides), facet_size_m)
    return 2 * (2 * sum(inner) + sides) + 2 * sides * _levels(length_m, along_m)


def prism(
    sides: int, corner_radius_m: float, length_m: float, facet_size_m: float, facet_length_m: float
) -> Trimesh:
    """Make a closed upright bar with a regular polygon as its section.

    Parameters
    ----------
    sides : int
        Corners of the section; the first lies on the x axis.
    corner_radius_m : float
        Distance of the corners from the axis, in metres.
    length_m, facet_size_m, facet_length_m : float
        Length, and longest facet legs on the caps and along the axis, in metres.
    """
    disc = _disc(sides, corner_radius_m, facet_size_m)
    side = _side(sides, corner_radius_m, length_m, facet_length_m)
    top = surface(disc.vertices + np.array([0.0, 0.0, length_m]), disc.faces)
    return weld(_turned(disc) + side + top)


def bowl(radius_m: float, height_m: float, facet_size_m: float) -> Trimesh:
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
    _require_facet_size(facet_size_m, radius_m, height_m)
    sides = polygon_sides(radius_m, facet_size_m)
    corner_radius_m = radius_m / math.cos(math.pi / sides)
    floor = _disc(sides, corner_radius_m, facet_size_m)
    side = _side(sides, corner_radius_m, height_m, facet_size_m)
    return weld(floor + _turned(side))


def revolved(profile_m: Sequence[tuple[float, float]], facet_size_m: float) -> Trimesh:
    """Turn a line about the z axis, the normals pointing to its left as seen along it.

    The sides of the polygons touch the circles from outside.

    Parameters
    ----------
    profile_m : sequence of (float, float)
        Radius and height of its points, m; from the axis or a column outwards for a bowl.
    facet_size_m : float
        The longest leg of a triangle, m.

    Raises
    ------
    InputError
        As `cylinder`.
    """
    points = [profile_m[0]]
    for begin, end in pairwise(profile_m):
        parts = _levels(math.dist(begin, end), facet_size_m)
        points += np.linspace(begin, end, parts + 1)[1:].tolist()
    widest = max(radius for radius, _ in points)
    _require_facet_size(facet_size_m, widest, len(points) * facet_size_m)
    sides = polygon_sides(widest, facet_size_m)
    wider = 1 / math.cos(math.pi / sides)
    rings = [_ring(sides, wider * radius, z_m=height) for radius, height in points]
    strips = weld(surface(np.concatenate(rings), _strips(sides, len(points) - 1)))
    degenerate = (strips.faces == np.roll(strips.faces, 1, axis=1)).any(axis=1)
    return _turned(surface(strips.vertices, strips.faces[~degenerate]))


def trough(size_m: tuple[float, float, float], facet_size_m: float) -> Trimesh:
    """Make an open rectangular trough: floor in z = 0 and four sides, the normals pointing in.

    Parameters
    ----------
    size_m : (float, float, float)
        Length along x, width along y, and height, m.
    facet_size_m : float
        The longest leg of a triangle, m.
    """
    x, y, z = np.diag(size_m)
    corner = -(x + y) / 2
    faces = (corner, x, y), (corner, z, x), (corner, y, z), (corner + y, x, z), (corner + x, z, y)
    floor, *sides = (_patch(*face, facet_size_m) for face in faces)
    return weld(sum(sides, floor))


def _patch(corner_m: Floats, a_m: Floats, b_m: Floats, facet_size_m: float) -> Trimesh:
    """A rectangle from a corner along two edges, its normal along a x b."""
    along, across = (_levels(float(np.linalg.norm(edge)), facet_size_m) for edge in (a_m, b_m))
    u, v = np.meshgrid(np.linspace(0, 1, along + 1), np.linspace(0, 1, across + 1))
    points = corner_m + u.reshape(-1, 1) * a_m + v.reshape(-1, 1) * b_m
    lower = (np.arange(across)[:, None] * (along + 1) + np.arange(along)).ravel()
    upper = lower + along + 1
    halves = [[lower, lower + 1, upper + 1], [lower, upper + 1, upper]]
    return surface(points, np.hstack(halves).T)


def tube(radius_m: float, length_m: float, facet_size_m: float) -> Trimesh:
    """Make the side of an upright cylinder, from z = 0 on, its polygon outside of the circle.

    Parameters and errors are those of `bowl`; facets are up to four times as long as wide.
    """
    _require_facet_size(facet_size_m, radius_m, length_m)
    sides = polygon_sides(radius_m, facet_size_m)
    corner_radius_m = radius_m / math.cos(math.pi / sides)
    return _turned(_side(sides, corner_radius_m, length_m, 4 * facet_size_m))


def _require_facet_size(
    facet_size_m: float, radius_m: float, length_m: float, along_m: float | None = None
) -> None:
    block = "bowl" if along_m is None else "workpiece.shape"
    if facet_size_m > radius_m:
        raise InputError(
            "the mesh elements are too coarse for the curvature of the surface",
            field=f"{block}.facet_size_m", value=facet_size_m,
            limit=f"at most the radius, {radius_m:g} m", remedy="use a smaller facet size",
        )  # fmt: skip
    along_m = along_m or facet_size_m
    lengthwise, across = length_m / along_m, radius_m / facet_size_m
    facets = 2.0 * math.tau * radius_m / facet_size_m * (lengthwise + across)
    if facets > _MAX_FACETS:
        short = along_m < facet_size_m
        raise InputError(
            f"the mesh would need about {facets:.3g} facets",
            field=f"{block}.{'facet_length_m' if short else 'facet_size_m'}",
            value=along_m if short else facet_size_m, limit=f"at most {_MAX_FACETS} facets",
            remedy="use a larger facet size, in metres",
        )  # fmt: skip


def _ring(count: int, radius_m: float, start_rad: float = 0.0, z_m: float = 0.0) -> Floats:
    angle = start_rad + math.tau * np.arange(count) / count
    return np.column_stack(
        [radius_m * np.cos(angle), radius_m * np.sin(angle), np.full(count, z_m)]
    )


def _ring_counts(sides: int, corner_radius_m: float, facet_size_m: float) -> list[int]:
    """Nodes on each ring of a `_disc` between its centre and its edge."""
    rings = max(1, round(corner_radius_m / facet_size_m))
    return [max(5, round(sides * ring / rings)) for ring in range(1, rings)]


def _levels(length_m: float, facet_size_m: float) -> int:
    return math.ceil(length_m / facet_size_m - 1e-9)


def _disc(sides: int, corner_radius_m: float, facet_size_m: float) -> Trimesh:
    """Triangulate a polygon in z = 0, its normal up: nodes on rings, the outermost last."""
    import pyvista

    counts = _ring_counts(sides, corner_radius_m, facet_size_m)
    parts = [np.zeros((1, 3))]
    for ring, count in enumerate(counts, 1):
        radius_m = corner_radius_m * ring / (len(counts) + 1)
        parts.append(_ring(count, radius_m, math.pi * (ring % 2) / count))
    points = np.concatenate([*parts, _ring(sides, corner_radius_m)])
    faces = pyvista.PolyData(points / corner_radius_m).delaunay_2d().regular_faces
    if len(faces) != 2 * len(points) - 2 - sides:
        raise RuntimeError(f"the triangulation of a cap of {sides} sides failed")
    clockwise = surface(points, faces).triangles_cross[:, [2]] < 0.0
    return surface(points, np.where(clockwise, faces[:, ::-1], faces))


def _side(sides: int, corner_radius_m: float, length_m: float, facet_size_m: float) -> Trimesh:
    levels = _levels(length_m, facet_size_m)
    heights = [length_m * k / levels for k in range(levels + 1)]
    points = np.concatenate([_ring(sides, corner_radius_m, z_m=z_m) for z_m in heights])
    return surface(points, _strips(sides, levels))


def _strips(sides: int, levels: int) -> Integers:
    """Triangles between rings of nodes, one ring after another, (N, 3)."""
    lower = np.arange(levels * sides).reshape(levels, sides)
    beside = np.roll(lower, -1, axis=1)
    lower_half = np.stack([lower, beside, beside + sides], axis=-1)
    other = np.stack([lower, beside + sides, lower + sides], axis=-1)
    return np.stack([lower_half, other], axis=2).reshape(-1, 3)


def _turned(mesh: Trimesh) -> Trimesh:
    return surface(mesh.vertices, mesh.faces[:, ::-1])

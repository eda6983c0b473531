"""The walls of a bowl and the space between them.

``case.json`` contains a `Container`, so that tables, checks and figures work on walls and know no
kind of bowl.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import PositiveFloat

from dragdeck.arrays import Floats
from dragdeck.parts import Part, omitted
from dragdeck.physics import facets

_BELOW_RIM = 1 - 1e-6
"""Height of a section at the rim of facets, over that of the rim; 1 minus it: at the floor."""

_SIDES, _SECTIONS = 120, 6
"""Corners of a drawn circle; drawn sections of facets."""


class Wall(Part):
    """A plane, or an upright cylinder about the z axis, without end; a part of a cone; or facets.

    Attributes
    ----------
    name : str
        In the input script.
    shape : str
        Its name in LIGGGHTS, which has no ``cone`` and no ``facets``: these are parts of the mesh.
    at_m : float
        Coordinate of the plane, or radius of the cylinder.
    inwards : int
        1 if the particles are at larger coordinates, or outside of the cylinder; otherwise -1.
    ends_m : tuple of 4 floats
        Of a cone: radius and height of one end, then of the other.
    sides : int
        Of a cone, or of a cylinder that is a mesh, which are polygons around the circle: the number
        of their sides; 0 for the cylinder itself.
    corners_m : tuple of 9 floats each
        Of facets that face inwards: x, y and z of their corners.
    """

    name: str
    shape: Literal["xplane", "yplane", "zplane", "zcylinder", "cone", "facets"]
    at_m: float = omitted(0.0)
    inwards: Literal[1, -1] = 1
    ends_m: tuple[float, float, float, float] | None = omitted(None)
    sides: int = omitted(0)
    corners_m: tuple[facets.Triangle, ...] = omitted(())

    @property
    def upright(self) -> bool:
        """Whether it is neither floor nor lid."""
        return self.shape not in ("zplane", "cone", "facets")

    @property
    def triangles(self) -> Floats:
        """The facets, (F, 3, 3)."""
        return facets.corners(self.corners_m)

    def contacts(self, centre_m: Floats) -> tuple[Floats, Floats]:
        """Distances, (N,), and normals into the bowl, (N, 3), of (N, 3) points.

        Distances are negative beyond the wall, but for a cone and for facets, of which the nearest
        counts.
        """
        if self.corners_m:
            return facets.nearest(centre_m, self.triangles)
        if self.ends_m is not None:
            return _from_cone(centre_m, np.array(self.ends_m), self.sides)
        if self.sides:
            return _from_polygon(centre_m, self.at_m, self.inwards, self.sides)
        distance, normal = from_primitive(self.shape, (self.at_m, 0.0, 0.0), centre_m)
        return self.inwards * distance, self.inwards * normal


def from_primitive(shape: str, sizes_m: Sequence[float], centre_m: Floats) -> tuple[Floats, Floats]:
    """Distances of points from a plane or cylinder without end, and normals away from it.

    Parameters
    ----------
    shape : str
        As LIGGGHTS has it: ``xplane`` to ``zcylinder``.
    sizes_m : sequence of float
        Coordinate of a plane; or radius of a cylinder, and the coordinates of its axis.
    centre_m : (N, 3) ndarray

    Returns
    -------
    (N,) and (N, 3) ndarray
        Distances are negative within a cylinder, or below a plane; unit vectors point to larger
        ones.
    """
    axis = "xyz".index(shape[0])
    normal = np.zeros_like(centre_m)
    if shape.endswith("plane"):
        normal[:, axis] = 1.0
        return centre_m[:, axis] - sizes_m[0], normal
    across = [number for number in range(3) if number != axis]
    out = centre_m[:, across] - np.asarray(sizes_m[1:3])
    place = np.linalg.norm(out, axis=1)
    normal[:, across] = out / np.maximum(place, 1e-300)[:, None]
    return place - sizes_m[0], normal


def _from_polygon(
    centre_m: Floats, radius_m: float, inwards: int, sides: int
) -> tuple[Floats, Floats]:
    """Distances of points from the nearest side of a polygon about a circle, and normals."""
    faced = _Faced.of(centre_m, sides)
    out = faced.out_m - radius_m
    distance, normal = faced.contacts(np.full_like(out, radius_m), out, np.zeros_like(out))
    sign = inwards * np.copysign(1.0, out)
    return sign * distance, sign[:, None] * normal


def _from_cone(centre_m: Floats, ends_m: Floats, sides: int) -> tuple[Floats, Floats]:
    """Distances of points from the nearest side of a cone, and normals away from it."""
    faced = _Faced.of(centre_m, sides)
    begin, along = ends_m[:2], ends_m[2:] - ends_m[:2]
    place = np.column_stack([faced.out_m, centre_m[:, 2]])
    share = np.clip((place - begin) @ along / (along @ along), 0.0, 1.0)
    nearest = begin + share[:, None] * along
    return faced.contacts(nearest[:, 0], *(place - nearest).T)


class _Faced(NamedTuple):
    """The side of a polygon around the z axis that each of N points faces.

    Unit vectors to its middle and along it, (N, 2); coordinates of the points in these, m.
    """

    outwards: Floats
    across: Floats
    out_m: Floats
    along_m: Floats
    sides: int

    @classmethod
    def of(cls, centre_m: Floats, sides: int) -> Self:
        """Of (N, 3) points."""
        side = np.floor(np.arctan2(centre_m[:, 1], centre_m[:, 0]) / math.tau * sides)
        middle = math.tau * (side + 0.5) / sides
        outwards = np.column_stack([np.cos(middle), np.sin(middle)])
        across = np.column_stack([-outwards[:, 1], outwards[:, 0]])
        out_m, along_m = ((centre_m[:, :2] * way).sum(axis=1) for way in (outwards, across))
        return cls(outwards, across, out_m, along_m, sides)

    def contacts(self, radius_m: Floats, out_m: Floats, up_m: Floats) -> tuple[Floats, Floats]:
        """Distances, (N,), and normals, (N, 3), from where the side has a radius.

        The points are out and up from there; in front of a corner, they are beside it, too.
        """
        end = radius_m * math.tan(math.pi / self.sides)
        beyond = np.sign(self.along_m) * np.clip(np.abs(self.along_m) - end, 0.0, None)
        distance = np.sqrt(out_m**2 + beyond**2 + up_m**2)
        flat = out_m[:, None] * self.outwards + beyond[:, None] * self.across
        return distance, np.column_stack([flat, up_m]) / np.maximum(distance, 1e-300)[:, None]


class Container(Part):
    """The space that particles can be in.

    Attributes
    ----------
    walls : tuple of Wall
    half_widths_m : (float, float)
        Largest x and y within the walls.
    clear_m : float
        Radius of the widest sphere that fits between the upright walls.
    levels : tuple of (float, float)
        Heights, m, and areas of the horizontal section, m2, linear between them.
    rim : tuple of Wall
        Of a bowl whose width varies with height: the upright walls above its rim, between which
        the particles start.
    rim_m : float
        Height from which these hold.
    """

    walls: tuple[Wall, ...]
    half_widths_m: tuple[PositiveFloat, PositiveFloat]
    clear_m: PositiveFloat
    levels: tuple[tuple[float, float], ...]
    rim: tuple[Wall, ...] = omitted(())
    rim_m: float = omitted(0.0)

    @property
    def upright(self) -> list[Wall]:
        """All walls but floor and lid; those of the rim, if the width varies with height."""
        return [wall for wall in self.rim or self.walls if wall.upright]

    @property
    def round(self) -> bool:
        """Whether it looks alike from all sides."""
        return not self.own_facets.size and all(wall.shape == "zcylinder" for wall in self.upright)

    @property
    def hollow(self) -> bool:
        """Whether a round column stands in its middle."""
        return any(wall.shape == "zcylinder" and wall.inwards > 0 for wall in self.upright)

    @property
    def own_facets(self) -> Floats:
        """The facets of a bowl that has no other walls, (F, 3, 3)."""
        every = [wall.triangles for wall in self.walls if wall.corners_m]
        return every[0] if every else np.empty((0, 3, 3))

    @property
    def words(self) -> str:
        """The walls in words."""
        cylinders = sum(wall.shape == "zcylinder" for wall in self.walls)
        counts = {"plane": len(self.walls) - cylinders, "cylinder": cylinders}
        return " and ".join(
            f"a {name}" if count == 1 else f"{count} {name}s"
            for name, count in counts.items()
            if count
        )

    @property
    def reach_m(self) -> float:
        """Distance of the farthest point from the z axis."""
        return self.half_widths_m[0] if self.round else math.hypot(*self.half_widths_m)

    def side_distance(self, place_m: Floats) -> Floats:
        """Distance of (N, 2) points from the nearest upright wall, (N,), m."""
        return np.asarray(np.min([wall.contacts(place_m)[0] for wall in self.upright], axis=0))

    def distance(self, place_m: Floats) -> Floats:
        """Distance of (N, 3) points from the nearest wall but a flat floor and a lid, (N,), m.

        Negative outside.
        """
        radius, height = np.hypot(*place_m[:, :2].T), place_m[:, 2]
        nearest = np.where(height < self.rim_m, np.inf, self.side_distance(place_m))
        farther = np.zeros(len(place_m), dtype=np.int64)
        for wall in self.walls:
            if wall.ends_m is not None:
                r, z, end_r, end_z = wall.ends_m
                at = r + (height - z) / (end_z - z or 1.0) * (end_r - r)
                farther += (height >= min(z, end_z)) & (height < max(z, end_z)) & (at > radius)
                nearest = np.minimum(nearest, wall.contacts(place_m)[0])
        if self.own_facets.size:
            nearest = np.minimum(nearest, facets.nearest(place_m, self.own_facets)[0])
            farther += facets.is_inside(place_m, self.own_facets)
        outside = (height < self.rim_m) & (farther % 2 == 0)
        return np.asarray(np.where(outside, -np.abs(nearest), nearest))

    def volume_m3(self, height_m: float) -> float:
        """Volume up to a height."""
        heights = np.unique([0.0, *(z for z, _ in self.levels if z < height_m), height_m])
        return float(np.trapezoid(self._areas(heights), heights))

    def height_m(self, volume_m3: float) -> float:
        """Height up to which a volume fills it."""
        heights, areas = np.array(self.levels).T
        steps = np.diff(heights)
        below = np.append(0.0, np.cumsum(steps * (areas[1:] + areas[:-1]) / 2))
        at = int(np.searchsorted(below, volume_m3, "right")) - 1
        slope = (np.diff(areas)[at] / steps[at]) if at < len(steps) else 0.0
        rest = volume_m3 - below[at]  # area * x + slope * x**2 / 2
        wide = areas[at] + math.sqrt(areas[at] ** 2 + 2 * slope * rest)
        return float(heights[at] + 2 * rest / wide) if rest else float(heights[at])

    def _areas(self, heights_m: Floats) -> Floats:
        return np.asarray(np.interp(heights_m, *np.array(self.levels).T))

    def chord(self, x_m: Floats, low_m: float, high_m: float) -> Floats:
        """Length along y, from `low_m` to `high_m`, that is inside at (N,) x, m."""
        if self.own_facets.size:
            rim = facets.cut(self.own_facets, self.rim_m * _BELOW_RIM)
            return np.array([facets.chord(rim, x, low_m, high_m) for x in x_m.tolist()])
        low, high = np.full_like(x_m, low_m), np.full_like(x_m, high_m)
        hole = np.zeros_like(x_m)
        for wall in self.upright:
            if wall.shape == "yplane":
                low, high = (
                    (np.maximum(low, wall.at_m), high)
                    if wall.inwards > 0
                    else (low, np.minimum(high, wall.at_m))
                )
            elif wall.shape == "zcylinder":
                half = np.sqrt(np.maximum(wall.at_m**2 - x_m**2, 0.0))
                if wall.inwards < 0:
                    low, high = np.clip(low, -half, half), np.clip(high, -half, half)
                else:
                    hole = half
        missing = np.clip(high, -hole, hole) - np.clip(low, -hole, hole)
        return np.asarray(np.maximum(high - low, 0.0) - missing)

    def sections(self, height_m: float) -> list[Floats]:
        """Closed lines around the section at a height, (N, 2), m: the outermost first."""
        if self.own_facets.size:
            height_m = min(max(height_m, self.rim_m * (1 - _BELOW_RIM)), self.rim_m * _BELOW_RIM)
            return facets.outlines(facets.cut(self.own_facets, height_m), _SIDES + 1)
        if not self.round:
            corners = [[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]
            return [np.array(corners) * self.half_widths_m]
        angle = np.linspace(0.0, math.tau, _SIDES + 1)
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        radii = [wall.at_m for wall in self.upright]
        if self.rim and height_m < self.rim_m:
            ends = [wall.ends_m for wall in self.walls if wall.ends_m is not None]
            radii = [
                r + (height_m - z) / (end_z - z) * (end_r - r)
                for r, z, end_r, end_z in ends
                if min(z, end_z) <= height_m < max(z, end_z)
            ]
        return [radius * circle for radius in sorted(radii, reverse=True) if radius > 0]

    def lines(self, height_m: float) -> Iterator[Floats]:
        """Its edges up to a height, and lines up its walls, (N, 3), m; of facets, sections."""
        if self.own_facets.size:
            for z in np.linspace(0.0, height_m, _SECTIONS).tolist():
                yield from (np.insert(outline, 2, z, axis=1) for outline in self.sections(z))
            return
        ends = [wall.ends_m for wall in self.walls if wall.ends_m is not None]
        heights = {0.0, height_m, *(end[3] for end in ends if end[3] < height_m)}
        for z in sorted(heights):
            for outline in self.sections(z):
                yield np.insert(outline, 2, z, axis=1)
        for start in np.linspace(0, 1, 4, endpoint=False):
            for r, z, end_r, end_z in ends:
                ray = np.array([math.cos(math.tau * start), math.sin(math.tau * start)])
                yield np.array([[*(r * ray), z], [*(end_r * ray), end_z]])
            for outline in self.sections(0.0) if not ends else ():
                point = outline[round(start * (len(outline) - 1))]
                yield np.array([[*point, 0.0], [*point, height_m]])


def four_planes(x_m: float, y_m: float) -> tuple[Wall, ...]:
    """The sides of a rectangle about the z axis with half its length and width."""
    return (
        Wall(name="west", shape="xplane", at_m=-x_m),
        Wall(name="east", shape="xplane", at_m=x_m, inwards=-1),
        Wall(name="south", shape="yplane", at_m=-y_m),
        Wall(name="north", shape="yplane", at_m=y_m, inwards=-1),
    )


def round_container(radius_m: float) -> Container:
    """The inside of a cylinder about the z axis with its floor at z = 0."""
    return Container(
        walls=(
            Wall(name="floor", shape="zplane", at_m=0.0, inwards=1),
            Wall(name="side", shape="zcylinder", at_m=radius_m, inwards=-1),
        ),
        half_widths_m=(radius_m, radius_m),
        clear_m=radius_m,
        levels=((0.0, math.pi * radius_m**2),),
    )

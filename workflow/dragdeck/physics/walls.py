"""The walls of a bowl and the space between them.

``case.json`` contains a `Container`, so that tables, checks and figures work on walls and know no
kind of bowl.
"""

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from dragdeck.arrays import Floats
from dragdeck.documents import Part

_AXES = {"xplane": 0, "yplane": 1, "zplane": 2}

_SIDES = 120
"""Corners of a drawn circle."""


class Wall(Part):
    """A plane, or an upright cylinder about the z axis, without end.

    Attributes
    ----------
    name : str
        In the input script.
    shape : str
        Its name in LIGGGHTS.
    at_m : float
        Coordinate of the plane, or radius of the cylinder.
    inwards : int
        1 if the particles are at larger coordinates, or outside of the cylinder; otherwise -1.
    """

    name: str
    shape: Literal["xplane", "yplane", "zplane", "zcylinder"]
    at_m: float
    inwards: Literal[1, -1]

    @property
    def upright(self) -> bool:
        """Whether it is neither floor nor lid."""
        return self.shape != "zplane"

    def contacts(self, centre_m: Floats) -> tuple[Floats, Floats]:
        """Distances, (N,), and normals into the bowl, (N, 3), of (N, 3) points.

        Distances are negative beyond the wall.
        """
        normal = np.zeros_like(centre_m)
        if self.shape in _AXES:
            axis = _AXES[self.shape]
            place = centre_m[:, axis]
            normal[:, axis] = self.inwards
        else:
            place = np.linalg.norm(centre_m[:, :2], axis=1)
            normal[:, :2] = self.inwards * centre_m[:, :2] / np.maximum(place, 1e-300)[:, None]
        return self.inwards * (place - self.at_m), normal


class Container(Part):
    """The space that particles can be in.

    Attributes
    ----------
    walls : tuple of Wall
        Those that hold the particles before they fall, and, unless there is a mesh with another
        shape, afterwards.
    half_widths_m : (float, float)
        Largest x and y within the walls.
    clear_m : float
        Radius of the widest sphere that fits between the upright walls.
    levels : tuple of (float, float)
        Heights, m, and areas of the horizontal section, m2, linear between them.
    """

    walls: tuple[Wall, ...]
    half_widths_m: tuple[PositiveFloat, PositiveFloat]
    clear_m: PositiveFloat
    levels: tuple[tuple[float, float], ...]

    @property
    def upright(self) -> list[Wall]:
        """All walls but floor and lid."""
        return [wall for wall in self.walls if wall.upright]

    @property
    def round(self) -> bool:
        """Whether it looks alike from all sides."""
        return all(wall.shape == "zcylinder" for wall in self.upright)

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
        radii = [wall.at_m for wall in self.walls if wall.shape == "zcylinder"]
        return max(radii) if radii else math.hypot(*self.half_widths_m)

    def side_distance(self, place_m: Floats) -> Floats:
        """Distance of (N, 2) or (N, 3) points from the nearest upright wall, (N,), m."""
        return np.asarray(np.min([wall.contacts(place_m)[0] for wall in self.upright], axis=0))

    def volume_m3(self, height_m: float) -> float:
        """Volume up to a height."""
        heights = np.unique([0.0, *(z for z, _ in self.levels if z < height_m), height_m])
        return float(np.trapezoid(self._areas(heights), heights))

    def height_m(self, volume_m3: float) -> float:
        """Height up to which a volume fills it."""
        (*_, (top, area)) = self.levels
        if volume_m3 >= (below := self.volume_m3(top)):
            return top + (volume_m3 - below) / area
        heights = np.linspace(0.0, top, 1001)
        volumes = [self.volume_m3(height) for height in heights.tolist()]
        return float(np.interp(volume_m3, volumes, heights))

    def _areas(self, heights_m: Floats) -> Floats:
        return np.asarray(np.interp(heights_m, *np.array(self.levels).T))

    def chord(self, x_m: Floats, low_m: float, high_m: float) -> Floats:
        """Length along y, from `low_m` to `high_m`, that is inside at (N,) x, m."""
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

    def outlines(self) -> Iterator[Floats]:
        """Closed lines around and within the horizontal section, (N, 2), m: the outer one first."""
        angle = np.linspace(0.0, math.tau, _SIDES + 1)
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        if any(wall.shape == "xplane" for wall in self.walls):
            corners = [[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]
            yield np.array(corners) * self.half_widths_m
        for wall in sorted(self.upright, key=lambda wall: wall.inwards):
            if wall.shape == "zcylinder":
                yield wall.at_m * circle


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

"""A profile turned about the z axis: a rounded floor, a hopper, a ring-shaped trough."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dragdeck.arrays import Floats
from dragdeck.mesh import shapes
from dragdeck.physics.walls import Container, Wall
from dragdeck.study.base import NonNegative
from dragdeck.study.bowls.bowl import Bowl

if TYPE_CHECKING:
    from trimesh import Trimesh

_SIDES = 48
"""Of the polygons that stand for circles, unless the study gives the size of the facets."""

_LEVELS = 60
"""Heights at which the area of the section is computed."""


class RevolvedBowl(Bowl):
    """A profile turned about the z axis."""

    kind: Literal["revolved"]
    """profile turned about the z axis"""
    profile_m: Annotated[list[tuple[NonNegative, NonNegative]], Field(min_length=2, max_length=500)]
    """radius and height of the points of the profile, from the axis, or from the rim of a column,
    outwards to the rim of the bowl, m"""

    @model_validator(mode="after")
    def _closed(self) -> Self:
        (first, begin), *_, (last, end) = self.profile_m
        if first and begin != self.height_m:
            raise ValueError(
                f"the bowl is not closed at the bottom: its profile begins at a radius of "
                f"{first:g} m, not at the axis nor at the rim of a column"
            )
        if end != self.height_m or last <= first:
            raise ValueError(f"the profile must end at the rim, at a height of {self.height_m:g} m")
        if min(height for _, height in self.profile_m) != 0.0:
            raise ValueError("the lowest point of the profile must be at a height of 0")
        if max(self.profile_m)[0] > last or max(height for _, height in self.profile_m) > end:
            raise ValueError("the bowl must be widest and highest at its rim")
        if any(first == second for first, second in pairwise(self.profile_m)):
            raise ValueError("the profile has a point twice in succession")
        if any(radius == 0 for radius, _ in self.profile_m[1:]):
            raise ValueError("only the first point of the profile may be on the axis")
        if _crosses_itself(np.array(self.profile_m)):
            raise ValueError("the profile crosses itself")
        return self

    @property
    def own_facet_size_m(self) -> float:
        """That of the study, or of a polygon with `_SIDES` sides."""
        return self.facet_size_m or math.tau * self.profile_m[-1][0] / _SIDES

    @property
    def container(self) -> Container:
        """Cones, and above the rim one or two cylinders."""
        core, rim = self.profile_m[0][0], self.profile_m[-1][0]
        sides = shapes.polygon_sides(rim, self.own_facet_size_m)
        cylinders = [Wall(name="side", shape="zcylinder", at_m=rim, inwards=-1)]
        if core:
            cylinders.append(Wall(name="core", shape="zcylinder", at_m=core, inwards=1))
        cones = [
            Wall(name=f"part_{number}", shape="cone", ends_m=(*begin, *end), sides=sides)
            for number, (begin, end) in enumerate(pairwise(self.profile_m), 1)
        ]
        return Container(
            walls=tuple(cones),
            half_widths_m=(rim, rim),
            clear_m=(rim - core) / 2 if core else rim,
            levels=tuple(self._levels()),
            rim=tuple(cylinders),
            rim_m=self.height_m,
        )

    def _levels(self) -> Sequence[tuple[float, float]]:
        heights = np.linspace(0.0, self.height_m * (1 - 1e-9), _LEVELS)
        areas = np.zeros(_LEVELS)
        for (r, z), (end_r, end_z) in pairwise(self.profile_m):
            if z != end_z:
                radius = r + (heights - z) / (end_z - z) * (end_r - r)
                within = (heights >= min(z, end_z)) & (heights < max(z, end_z))
                rises = math.copysign(math.pi, end_z - z)
                areas = np.where(within, areas + rises * radius**2, areas)
        return list(zip(heights.tolist(), np.maximum(areas, 0.0).tolist(), strict=True))

    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """The profile, and upright walls above its rim, as polygons around the circles."""
        points = list(self.profile_m)
        if height_m > self.height_m:
            column = [(points[0][0], height_m)] if points[0][0] else []
            points = [*column, *points, (points[-1][0], height_m)]
        return shapes.revolved(points, facet_size_m)

    def words(self, number: Callable[[float], str]) -> str:
        """With the radius of the rim."""
        return f"bowl of revolution, radius {number(self.profile_m[-1][0])}"


def _crosses_itself(points_m: Floats) -> bool:
    """Whether two parts of a line through (N, 2) points cross, or one goes back on the last."""
    along = np.diff(points_m, axis=0)
    across = along[:, None, ::-1] * [1.0, -1.0]
    side = ((points_m - points_m[:-1, None]) * across).sum(axis=2)
    between = side[:, :-1] * side[:, 1:] < 0
    back = (along[1:] * along[:-1]).sum(axis=1) < 0
    straight = np.diagonal(side, 2) == 0
    return bool((between & between.T).any() or (back & straight).any())

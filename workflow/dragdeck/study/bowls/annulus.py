"""A ring between a cylinder and a column, both about the z axis, with a flat floor."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, Self

from pydantic import model_validator

from dragdeck.mesh import shapes
from dragdeck.physics.walls import Container, Wall, round_container
from dragdeck.study.base import Positive
from dragdeck.study.bowls.bowl import Bowl

if TYPE_CHECKING:
    from trimesh import Trimesh


class AnnulusBowl(Bowl):
    """A ring between a cylinder and a column, both about the z axis, with a flat floor."""

    kind: Literal["annulus"]
    """ring around a column, with a flat floor"""
    radius_m: Positive
    """inner radius of the bowl, m"""
    core_radius_m: Positive
    """radius of the column, m"""

    @model_validator(mode="after")
    def _ring(self) -> Self:
        if self.core_radius_m >= self.radius_m:
            raise ValueError(
                f"core_radius_m {self.core_radius_m:g} is not below radius_m {self.radius_m:g}"
            )
        return self

    @property
    def container(self) -> Container:
        """That of a cylinder, and a column."""
        whole, core = round_container(self.radius_m), self.core_radius_m
        column = Wall(name="core", shape="zcylinder", at_m=core, inwards=1)
        ring = {
            "walls": (*whole.walls, column),
            "clear_m": (self.radius_m - core) / 2,
            "levels": ((0.0, math.pi * (self.radius_m**2 - core**2)),),
        }
        return whole.model_copy(update=ring)

    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """The column, the floor and the side."""
        outer, core = self.radius_m, self.core_radius_m
        profile = [(core, height_m), (core, 0.0), (outer, 0.0), (outer, height_m)]
        return shapes.revolved(profile, facet_size_m)

    def words(self, number: Callable[[float], str]) -> str:
        """With both radii."""
        return f"ring, radii {number(self.core_radius_m)} and {number(self.radius_m)}"

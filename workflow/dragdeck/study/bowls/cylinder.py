"""A flat-bottomed cylinder about the z axis."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from dragdeck.mesh import shapes
from dragdeck.parts import omitted
from dragdeck.physics.walls import Container, round_container
from dragdeck.study.base import Positive
from dragdeck.study.bowls.bowl import Bowl

if TYPE_CHECKING:
    from trimesh import Trimesh


class CylinderBowl(Bowl):
    """A flat-bottomed cylinder about the z axis."""

    kind: Literal["cylinder"] = omitted("cylinder")
    """flat-bottomed cylinder about the z axis"""
    radius_m: Positive
    """inner radius of the bowl, m"""

    @property
    def container(self) -> Container:
        """Between floor and side."""
        return round_container(self.radius_m)

    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """A floor and a side, whose polygon is outside of the circle."""
        return shapes.bowl(self.radius_m, height_m, facet_size_m)

    def words(self, number: Callable[[float], str]) -> str:
        """With its radius."""
        return f"cylinder, radius {number(self.radius_m)}"

"""A rectangular trough with its sides along x and y."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from dragdeck.mesh import shapes
from dragdeck.physics.walls import Container, Wall, four_planes
from dragdeck.study.base import Positive
from dragdeck.study.bowls.bowl import Bowl

if TYPE_CHECKING:
    from trimesh import Trimesh


class TroughBowl(Bowl):
    """A rectangular trough with its sides along x and y."""

    kind: Literal["trough"]
    """rectangular trough, the z axis in its middle"""
    length_m: Positive
    """inner length of the trough along x, m"""
    width_m: Positive
    """inner width of the trough along y, m"""

    @property
    def container(self) -> Container:
        """Between a floor and four planes."""
        x, y = self.length_m / 2, self.width_m / 2
        return Container(
            walls=(Wall(name="floor", shape="zplane"), *four_planes(x, y)),
            half_widths_m=(x, y),
            clear_m=min(x, y),
            levels=((0.0, self.length_m * self.width_m),),
        )

    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """The floor and four sides."""
        return shapes.trough((self.length_m, self.width_m, height_m), facet_size_m)

    def words(self, number: Callable[[float], str]) -> str:
        """With length and width."""
        return f"trough, {number(self.length_m)} by {number(self.width_m)}"

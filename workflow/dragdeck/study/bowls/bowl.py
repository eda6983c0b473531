"""What every kind of bowl has: fields, walls and a mesh."""

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING

from dragdeck.physics.walls import Container, Wall
from dragdeck.study.base import Model, Positive

if TYPE_CHECKING:
    from trimesh import Trimesh


LID = "lid"
"""Name of the wall that a lid is."""


class Bowl(Model):
    """Block of a study: the bowl, with its lowest point at z = 0."""

    if TYPE_CHECKING:
        kind: str

    material: str
    """material of the bowl: a name under `materials`"""
    height_m: Positive
    """inner height of the bowl from floor to rim, m"""
    lid_m: Positive | None = None
    """height of a lid above the floor, m, which holds the particles in the process; none: the bowl
    is open"""
    facet_size_m: Positive | None = None
    """edge length of the bowl's mesh elements, m; none: analytical walls, or a particle diameter if
    the bowl moves"""

    @property
    @abstractmethod
    def container(self) -> Container:
        """Its walls and the space between them."""

    @property
    def own_facet_size_m(self) -> float | None:
        """Edge length of its mesh elements, m; None if its walls are analytical."""
        return self.facet_size_m

    @property
    def closed(self) -> Container:
        """With the lid, if there is one."""
        if self.lid_m is None:
            return self.container
        lid = Wall(name=LID, shape="zplane", at_m=self.lid_m, inwards=-1)
        return self.container.model_copy(update={"walls": (*self.container.walls, lid)})

    @abstractmethod
    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """Its inside up to a height, open at the top, with normals pointing in."""

    @abstractmethod
    def words(self, number: Callable[[float], str]) -> str:
        """What a report calls it, with lengths in mm as `number` writes them."""

"""A bowl of the user's, from a mesh of its inside."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple, Self

import numpy as np
from pydantic import model_validator

from dragdeck.arrays import Floats
from dragdeck.mesh.surface import raised, surface, weld
from dragdeck.physics import facets
from dragdeck.physics.walls import Container, Wall, four_planes
from dragdeck.study.base import Number
from dragdeck.study.bowls.bowl import Bowl

if TYPE_CHECKING:
    from trimesh import Trimesh

_Facet = tuple[Number, Number, Number, Number, Number, Number, Number, Number, Number]

_LEVELS = 60
"""Heights at which the area of the section is computed."""

_SAME = 1e-3
"""Relative difference between the height of the mesh and that of the study."""

_ASIDE = 0.003
"""Distance of the middle from the axis that is mentioned, over the length of the rim."""

_AROUND = 720
"""Points of an outline."""


class _Inside(NamedTuple):
    """Corners of the facets, (F, 3, 3), and walls that fit within the rim; none around no axis."""

    corners_m: Floats
    rim: tuple[Wall, ...]


@lru_cache(maxsize=8)
def _inside(triangles: tuple[facets.Triangle, ...]) -> _Inside:
    corners = facets.corners(triangles)
    return _Inside(corners, _rim(corners))


def _rim(corners_m: Floats) -> tuple[Wall, ...]:
    """Upright walls that fit within the rim: one or two cylinders, or four planes."""
    height = corners_m[:, :, 2].max() * (1 - 1e-6)
    outer, *inner = facets.outlines(facets.cut(corners_m, height), _AROUND)
    radius, core = float(np.hypot(*outer.T).min()), 0.0
    if inner:
        core = float(np.hypot(*inner[0].T).max())
    elif not facets.is_inside(np.array([[0.0, 0.0, height]]), corners_m)[0]:
        return ()
    if core >= radius:
        return ()
    side = Wall(name="side", shape="zcylinder", at_m=radius, inwards=-1)
    if core:
        return side, Wall(name="core", shape="zcylinder", at_m=core, inwards=1)
    x, y = _widest_rectangle(outer)
    if 4 * x * y <= math.pi * radius**2:
        return (side,)
    return four_planes(x, y)


def _widest_rectangle(outline_m: Floats) -> tuple[float, float]:
    """Half of length and width of the largest rectangle about the axis within an outline."""
    x, y = np.abs(outline_m).T
    widths = np.unique(x)
    room = np.array([y[x < width - 1e-9].min(initial=np.inf) for width in widths])
    room[~np.isfinite(room)] = 0.0
    best = int((widths * room).argmax())
    return float(widths[best]), float(room[best])


@lru_cache(maxsize=8)
def _container(triangles: tuple[facets.Triangle, ...]) -> Container:
    corners, rim = _inside(triangles)
    top = float(corners[:, :, 2].max())
    heights = np.linspace(1e-6, 1 - 1e-6, _LEVELS) * top
    areas = [facets.area(facets.cut(corners, height)) for height in heights.tolist()]
    clear = min(abs(wall.at_m) for wall in rim)
    if len(rim) == 2:
        clear = (rim[0].at_m - rim[1].at_m) / 2
    x, y = np.abs(corners[:, :, :2]).max(axis=(0, 1)).tolist()
    return Container(
        walls=(Wall(name="facets", shape="facets", corners_m=triangles),),
        half_widths_m=(x, y),
        clear_m=clear,
        levels=tuple(zip([0.0, *heights[1:].tolist()], areas, strict=True)),
        rim=rim,
        rim_m=top,
    )


class MeshBowl(Bowl):
    """A bowl of the user's, from a mesh of its inside."""

    kind: Literal["mesh"]
    """bowl from a mesh of its inside"""
    file: str | None = None
    """file beside the study: the inner surface (STL, OBJ, PLY or VTK), closed up to a level rim,
    around the z axis"""
    unit: Literal["m", "cm", "mm", "um", "in"] | None = None
    """length unit of the file"""
    facets_m: tuple[_Facet, ...] = ()
    """in place of a file: x, y and z of the corners of facets"""

    @model_validator(mode="after")
    def _bowl(self) -> Self:
        if self.file is not None or not self.facets_m:
            raise ValueError("a bowl of kind mesh needs a file: the file of its inner surface")
        if self.facet_size_m is not None:
            raise ValueError("facet_size_m cannot be used: the bowl has the facets of its file")
        top = float(self._corners[:, :, 2].max())
        if abs(top / self.height_m - 1) > _SAME:
            known = f"height_m is {self.height_m:g}, but the rim is {top:.6g} m high"
            raise ValueError(f"{known}: correct it, or unit")
        if not _inside(self.facets_m).rim:
            raise ValueError(
                "the z axis does not pass through the middle of the bowl, nor through a column: "
                "move it there in the file"
            )
        return self

    @property
    def _corners(self) -> Floats:
        return _inside(self.facets_m).corners_m

    @property
    def aside(self) -> str:
        """Where the middle of its opening is, if not on the axis; otherwise empty."""
        rim = facets.cut(self._corners, self._corners[:, :, 2].max() * (1 - 1e-6))
        lengths = np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1)
        x, y = np.round(1e3 * np.average(rim.mean(axis=1), axis=0, weights=lengths), 1) + 0.0
        if 1e-3 * math.hypot(x, y) < _ASIDE * lengths.sum():
            return ""
        said = f"the middle of its opening is at x = {x:g}, y = {y:g} mm; paths and rotations are"
        return f"{said} about x = y = 0: if that is not meant, move it there in the file"

    @property
    def own_facet_size_m(self) -> float:
        """Of the smallest facet, as of one of a triangle with two equal legs."""
        sides = np.diff(self._corners, axis=1)
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
        return math.sqrt(float(areas.min()) / 0.4)

    @property
    def container(self) -> Container:
        """Its facets, and above the rim the walls between which particles start."""
        return _container(self.facets_m)

    def mesh(self, height_m: float, facet_size_m: float) -> "Trimesh":
        """Its own facets, and upright walls above its rim."""
        points = self._corners.reshape(-1, 3)
        bowl = weld(surface(points, np.arange(len(points)).reshape(-1, 3)))
        return raised(bowl, height_m) if height_m > bowl.bounds[1, 2] * (1 + _SAME) else bowl

    def words(self, number: Callable[[float], str]) -> str:
        """With its width."""
        x, y = self.container.half_widths_m
        return f"own mesh, {number(2 * x)} by {number(2 * y)}"

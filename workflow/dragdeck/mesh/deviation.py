"""How far a surface that was meshed anew is from the given one."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dragdeck.mesh.surface import Floats

if TYPE_CHECKING:
    from trimesh import Trimesh


class Deviation(NamedTuple):
    """What a surface differs by from that of its file.

    Parameters
    ----------
    facets : int
        Number in the file.
    distance_m : float
        Largest distance of a node or the centre of a facet from the other surface, m.
    volume, area : float
        Relative differences.
    """

    facets: int
    distance_m: float
    volume: float
    area: float

    def __str__(self) -> str:
        """In words."""
        return (
            f"meshed anew from {self.facets:,} facets: at most {1e3 * self.distance_m:.2g} mm from "
            f"the surface in the file, volume {100 * self.volume:+.2g} %, area "
            f"{100 * self.area:+.2g} %"
        )


def deviation(given: Trimesh, made: Trimesh) -> Deviation:
    """How far a surface is from the given one."""
    there = _distance(np.concatenate([made.vertices, made.triangles_center]), given)
    back = _distance(np.asarray(given.vertices), made)
    return Deviation(
        len(given.faces),
        max(there, back),
        made.volume / given.volume - 1.0,
        made.area / given.area - 1.0,
    )


def _distance(points: Floats, mesh: Trimesh) -> float:
    """Largest distance of points, (N, 3), from a surface, in units of both."""
    import pyvista

    size = float(np.abs(mesh.extents).max())  # VTK's tolerances are those of lengths about 1
    other = pyvista.PolyData.from_regular_faces(mesh.vertices / size, mesh.faces)
    cloud = pyvista.PolyData(points / size).compute_implicit_distance(other)
    return size * float(np.abs(cloud["implicit_distance"]).max())

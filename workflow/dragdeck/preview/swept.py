"""The volume that a moving body sweeps.

The distance to the body is known on a grid that moves with it. The swept volume is where the
least of these distances over all poses is negative: this is true of any shape and any motion.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dragdeck.mesh.surface import facing_out, surface

if TYPE_CHECKING:
    from trimesh import Trimesh

Floats = NDArray[np.float64]

_CELLS_ACROSS = 4
"""Cells of the grid across the body's mean thickness."""

_MOST_CELLS = 2_000_000, 20_000_000
"""Of the whole grid, and around the body in all poses together: beyond, cells are larger."""

_MARGIN = 2
"""Cells around a body."""

_MOST_TRIANGLES = 8000
"""Of the surface that is drawn."""


def swept_volume(mesh: "Trimesh", poses: Floats, share: float = 1.0) -> "Trimesh":
    """The surface of the volume that a body sweeps.

    Parameters
    ----------
    mesh : Trimesh
        Closed, in m.
    poses : (N, 4, 4) array
        Rigid motions from the mesh to space; what lies between two of them is not swept.
    share : float
        Of the cells that there may be at most.

    Returns
    -------
    Trimesh
        Closed, facing out, with at most `_MOST_TRIANGLES` triangles. Details finer than a cell
        of the grid are lost; a body that is thinner than two cells is made as thick as they are.
    """
    corners = np.concatenate([_moved(mesh.bounding_box.vertices, pose) for pose in poses])
    low, high = corners.min(axis=0), corners.max(axis=0)
    thickness = 2 * mesh.volume / mesh.area
    needed = np.prod(high - low), len(poses) * np.prod(mesh.extents)
    cell = max(
        thickness / _CELLS_ACROSS, np.cbrt(np.divide(needed, share * np.array(_MOST_CELLS))).max()
    )
    body = _distances(mesh, cell)
    shape = np.ceil((high - low) / cell).astype(int) + 2 * _MARGIN + 1
    origin, least = low - _MARGIN * cell, np.full(shape, _MARGIN * cell)
    for pose in poses:
        _dip(least, origin, cell, body, pose)
    grid = _grid(shape, origin, cell)
    grid["distance"] = least.ravel(order="F")
    level = max(0.0, cell - thickness / 2)
    contour = _as_mesh(grid.contour([level], "distance", method="flying_edges"))
    return drawn(facing_out(contour) or contour)


def drawn(mesh: "Trimesh") -> "Trimesh":
    """A mesh with fewer triangles, if it has more than can be drawn well."""
    if len(mesh.faces) <= _MOST_TRIANGLES:
        return mesh
    return _as_mesh(_as_data(mesh).decimate(1 - _MOST_TRIANGLES / len(mesh.faces)))


def below_and_above(mesh: "Trimesh", height_m: float) -> "list[Trimesh]":
    """The parts of a surface below and above a height, open where they were cut."""
    parts = (_as_data(mesh).clip(normal, origin=(0.0, 0.0, height_m)) for normal in ("z", "-z"))
    return [_as_mesh(part.triangulate()) for part in parts]


def _moved(points: Floats, pose: Floats) -> Floats:
    """(N, 3) points after a rigid motion."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def _as_data(mesh: "Trimesh") -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)


def _as_mesh(data: Any) -> "Trimesh":
    return surface(data.points, data.regular_faces)


def _grid(shape: Any, origin: Floats, cell: float) -> Any:
    import pyvista

    return pyvista.ImageData(dimensions=shape, spacing=(cell,) * 3, origin=origin)


def _distances(mesh: "Trimesh", cell: float) -> tuple[Floats, Floats]:
    """Origin of a grid around a body, and distances from its surface there, negative inside."""
    shape = np.ceil(mesh.extents / cell).astype(int) + 2 * _MARGIN + 1
    origin = mesh.bounds[0] - _MARGIN * cell
    grid = _grid(shape, origin, cell).compute_implicit_distance(_as_data(mesh))
    distance = grid["implicit_distance"]
    return origin, np.asarray(distance).reshape(shape, order="F")


def _dip(
    least: Floats, origin: Floats, cell: float, body: tuple[Floats, Floats], pose: Floats
) -> None:
    """Lower the distances, (X, Y, Z) in m, around a body in this pose."""
    from scipy.ndimage import map_coordinates

    start, distance = body
    ends = np.array(np.meshgrid(*([0, n - 1] for n in distance.shape))).reshape(3, -1).T
    around = (_moved(start + cell * ends, pose) - origin) / cell
    low = np.maximum(np.floor(around.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(around.max(axis=0)).astype(int) + 1, least.shape)
    block = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    points = origin + cell * np.indices(least[block].shape).reshape(3, -1).T + cell * low
    places = (points - pose[:3, 3]) @ pose[:3, :3]
    dips = map_coordinates(
        distance, ((places - start) / cell).T, order=1, cval=_MARGIN * cell
    ).reshape(least[block].shape)
    least[block] = np.minimum(least[block], dips)

"""The workpiece: its mesh, its frame and where it is at a step."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.kinematics import needed
from dragdeck.records.case import CaseOfRun
from dragdeck.study.rotations import Orientations, rotated


def read_workpiece_mesh(run_dir: Path, case: CaseOfRun) -> Any:
    """Read the workpiece's mesh, as it lies in its file.

    Raises
    ------
    TableError
        If the file is not there or damaged.
    """
    import pyvista as pv

    file = _mesh_file(run_dir, case)
    _corners(file)  # VTK's reader fills a file that was cut short with whatever the memory holds
    return pv.read(file)


def _mesh_file(run_dir: Path, case: CaseOfRun) -> Path:
    file = run_dir / needed(case.workpiece, "workpiece").mesh
    if not file.is_file():
        raise TableError(
            f"{file} is missing, although case.json names it as the mesh of the workpiece"
        )
    return file


def placed(workpiece: Any, workpiece_m: Floats, rotation: Orientations) -> Any:
    """The workpiece's mesh turned, and put to its reference point."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.matrices[0], workpiece_m
    return workpiece.transform(pose, inplace=False)


@dataclass(frozen=True)
class Surface:
    """The M facets of a workpiece in its own frame.

    The reference point is the origin; +x is the direction of motion when the
    drag begins, and z is up.

    Attributes
    ----------
    corners : (M, 3, 3) ndarray
        Corners of the facets in the order of the STL file, which is also that
        of the engine's numbers, from 0, m.
    """

    corners: Floats

    @property
    def centres(self) -> Floats:
        """Centres, (M, 3), m."""
        return np.asarray(self.corners.mean(axis=1))

    @property
    def areas(self) -> Floats:
        """Areas, (M,), m2."""
        return np.asarray(0.5 * np.linalg.norm(self._crossed(), axis=1))

    @property
    def normals(self) -> Floats:
        """Unit normals, (M, 3), by the order of the corners."""
        return np.asarray(self._crossed() / (2.0 * self.areas)[:, None])

    def _crossed(self) -> Floats:
        first, second, third = self.corners.transpose(1, 0, 2)
        return np.asarray(np.cross(second - first, third - first))


def read_surface(run_dir: Path, case: CaseOfRun) -> Surface:
    """Read the workpiece's mesh into its own frame.

    The STL file of a user's mesh looks along +x as it is; a cylinder is put into
    the bed unturned, whatever its heading.

    Raises
    ------
    TableError
        If the file is not there or damaged.
    """
    corners = _corners(_mesh_file(run_dir, case))
    if needed(case.workpiece, "workpiece").kind == "cylinder":
        corners = rotated(corners, -needed(case.motion, "motion").start_direction_rad)
    return Surface(corners)


def _corners(file: Path) -> Floats:
    """Corners of the facets of an STL file, (M, 3, 3)."""
    import meshio

    try:
        with np.errstate(over="ignore"):
            mesh = meshio.stl.read(file)
        return np.asarray(mesh.points[mesh.cells_dict["triangle"]], dtype=np.float64)
    except Exception as error:  # its parser lets any error out
        raise TableError(f"{file} is damaged ({error}); render and run it again") from error


def off_facet(point_m: Floats, corners: Floats) -> Floats:
    """The distance of (N, 3) points from (N, 3, 3) triangles, (N,) in m.

    That of trimesh is wrong for narrow triangles of the size of facets in m.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    away = point_m[:, None] - corners
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = (np.einsum("ijk,ijk->ij", np.cross(edges, away), normal[:, None]) >= 0).all(axis=1)
    along = np.einsum("ijk,ijk->ij", away, edges) / np.einsum("ijk,ijk->ij", edges, edges)
    nearest = corners + np.clip(along, 0.0, 1.0)[..., None] * edges
    from_edges = np.linalg.norm(point_m[:, None] - nearest, axis=2).min(axis=1)
    from_plane = np.abs(np.einsum("ij,ij->i", away[:, 0], normal))
    return np.asarray(np.where(inside, from_plane, from_edges))

"""The workpiece of a case, generated or from the user's mesh."""

import math
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.case import Case, mesh_file
from dragdeck.errors import Caution
from dragdeck.mesh import (
    Finding,
    Surroundings,
    check,
    cylinder,
    cylinder_radius,
    envelope,
    facing_out,
    place,
    points_below,
    read,
    tilted,
    upright,
)
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.motion import deepest, farthest_reach, plunge_point, surface_speed
from dragdeck.study.workpiece import CylinderShape, MeshShape

if TYPE_CHECKING:
    from trimesh import Trimesh

_FREEBOARD_DIAMETERS = 4
"""A generated workpiece stands this many particle diameters out of the bed."""


def workpiece_mesh(case: Case) -> "Trimesh":
    """The workpiece with its tip in the origin, leaning towards +x if it is tilted.

    Raises
    ------
    InputError
        The mesh file is missing or cannot be used.
    """
    shape, tilt = case.study.workpiece.shape, case.study.motion.tilt_deg
    if isinstance(shape, CylinderShape):
        mesh = _workpiece(shape, _generated_length(case))
    else:
        mesh, _ = _of_case(case, shape)
    return tilted(mesh, tilt) if tilt else mesh


def workpiece_warnings(case: Case) -> list[Caution]:
    """What is doubtful in the mesh of the user's, and what was repaired."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return []
    _, found = _of_case(case, shape)
    said = (f"{shape.file}: {one.problem}: {one.value} ({one.remedy})" for one in found)
    return [Caution("mesh", text) for text in said]


def _of_case(case: Case, shape: MeshShape) -> "tuple[Trimesh, list[Finding]]":
    surroundings = Surroundings(case.study.bowl.radius_m, case.study.media.radius_mean_m)
    return _from_file(mesh_file(case, shape), shape, surroundings)


def workpiece_length(case: Case) -> float:
    """Height of the workpiece, m: its length if it is not tilted."""
    study = case.study
    if isinstance(study.workpiece.shape, MeshShape) or study.motion.tilt_deg:
        return envelope(workpiece_mesh(case)).length_m
    return _generated_length(case)


def _generated_length(case: Case) -> float:
    """Length of a generated workpiece along its axis, m."""
    study = case.study
    freeboard = _FREEBOARD_DIAMETERS * 2 * study.media.radius_mean_m
    depth = deepest(study.motion)
    return round_to((depth + freeboard) / math.cos(math.radians(study.motion.tilt_deg or 0)), 6)


def workpiece_radius(case: Case) -> float:
    """Radius of the cylinder around the workpiece and its own axis, m."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return cylinder_radius(shape.radius_m, _generated_length(case), shape.facet_size_m)
    mesh, _ = _of_case(case, shape)
    return envelope(mesh).radius_m


def workpiece_reach(case: Case) -> float:
    """Radius of the upright cylinder about the tip around what is in the bed, m."""
    if not case.study.motion.tilt_deg:
        return workpiece_radius(case)
    return float(np.hypot(*_in_bed(case)).max())


def farthest_surface(case: Case) -> float:
    """Largest distance from the bowl's axis of what of the workpiece is in the bed, m.

    A tilted workpiece that shows the bowl's axis one side all the time is measured where it starts,
    all others as the cylinder of `workpiece_reach`.
    """
    motion = case.study.motion
    if not motion.tilt_deg or not motion.path.one_side_inwards(motion.orientation):
        return farthest_reach(motion) + workpiece_reach(case)
    angle, (x, y) = motion.path.direction_rad, _in_bed(case)
    across = np.array(
        [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)]
    )
    places = np.array([motion.path.start_point, plunge_point(motion)])
    return float(np.hypot(*(across[:, :, None] + places.T[:, None, :])).max())


def _in_bed(case: Case) -> NDArray[np.float64]:
    """X and y, (2, N), of the corners of what is in the bed, its front along +x, m."""
    return points_below(workpiece_mesh(case), deepest(case.study.motion))[:, :2].T


def fastest_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag, at the study's own speed, m/s."""
    motion = case.study.motion
    return surface_speed(motion, workpiece_radius(case) if motion.superposed() else 0.0)


@lru_cache(maxsize=8)
def _workpiece(shape: CylinderShape, length_m: float) -> "Trimesh":
    return cylinder(shape.radius_m, length_m, shape.facet_size_m, shape.facet_length_m)


@lru_cache(maxsize=8)
def _from_file(
    file: Path, shape: MeshShape, surroundings: Surroundings
) -> "tuple[Trimesh, list[Finding]]":
    sizes = shape.facet_size_m, shape.edge_facet_size_m
    mesh = upright(read(file, shape.unit, *sizes), shape.axis)
    found = check(mesh, file=file, field="workpiece.shape", surroundings=surroundings)
    turned = facing_out(mesh)
    assert turned is not None, "the check refuses a surface with one side"
    return place(turned, shape.offset_m), found

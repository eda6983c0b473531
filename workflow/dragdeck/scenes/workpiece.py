"""The workpiece of a case, generated or from the user's mesh."""

from functools import lru_cache
from pathlib import Path

from trimesh import Trimesh

from dragdeck.cases.case import Case, mesh_file
from dragdeck.errors import Caution
from dragdeck.mesh import (
    Finding,
    Surroundings,
    check,
    cylinder,
    envelope,
    facing_out,
    place,
    read,
)
from dragdeck.physics.rounding import round_to
from dragdeck.study.model import CylinderShape, MeshShape

_FREEBOARD_DIAMETERS = 4
"""A generated workpiece stands this many particle diameters out of the bed."""


def workpiece_mesh(case: Case) -> Trimesh:
    """The workpiece with its tip's centre in the origin.

    Raises
    ------
    InputError
        The mesh file is missing or cannot be used.
    """
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return _workpiece(shape, workpiece_length(case))
    mesh, _ = _of_case(case, shape)
    return mesh


def workpiece_warnings(case: Case) -> list[Caution]:
    """What is doubtful in the mesh of the user's, and what was repaired."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return []
    _, found = _of_case(case, shape)
    said = (f"{shape.file}: {one.problem}: {one.value} ({one.remedy})" for one in found)
    return [Caution("mesh", text) for text in said]


def _of_case(case: Case, shape: MeshShape) -> tuple[Trimesh, list[Finding]]:
    surroundings = Surroundings(case.study.bowl.radius_m, case.study.media.radius_mean_m)
    return _from_file(mesh_file(case, shape), shape.unit, surroundings)


def workpiece_length(case: Case) -> float:
    """Length of the workpiece along its axis, m."""
    study = case.study
    if isinstance(study.workpiece.shape, MeshShape):
        return envelope(workpiece_mesh(case)).length_m
    freeboard = _FREEBOARD_DIAMETERS * 2 * study.media.radius_mean_m
    return round_to(study.motion.immersion_depth_m + freeboard, 6)


def workpiece_radius(case: Case) -> float:
    """Radius of the upright cylinder around the workpiece, m."""
    return envelope(workpiece_mesh(case)).radius_m


@lru_cache(maxsize=8)
def _workpiece(shape: CylinderShape, length_m: float) -> Trimesh:
    return cylinder(shape.radius_m, length_m, shape.facet_size_m, shape.facet_length_m)


@lru_cache(maxsize=8)
def _from_file(file: Path, unit: str, surroundings: Surroundings) -> tuple[Trimesh, list[Finding]]:
    mesh = read(file, unit)
    found = check(mesh, file=file, field="workpiece.shape", surroundings=surroundings)
    turned = facing_out(mesh)
    assert turned is not None, "the check refuses a surface with one side"
    return place(turned), found

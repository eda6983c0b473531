"""The tool of a case, generated or from the user's mesh."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from dragdeck.cases import Case, mesh_file
from dragdeck.mesh import Mesh, Surroundings, check, cylinder, envelope, place, read
from dragdeck.scenes.common import round_to
from dragdeck.study import CylinderShape, MeshShape

FREEBOARD_DIAMETERS = 4
"""A generated rod stands this many ball diameters out of the bed."""


def tool_mesh(case: Case) -> Mesh:
    """The tool with its tip's centre in the origin.

    Raises
    ------
    InputError
        The mesh file is missing or cannot be used.
    """
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return _rod(shape, tool_length(case))
    media = case.study.media
    surroundings = Surroundings(case.study.bowl.radius_m, media.radius_mean_m)
    return _from_file(mesh_file(case, shape), shape.unit, surroundings)


def tool_length(case: Case) -> float:
    """Length of the tool along its axis, m."""
    study = case.study
    if isinstance(study.workpiece.shape, MeshShape):
        return envelope(tool_mesh(case)).length_m
    freeboard = FREEBOARD_DIAMETERS * 2 * study.media.radius_mean_m
    return round_to(study.motion.submersion_m + freeboard, 6)


def tool_radius(case: Case) -> float:
    """Radius of the upright cylinder around the tool, m."""
    return envelope(tool_mesh(case)).radius_m


@lru_cache(maxsize=8)
def _rod(shape: CylinderShape, length_m: float) -> Mesh:
    return cylinder(shape.radius_m, length_m, shape.facet_size_m, shape.facet_length_m)


@lru_cache(maxsize=8)
def _from_file(file: Path, unit: str, surroundings: Surroundings) -> Mesh:
    mesh = read(file, unit)
    check(mesh, file=file, field="workpiece.shape", surroundings=surroundings)
    return place(mesh)

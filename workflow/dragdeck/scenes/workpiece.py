"""The workpiece of a case, generated or from the user's mesh."""

import math
from collections.abc import Iterator
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
    cylinder_facets,
    cylinder_radius,
    envelope,
    facing_out,
    place,
    points_below,
    read,
    tilted,
    upright,
)
from dragdeck.physics.rounding import round_to, rounded
from dragdeck.scenes.legs import deepest, farthest_reach, plunge_point, surface_speed
from dragdeck.study.workpiece import CylinderShape, MeshShape

if TYPE_CHECKING:
    from trimesh import Trimesh

PARTICLE_STEPS_PER_S = 7e6
"""Particles times steps per second of a process, one rank, with a few facets."""

FACET_STEP_S = 3e-7
"""Time of a step for each facet of a workpiece, s, one rank (docs/data/benchmarks/facets.csv)."""

_MOST_TIMES, _ALWAYS_FACETS = 5, 5000
"""Facets are too many if they take this many times as long as the particles, and never below that
number."""

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
    """What is doubtful in the mesh of the user's, what was repaired, and what makes it slow."""
    shape, slow = case.study.workpiece.shape, list(_too_fine(case))
    if isinstance(shape, CylinderShape):
        return slow
    _, found = _of_case(case, shape)
    said = (f"{shape.file}: {one.problem}: {one.value} ({one.remedy})" for one in found)
    return [*(Caution("mesh", text) for text in said), *slow]


def _too_fine(case: Case) -> Iterator[Caution]:
    """A warning where a step is spent on facets."""
    shape, facets = case.study.workpiece.shape, workpiece_facets(case)
    particles_s = case.study.media.count / PARTICLE_STEPS_PER_S
    enough = max(_ALWAYS_FACETS, round(_MOST_TIMES * particles_s / FACET_STEP_S))
    if facets <= enough:
        return
    coarser = 1.1 * math.sqrt(facets / enough)  # not all facets scale alike
    size = shape.facet_size_m
    along = " (facet_length_m in proportion)" if isinstance(shape, CylinderShape) else ""
    remedy = (
        f"mesh it with facets {coarser:.2g} times as long"
        if size is None
        else f"workpiece.shape.facet_size_m: {rounded(size * coarser, up=True):g} would do{along}"
    )
    yield Caution(
        "facets",
        f"{facets:,} facets make a step about {1 + facets * FACET_STEP_S / particles_s:.2g} times "
        f"as long as the particles alone; about {enough:,} are cheap: {remedy}",
    )


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


def workpiece_facets(case: Case) -> int:
    """Number of facets of the workpiece; that of a generated one without making its mesh."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        sizes = shape.facet_size_m, shape.facet_length_m
        return cylinder_facets(shape.radius_m, _generated_length(case), *sizes)
    return len(workpiece_mesh(case).faces)


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

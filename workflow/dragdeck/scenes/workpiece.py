"""The workpiece of a case, generated or from the user's mesh."""

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.bed import bed_timestep
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
    surface,
    tilted,
    upright,
)
from dragdeck.physics.rounding import round_to, rounded
from dragdeck.scenes.legs import deepest, farthest_reach, plunge_point, surface_speed
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.rotation import by_vector
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

_LOOKS = 100
"""How often it is looked how a workpiece leans on its path."""

_FREEBOARD_DIAMETERS = 4
"""A generated workpiece stands this many particle diameters out of the bed."""


def workpiece_mesh(case: Case) -> "Trimesh":
    """The workpiece with its reference point in the origin, leaning towards +x if it is tilted.

    Raises
    ------
    InputError
        The mesh file is missing or cannot be used.
    """
    mesh, motion = _upright(case), case.study.motion
    if not motion.tilt_deg:
        return mesh
    return tilted(mesh, motion.tilt_deg, about_tip=motion.turns_about_inclined_axis)


def _upright(case: Case) -> "Trimesh":
    """The workpiece as it stands upright on its tip."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return _workpiece(shape, _generated_length(case))
    return _of_case(case, shape)[0]


def reference_height(case: Case) -> float:
    """Height of the reference point above the lowest point of the workpiece as it starts, m.

    A workpiece that spins about an inclined axis has it on the axis, and counts as low as it
    is at any angle of its spin.
    """
    motion = case.study.motion
    if not motion.turns_about_inclined_axis:
        return 0.0
    x, y, z = _upright(case).vertices.T
    tilt = math.radians(motion.tilt_deg or 0.0)
    lowest = z * math.cos(tilt) - np.hypot(x, y) * abs(math.sin(tilt))
    return round_to(float(-lowest.min()), 9)


def dip(case: Case) -> float:
    """How far a workpiece that leans on its path reaches below its lowest point at the start, m."""
    if not case.study.motion.path.leans:
        return 0.0
    return max(0.0, *(float(-points[:, 2].min()) for points in _postures(case)))


def _postures(case: Case) -> Iterator[NDArray[np.float64]]:
    """Corners of the workpiece, (N, 3), as it leans and spins, its front along +x, m."""
    mesh, motion = workpiece_mesh(case), case.study.motion
    way = DrivenMotion.of(motion, bed_timestep(case.study, "timestep_fraction"), 1.0)
    since = np.linspace(0.0, way.drive.steps, _LOOKS)
    own = motion.path.own(way.drive, since)
    if motion.turns_about_inclined_axis:
        tilt, angle = math.radians(way.drive.tilt_deg), np.linspace(0.0, math.tau, 25)[:, None]
        own = by_vector(angle * [math.sin(tilt), 0.0, math.cos(tilt)])
    for rotation in np.eye(3)[None] if own is None else own:
        yield mesh.vertices @ rotation.T


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
    if not case.study.motion.leans:
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
    mesh, height = workpiece_mesh(case), deepest(case.study.motion) - reference_height(case)
    found = [points_below(surface(points, mesh.faces), height)[:, :2] for points in _postures(case)]
    return np.concatenate(found).T


def fastest_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag, at the study's own speed, m/s."""
    motion = case.study.motion
    turns = motion.superposed() or motion.path.leans
    return surface_speed(motion, workpiece_radius(case) if turns else 0.0)


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

"""The workpiece of a case: its mesh and its sizes."""

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.bed import bed_timestep, box_half_widths
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh import surface as surfaces
from dragdeck.mesh.checks import MeshDefect, Surroundings, check
from dragdeck.mesh.files import read
from dragdeck.mesh.shapes import cylinder, cylinder_facets, cylinder_radius
from dragdeck.physics.rounding import round_to
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.paths.path import AroundBowl
from dragdeck.study.rotations import by_vector
from dragdeck.study.workpiece import CylinderShape, MeshShape
from dragdeck.study.yaml import mesh_beside

if TYPE_CHECKING:
    from trimesh import Trimesh


PARTICLE_STEPS_PER_S = 7e6
"""Particles times steps per second of a process, one rank, with a few facets."""


FACET_STEP_S = 3e-7
"""Time of a step for each facet of a workpiece, s, one rank (docs/data/benchmarks/facets.csv)."""


_LOOKS, _BETWEEN_POSTURES = 100, 1.01
"""How often it is looked how a workpiece leans on its path; by how much farther from the axis a
facet may be in between, of 24 angles of a spin."""


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
    return surfaces.tilted(mesh, motion.tilt_deg, about_tip=motion.turns_about_inclined_axis)


def _upright(case: Case) -> "Trimesh":
    """The workpiece as it stands upright on its tip."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return _workpiece(shape, _generated_length(case))
    return mesh_of_case(case, shape)[0]


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
    if not case.study.motion.path.inclined:
        return 0.0
    return max(0.0, *(float(-points[:, 2].min()) for points in _postures(case)))


def _postures(case: Case) -> Iterator[NDArray[np.float64]]:
    """Corners of the workpiece, (N, 3), as it leans and spins, its front along +x, m."""
    mesh, motion = workpiece_mesh(case), case.study.motion
    way = DrivenMotion.of(motion, bed_timestep(case.study, "timestep_fraction"), 1.0)
    since = np.linspace(0.0, way.drive.steps, _LOOKS)
    rotations = motion.path.in_frame(way.drive, since)
    if motion.turns_about_inclined_axis:
        rotations = by_vector(np.linspace(0.0, math.tau, 25)[:, None] * way.drive.own_axis)
    for rotation in np.eye(3)[None] if rotations is None else rotations:
        yield mesh.vertices @ rotation.T


def remeshing(case: Case) -> str | None:
    """How the surface of a workpiece that was meshed anew differs from that in its file."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return None
    deviation = mesh_of_case(case, shape)[0].metadata.get(surfaces.REMESHED)
    return deviation and f"{shape.file}, {deviation}"


def mesh_of_case(case: Case, shape: MeshShape) -> "tuple[Trimesh, list[MeshDefect]]":
    """The mesh of a shape from a file, upright with its tip in the origin, and its defects."""
    study = case.study
    sizes = study.bowl.container.clear_m, study.media.typical_radius_m, study.motion.deepest_m
    surroundings = Surroundings(*sizes)
    return _from_file(mesh_beside(case.file, shape.file), shape, surroundings)


def simulated_mesh(case: Case) -> "Trimesh":
    """The workpiece without what would leave the simulation box above the bed.

    LIGGGHTS ends a run if the centre of a facet leaves the box; of a wide part above the bed,
    such as a holder plate, no particle is there.

    Raises
    ------
    InputError
        A facet reaches from the bed out of the box.
    """
    mesh, motion = workpiece_mesh(case), case.study.motion
    around = isinstance(motion.path, AroundBowl)
    places = [motion.plunge_point, *motion.path.corners[:, :2].tolist()]
    axis = np.full(2, motion.farthest_m) if around else np.abs(places).max(axis=0)
    room = float((np.array(box_half_widths(case.study)) - axis).min())
    far, low = np.zeros(len(mesh.faces)), np.full(len(mesh.faces), np.inf)
    for corners in _postures(case):
        facets = corners[mesh.faces]
        far = np.maximum(far, np.hypot(*facets.mean(axis=1)[:, :2].T))
        low = np.minimum(low, facets[:, :, 2].min(axis=1))
    outside = far * (_BETWEEN_POSTURES if motion.inclined else 1.0) > room
    if (outside & (low < motion.deepest_m - reference_height(case))).any():
        raise InputError(
            "a facet of the workpiece reaches from the bed out of the simulation box",
            file=case.file,
            field="workpiece.shape",
            limit=f"a centre within {room:.4g} m from the axis of the workpiece",
            remedy="mesh the part with smaller facets, or cut it off above the bed",
        )
    return surfaces.surface(mesh.vertices, mesh.faces[~outside]) if outside.any() else mesh


def workpiece_length(case: Case) -> float:
    """Height of the workpiece, m: its length if it is not tilted."""
    study = case.study
    if isinstance(study.workpiece.shape, MeshShape) or study.motion.tilt_deg:
        low, high = workpiece_mesh(case).bounds[:, 2]
        return float(high - low)
    return _generated_length(case)


def _generated_length(case: Case) -> float:
    """Length of a generated workpiece along its axis, m."""
    study = case.study
    freeboard = _FREEBOARD_DIAMETERS * 2 * study.media.typical_radius_m
    depth = study.motion.deepest_m
    return round_to((depth + freeboard) / math.cos(math.radians(study.motion.tilt_deg or 0)), 6)


def workpiece_radius(case: Case) -> float:
    """Radius of the cylinder around the workpiece's own axis and what is in the bed, m.

    A workpiece that leans counts as a whole.
    """
    shape, motion = case.study.workpiece.shape, case.study.motion
    if isinstance(shape, CylinderShape):
        return cylinder_radius(shape.radius_m, _generated_length(case), shape.facet_size_m)
    mesh, _ = mesh_of_case(case, shape)
    below = surfaces.points_below(mesh, mesh.bounds[1, 2] if motion.inclined else motion.deepest_m)
    return float(np.hypot(*below[:, :2].T).max())


def workpiece_reach(case: Case) -> float:
    """Radius of the upright cylinder about the tip around what is in the bed, m."""
    if not case.study.motion.inclined:
        return workpiece_radius(case)
    return float(np.hypot(*outline_in_bed(case)).max())


def outline_in_bed(case: Case) -> NDArray[np.float64]:
    """X and y, (2, N), of the corners of what is in the bed, its front along +x, m."""
    mesh, height = workpiece_mesh(case), case.study.motion.deepest_m - reference_height(case)
    outlines = [
        surfaces.points_below(surfaces.surface(points, mesh.faces), height)[:, :2]
        for points in _postures(case)
    ]
    return np.concatenate(outlines).T


def fastest_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag, at the study's own speed, m/s."""
    motion = case.study.motion
    turns = motion.superposed() or motion.path.inclined
    return motion.surface_speed_m_s(workpiece_radius(case) if turns else 0.0)


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
) -> "tuple[Trimesh, list[MeshDefect]]":
    mesh = _read(file, shape, 2 * surroundings.bowl_radius_m)
    problems = check(mesh, file=file, field="workpiece.shape", surroundings=surroundings)
    turned = surfaces.facing_out(mesh)
    assert turned is not None, "the check refuses a surface with one side"
    placed = surfaces.place(turned, shape.offset_m)
    placed.metadata.update(mesh.metadata)
    return placed, problems


@lru_cache(maxsize=8)
def _read(file: Path, shape: MeshShape, widest_m: float) -> "Trimesh":
    sizes = shape.facet_size_m, shape.edge_facet_size_m
    return surfaces.upright(read(file, shape.unit, *sizes, widest_m), shape.axis)

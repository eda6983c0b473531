"""What a user should know of a workpiece and its motion before a process runs."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.cases.bed import (
    JUST_BEYOND,
    bed_timestep,
    box_half_widths,
    expected_surface,
    impact_time,
)
from dragdeck.cases.case import Case
from dragdeck.errors import Caution
from dragdeck.mesh.contacts import gap_fraction
from dragdeck.physics.rounding import rounded
from dragdeck.scenes.fit import (
    JAMMING_GAP,
    ROOM_BELOW,
    ROOM_BESIDE,
    clearances,
    driven_surface,
    in_diameters,
    wall_gap,
)
from dragdeck.scenes.workpiece import (
    FACET_STEP_S,
    PARTICLE_STEPS_PER_S,
    fastest_surface,
    mesh_of_case,
    simulated_mesh,
    workpiece_facets,
    workpiece_mesh,
)
from dragdeck.study.workpiece import MeshShape

if TYPE_CHECKING:
    from trimesh import Trimesh


_MOST_TIMES, _ALWAYS_FACETS = 5, 5000
"""Facets are too many if they take this many times as long as the particles, and never below that
number."""


_MOST_GAPS = 0.01
"""Part of a workpiece's surface on which LIGGGHTS may overlook contacts without a word."""


def workpiece_warnings(case: Case) -> list[Caution]:
    """What is doubtful in the mesh of the user's, what was repaired, and what makes it slow."""
    shape, said = case.study.workpiece.shape, []
    if isinstance(shape, MeshShape):
        mesh, problems = mesh_of_case(case, shape)
        said = [
            f"{shape.file}: {problem.problem}: {problem.value} ({problem.remedy})"
            for problem in problems
        ]
        said += _gaps(mesh, shape, case.study.media.typical_radius_m)
    return [*(Caution("mesh", text) for text in said), *_too_fine(case)]


def _gaps(mesh: "Trimesh", shape: MeshShape, radius_m: float) -> Iterator[str]:
    """A remark where many contacts are overlooked between nearly coplanar facets."""
    fraction = gap_fraction(mesh, radius_m)
    if fraction > _MOST_GAPS:
        where = "" if shape.facet_size_m is None else ": a larger workpiece.shape.facet_size_m"
        yield (
            f"{shape.file}: LIGGGHTS overlooks contacts on {100 * fraction:.2g} % of the surface, "
            "at convex edges between facets less than 0.26 degrees apart (mesh curved faces with "
            f"larger facets{where})"
        )


def _too_fine(case: Case) -> Iterator[Caution]:
    """A warning where a step is spent on facets."""
    shape, facets = case.study.workpiece.shape, workpiece_facets(case)
    particles_s = case.study.sphere_count / PARTICLE_STEPS_PER_S
    enough = max(_ALWAYS_FACETS, round(_MOST_TIMES * particles_s / FACET_STEP_S))
    if facets <= enough:
        return
    coarser = 1.1 * math.sqrt(facets / enough)  # not all facets scale alike
    of_file = isinstance(shape, MeshShape)
    size = shape.facet_size_m or float(np.median(workpiece_mesh(case).edges_unique_length))
    along = "" if of_file else " (facet_length_m in proportion)"
    remedy = f"workpiece.shape.facet_size_m: {rounded(size * coarser, up=True):g} would do{along}"
    yield Caution(
        "facets",
        f"{facets:,} facets make a step about {1 + facets * FACET_STEP_S / particles_s:.2g} times "
        f"as long as the particles alone; about {enough:,} are cheap: {remedy}",
    )


_FEWEST_STEPS_PER_CONTACT = 5
"""Below this many steps in a contact at the workpiece's speed a warning is given."""


def process_cautions(case: Case) -> Iterator[Caution]:
    """What a user should know of the workpiece and its motion before a process runs."""
    study = case.study
    yield from workpiece_warnings(case)
    of_file = isinstance(study.workpiece.shape, MeshShape)
    left_out = workpiece_facets(case) - len(simulated_mesh(case).faces) if of_file else 0
    if left_out:
        x, y = box_half_widths(study)
        yield Caution(
            "mesh",
            f"{left_out:,} facets above the bed would leave the simulation box, {x:.3g} by {y:.3g} "
            "m from the axis of the bowl: the run leaves them out",
        )
    gap = in_diameters(case, wall_gap(case))
    if gap < JAMMING_GAP:
        yield Caution(
            "gap",
            f"the gap between workpiece and bowl is {rounded(gap, up=False):g} particle diameters, "
            f"less than {JAMMING_GAP:g}: particles may jam there and cause very large forces",
        )
    yield from _little_room(case)
    fidelity = study.chosen_fidelity()
    surface = max(driven_surface(case), fidelity.speed_factor * _against_bowl(case))
    contact = impact_time(study, fidelity.youngs_modulus_scale, surface)
    steps = contact / bed_timestep(study, "timestep_fraction")
    if steps * JUST_BEYOND < _FEWEST_STEPS_PER_CONTACT:
        shorter = fidelity.timestep_fraction * steps / _FEWEST_STEPS_PER_CONTACT
        yield Caution(
            "steps_per_contact",
            f"a contact at the workpiece's speed takes {rounded(steps, up=False):g} steps, fewer "
            f"than {_FEWEST_STEPS_PER_CONTACT}: single impacts are not resolved; use a smaller "
            "fidelity.timestep_fraction",
            {"timestep_fraction": rounded(shorter, up=False)},
        )


def _little_room(case: Case) -> Iterator[Caution]:
    """A warning where walls or the floor are too near to larger particles."""
    reduction = case.study.reduction
    if reduction is None or (reduction.coarser or 1) <= 1:
        return
    gaps = clearances(case, expected_surface(case.study))
    beside, below = (in_diameters(case, gap) for gap in (gaps.wall_m, gaps.floor_m))
    if beside * JUST_BEYOND < ROOM_BESIDE or below * JUST_BEYOND < ROOM_BELOW:
        yield Caution(
            "gap",
            f"particles {reduction.coarser:g} times as large have {beside:.2g} of their diameters "
            f"beside the workpiece and {below:.2g} below it: with less than {ROOM_BESIDE:g} and "
            f"{ROOM_BELOW:g}, the drag rises more than linearly with their size, and the drag that "
            "is extrapolated to the true size is too small; use a smaller reduction.coarser or a "
            "wider bowl",
        )


def _against_bowl(case: Case) -> float:
    """Highest speed of the workpiece's surface relative to a bowl that moves by itself, m/s."""
    return fastest_surface(case) if case.study.motion.bowl else 0.0

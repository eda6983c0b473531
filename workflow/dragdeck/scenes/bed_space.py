"""The space of a bed: its expected height, the box around it, its ranks and the bowl as facets."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh.checks import check
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import polygon_sides
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.domain_split import FilledBowl, Split, split
from dragdeck.physics.packing import Bed, Particles, pour, room_to_insert
from dragdeck.physics.run_limits import RunLimits, run_limits
from dragdeck.physics.walls import Container
from dragdeck.records.bed import BowlOfRun
from dragdeck.study.media import Media
from dragdeck.study.model import Study
from dragdeck.study.shapes import SOLID_FRACTION_STD


class _Start(NamedTuple):
    """Highest point of the particles before they fall, m, and their largest speed, m/s."""

    top_m: float
    fastest_m_s: float


def _start(study: Study) -> _Start:
    """How particles start: spheres thrown from their places, clumps at rest where they fit."""
    if not study.media.clumped:
        particles = first_particles(study)
        return _Start(particles.top_m, particles.fastest_m_s)
    reaches = [class_.radii_m * class_.clump.reach for class_ in beds.bed_classes(study)]
    return _Start(room_to_insert(np.concatenate(reaches), study.bowl.container), 0.0)


def first_particles(study: Study) -> Particles:
    """The particles of a study before they fall."""
    counts = tuple(study.class_counts.values())
    return _first_particles(study.media, counts, study.bowl.container, study.seed)


@lru_cache(maxsize=1)
def _first_particles(
    media: Media, counts: tuple[int, ...], bowl: Container, seed: int
) -> Particles:
    return pour([class_.radii_m for class_ in beds.media_classes(media, counts)], bowl, seed)


def expected_bed(study: Study) -> Bed:
    """The settled bed before it exists: an estimate with a margin of two standard deviations."""
    surface = beds.expected_surface(study)
    top = surface + 2 * max(part.mean_radius_m for part in study.media.parts.values())
    return Bed(surface, top, 2 * SOLID_FRACTION_STD * surface)


def box_top(study: Study) -> float:
    """Top of the simulation box, m.

    Room for the falling particles, and for a workpiece above the bed.

    It must not depend on the workpiece: cases with other workpieces share this fill, and
    their runs inherit the box from its restart file.
    """
    diameter = 2 * study.media.typical_radius_m
    above_bed = 2 * beds.expected_surface(study) + 8 * diameter
    falling = _start(study).top_m
    return math.ceil(100 * max(falling, above_bed, 2 * study.bowl.height_m) + 5) / 100


def rank_split(case: Case, skin_m: float) -> Split:
    """How the box of a case is split among its ranks, with that neighbour skin."""
    study = case.study
    filled = FilledBowl(
        particles=study.sphere_count,
        bowl=study.bowl.container,
        height_m=beds.expected_surface(study),
        half_widths_m=beds.box_half_widths(study),
        bottom_m=-study.media.typical_radius_m,
        top_m=box_top(study),
        reach_m=(4 if study.media.clumped else 2) * beds.farthest_point(study) + skin_m,
    )
    return split(case.ranks, filled)


def bowl_neighbours(study: Study, skin_m: float) -> int:
    """More facets of the bowl, at least 0.4 size^2 each, than a particle in a corner reaches."""
    size = study.bowl_facet_size_m
    if size is None:
        return 0
    reach_m = beds.farthest_point(study) + skin_m + 2 * size
    return math.ceil(3 * math.pi * reach_m**2 / (0.4 * size**2))


def bowl_files(study: Study, top_m: float) -> dict[str, Callable[[], str]]:
    """The bowl as a mesh, if the study asks for facets or its width varies with height."""
    size = study.bowl_facet_size_m
    if size is None:
        return {}
    highest = beds.MESHED_PART * top_m
    height = highest if study.bowl.container.rim else min(study.bowl.height_m, highest)
    try:
        check(mesh := study.bowl.mesh(height, size), field="bowl.facet_size_m", workpiece=False)
    except InputError as error:
        error.remedy = "use another facet_size_m, or a bowl without very short parts"
        raise
    return {"bowl.stl": lambda: stl_text(mesh)}


def closed_bowl(study: Study) -> BowlOfRun:
    """The bowl of a process at rest, with polygons in place of its cylinders if it is a mesh."""
    closed, size = dict(study.bowl.closed), study.bowl_facet_size_m
    if size is not None:
        closed["walls"] = tuple(
            wall.model_copy(update={"sides": polygon_sides(wall.at_m, size)})
            if wall.shape == "zcylinder"
            else wall
            for wall in closed["walls"]
        )
    return BowlOfRun(**closed, meshed=size is not None)


def bed_limits(study: Study, top_m: float, speed_m_s: float) -> RunLimits:
    """Limits of a run with the whole bed in a box of that height."""
    mass = mechanics.particle_mass(beds.particle_material(study), study.media.typical_radius_m)
    if study.media.clumped:
        mass = beds.bed_density(study) * beds.bed_volume(study) / study.sphere_count
    return run_limits(study.sphere_count, mass, study.gravity_m_s2, top_m, speed_m_s)


_CACHED, _PER_COUNT = 10_000, 0.218
"""Particles up to which the cost of each is the same, and the power of their number with which it
grows above: 1.65 times in a decade (docs/development/benchmarks.md)."""


def particles_step_s(count: int, particle_steps_per_s: float) -> float:
    """CPU time of a step for so many particles, s: large beds do not fit the caches.

    Parameters
    ----------
    count : int
    particle_steps_per_s : float
        Particles times steps per second in a small bed.
    """
    return count / particle_steps_per_s * math.pow(max(1.0, count / _CACHED), _PER_COUNT)

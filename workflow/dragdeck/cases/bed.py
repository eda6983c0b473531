"""The media of a study as numbers: radii, Rayleigh time, time steps, neighbour skin."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.errors import InputError
from dragdeck.mesh.clump import SPHERE, Clump, fit_clump
from dragdeck.physics.contact_mechanics import (
    bed_pressure,
    effective_modulus,
    hertz_contact_time,
    particle_mass,
    rayleigh_time,
    stiffness_number,
)
from dragdeck.physics.rounding import round_to, rounded, timestep
from dragdeck.physics.run_limits import ENGINE_SOFTEST_PA
from dragdeck.records.bed import BodiesOfRun
from dragdeck.study.media import LEVELS, Media, few_sizes
from dragdeck.study.model import Study
from dragdeck.study.shapes import AnyShape
from dragdeck.study.workpiece import Material

JUST_BEYOND = 1 + 1e-6
"""A limit counts as passed from this multiple of it on: a rounded remedy may meet it exactly."""

MESHED_PART = 0.99
"""Part of the height of the simulation box up to which a mesh of the bowl reaches at most."""


@dataclass(frozen=True)
class BedClass:
    """Particles of one class in a bed.

    Attributes
    ----------
    name : str
        Empty if the media have no classes.
    material : str
    radii_m : (N,) array
        In ascending order; not to be changed. Of clumps, those of the spheres of equal volume.
    clump : Clump
        Spheres that stand for a particle; one if it is a sphere.
    """

    name: str
    material: str
    radii_m: Floats
    clump: Clump = SPHERE


def bed_classes(study: Study) -> tuple[BedClass, ...]:
    """The particles of a study, class by class."""
    return media_classes(study.media, tuple(study.class_counts.values()))


@lru_cache(maxsize=2)
def media_classes(media: Media, counts: tuple[int, ...]) -> tuple[BedClass, ...]:
    """`bed_classes` of the media and the number of particles of each class alone."""
    classes = []
    for (name, part), count in zip(media.parts.items(), counts, strict=True):
        radii = few_sizes(part.radii(count)) if media.clumped else part.radii(count)
        classes.append(BedClass(name, str(part.material), radii, clump_of(part.shape)))
    return tuple(classes)


@lru_cache(maxsize=32)
def clump_of(shape: AnyShape | None) -> Clump:
    """The spheres that stand for a shape.

    Raises
    ------
    InputError
        The shape is flat, or so many spheres cannot stand for it.
    """
    if shape is None:
        return SPHERE
    try:
        return fit_clump(shape.corners(), shape.spheres)
    except InputError as error:
        error.field = error.field or "media.shape"
        raise


_CORE = 0.01
"""Radius of the second sphere of a particle that is one, over that of the first: LIGGGHTS accepts
no clump of one sphere, and nothing reaches this one."""


class BodySize(BodiesOfRun):
    """Clumps of one class and size, with what LIGGGHTS must know of them beside.

    Attributes
    ----------
    type : int
        Of their material in LIGGGHTS.
    density_kg_m3 : float
    """

    type: int
    density_kg_m3: float


def body_sizes(study: Study) -> list[BodySize]:
    """The particles of a study by class and size, if they are clumps; otherwise none."""
    sizes: list[BodySize] = []
    body = sphere = 1
    for class_ in bed_classes(study) if study.media.clumped else ():
        material = study.materials[class_.material]
        kind = 1 + study.type_names().index(class_.material)
        spheres = np.column_stack([class_.clump.offsets, class_.clump.radii])
        if len(spheres) == 1:
            spheres = np.vstack([spheres, _CORE * spheres])
        rows = map(np.ndarray.tolist, np.unique(class_.radii_m, return_counts=True))
        for size, count in zip(*rows, strict=True):
            mass, scaled = particle_mass(material, size), size * spheres
            sizes.append(
                BodySize(
                    type=kind,
                    density_kg_m3=material.density_kg_m3,
                    first_id=body,
                    count=count,
                    first_sphere=sphere,
                    radius_m=size,
                    mass_kg=mass,
                    inertia_kg_m2=(mass * size**2 * class_.clump.inertia).tolist(),
                    offsets_m=scaled[:, :3].tolist(),
                    radii_m=scaled[:, 3].tolist(),
                )
            )
            body, sphere = body + count, sphere + count * len(spheres)
    return sizes


def bed_radii(study: Study) -> Floats:
    """Radii of a study's particles, class by class and ascending in each, (count,), m."""
    return np.concatenate([class_.radii_m for class_ in bed_classes(study)])


def smallest_radius(study: Study) -> float:
    """Radius of the smallest sphere of the bed, m."""
    return min(float(class_.radii_m[0] * class_.clump.radii.min()) for class_ in bed_classes(study))


def farthest_point(study: Study) -> float:
    """Distance of the farthest point of a particle of the bed from its centre, m."""
    return max(float(class_.radii_m[-1]) * class_.clump.reach for class_ in bed_classes(study))


def typical_reach(study: Study) -> float:
    """That of a mean particle of the first class, m."""
    return study.media.typical_radius_m * bed_classes(study)[0].clump.reach


def bed_rayleigh_time(study: Study) -> float:
    """Shortest Rayleigh time of the particles at the fidelity's modulus, s."""
    scale = study.chosen_fidelity().youngs_modulus_scale
    return min(
        rayleigh_time(
            study.materials[class_.material],
            float(class_.radii_m[0]) * class_.clump.timestep_radius,
            scale,
        )
        for class_ in bed_classes(study)
    )


def bed_volume(study: Study) -> float:
    """Total volume of the particles, m3."""
    return float((4 / 3 * np.pi * bed_radii(study) ** 3).sum())


def bed_density(study: Study) -> float:
    """Mean density of the particles, weighted by volume, kg/m3."""
    classes = bed_classes(study)
    volumes = [(class_.radii_m**3).sum() for class_ in classes]
    densities = [study.materials[class_.material].density_kg_m3 for class_ in classes]
    return densities[0] if len(densities) == 1 else float(np.average(densities, weights=volumes))


def expected_surface(study: Study) -> float:
    """Height of the settled bed before it exists, m: an estimate."""
    classes, parts = bed_classes(study), study.media.parts.values()
    levels = [part.radii(LEVELS) for part in parts]
    numbers = np.repeat([len(class_.radii_m) for class_ in classes], LEVELS)
    solid = study.media.solid_fraction(np.concatenate(levels), numbers)
    return study.bowl.container.height_m(bed_volume(study) / solid)


def submerged_fraction(study: Study, depth_m: float | None = None) -> float:
    """Part of the expected bed that is below the compound's surface.

    Parameters
    ----------
    study : Study
    depth_m : float, optional
        Of the part of the bed that counts, from its surface; all of it by default.
    """
    surface = expected_surface(study)
    depth = min(depth_m or surface, surface)
    return min(max((study.liquid_level_m - surface) / depth + 1, 0.0), 1.0)


def buoyancy_density(study: Study, depth_m: float | None = None) -> float:
    """Mass of displaced liquid per volume of the particles down to a depth, kg/m3."""
    if study.compound is None:
        return 0.0
    return study.compound.density_kg_m3 * submerged_fraction(study, depth_m)


def weight_density(study: Study, depth_m: float | None = None) -> float:
    """Density of the particles' weight minus buoyancy, kg/m3: of those down to a depth, or all."""
    return bed_density(study) - buoyancy_density(study, depth_m)


def weight_acceleration(study: Study) -> float:
    """Mean weight minus buoyancy of the particles over their mass, m/s2."""
    return study.gravity_m_s2 * (weight_density(study) / bed_density(study))


def bed_timestep(study: Study, field: str) -> float:
    """Time step of the process or of the filling, by its field of the fidelity, s."""
    return timestep(bed_rayleigh_time(study), getattr(study.chosen_fidelity(), field))


def impact_time(study: Study, scale: float, speed_m_s: float) -> float:
    """Duration of an elastic impact of the mean particle on the workpiece's material, s.

    Parameters
    ----------
    study : Study
    scale : float
        Factor on every Young's modulus.
    speed_m_s : float
    """
    particle, plate = particle_material(study), study.materials[study.workpiece.material]
    radius, modulus = study.media.typical_radius_m, effective_modulus(particle, plate, scale)
    return hertz_contact_time(particle_mass(particle, radius), radius, modulus, speed_m_s)


def particle_material(study: Study) -> Material:
    """Material of the particles, of their first class."""
    return study.materials[study.media.main_material]


def tip_pressure(study: Study) -> float:
    """Pressure of the bed at the depth of the workpiece's tip, Pa."""
    depth = study.motion.immersion_depth_m
    return bed_pressure(weight_density(study, depth), study.gravity_m_s2, depth)


def floor_pressure(study: Study) -> float:
    """Weight of the bed on the floor, Pa."""
    return bed_pressure(weight_density(study), study.gravity_m_s2, expected_surface(study))


def full_stiffness_number(study: Study) -> float:
    """Stiffness number at the tip, with the physical Young's modulus."""
    return stiffness_number(particle_material(study), tip_pressure(study))


def box_half_widths(study: Study) -> tuple[float, float]:
    """Half of the simulation box's widths along x and y, from the axis of the bowl, m."""
    x, y = study.bowl.container.half_widths_m
    return x + 2 * study.media.typical_radius_m, y + 2 * study.media.typical_radius_m


def skin(study: Study) -> float:
    """Neighbour skin, m: the fidelity's own, or a tenth of the mean radius."""
    chosen = study.chosen_fidelity().skin_m
    return chosen if chosen is not None else round_to(0.1 * study.media.typical_radius_m, 3)


def widest_skin(study: Study) -> float:
    """Widest neighbour skin without a measurable cost, m (docs/development/benchmarks.md)."""
    return round_to(0.3 * study.media.typical_radius_m, 3)


def softest_scale(study: Study) -> float:
    """The smallest modulus scale that the engine takes for a study's materials."""
    softest = min(study.materials[name].youngs_modulus_pa for name in study.type_names())
    return min(1.0, rounded(ENGINE_SOFTEST_PA / softest, up=True))

"""What ``case.json`` says of the particles and the bowl; the engine reads it, too."""

from collections.abc import Mapping

import numpy as np
from pydantic import PositiveFloat

from dragdeck.arrays import Floats, Ints, class_numbers
from dragdeck.parts import Part, omitted
from dragdeck.physics.contact_mechanics import ContactConstants
from dragdeck.physics.walls import Container
from dragdeck.records.run import CaseFile, CountOfRun
from dragdeck.study.motion import AnyBowlMotion


class MediaOfRun(CountOfRun):
    """The media: number of particles, and their radii and density as specified in the study.

    Attributes
    ----------
    count : int
        Number of particles.
    radius_mean_m, radius_std_m : float
        Mean and standard deviation of the radii, m.
    density_kg_m3 : float
        Density, kg/m3.
    buoyancy_kg_m3 : float
        Mass of liquid that the particles of a bed displace per volume, kg/m3; absent if dry.
    """

    radius_mean_m: PositiveFloat
    radius_std_m: float
    density_kg_m3: PositiveFloat
    buoyancy_kg_m3: float = omitted(0.0)

    @property
    def weight_kg_m3(self) -> float:
        """Density that belongs to the weight minus buoyancy, kg/m3."""
        return self.density_kg_m3 - self.buoyancy_kg_m3


class ClassOfRun(Part):
    """A class of the media.

    Attributes
    ----------
    name, material : str
    first_id, count : int
        Its particles have the ids from `first_id` on.
    volume_m3 : float
        Of all of them.
    radius_mean_m, radius_std_m : float
        Of the particles as placed, m.
    density_kg_m3 : float
    contact_moduli, attractive : mapping
        As in `CaseOfBed`, of a particle of this class; those with other classes by their names.
    """

    name: str
    material: str
    first_id: int
    count: int
    volume_m3: PositiveFloat
    radius_mean_m: PositiveFloat
    radius_std_m: float
    density_kg_m3: PositiveFloat
    contact_moduli: Mapping[str, ContactConstants]
    attractive: Mapping[str, Mapping[str, float]] = omitted({})


class BodiesOfRun(Part):
    """Particles of one class and size that are clumps of spheres.

    Attributes
    ----------
    first_id, count : int
        They have the ids from `first_id` on.
    first_sphere : int
        Id in LIGGGHTS of the first sphere of the first one; spheres are counted particle by
        particle.
    radius_m, mass_kg : float
        Radius of the sphere of equal volume, and mass.
    inertia_kg_m2 : tuple of float
        Principal moments of inertia.
    offsets_m, radii_m : tuple
        Places of the spheres of a particle in its principal frame about the centre of mass, and
        their radii, m.
    """

    first_id: int
    count: int
    first_sphere: int
    radius_m: PositiveFloat
    mass_kg: PositiveFloat
    inertia_kg_m2: tuple[PositiveFloat, PositiveFloat, PositiveFloat]
    offsets_m: tuple[tuple[float, float, float], ...]
    radii_m: tuple[PositiveFloat, ...]

    @property
    def spheres_m(self) -> list[list[float]]:
        """Place and radius of each sphere of a particle, m."""
        pairs = zip(self.offsets_m, self.radii_m, strict=True)
        return [[*place, radius] for place, radius in pairs]

    @property
    def rows(self) -> slice:
        """The spheres of all these particles, in rows of all spheres in the order of their ids."""
        first = self.first_sphere - 1
        return slice(first, first + self.count * len(self.radii_m))

    def by_particle(self, values: Floats) -> Floats:
        """Values of all spheres, (N, C), in the order of their ids, as (particle, sphere, C)."""
        return values[self.rows].reshape(self.count, len(self.radii_m), -1)


class BowlOfRun(Container):
    """The bowl.

    Attributes
    ----------
    meshed : bool
        Whether the particles touch a mesh in place of its walls.
    motion : BowlMotion or None
        How it moves during the process, as driven.
    """

    meshed: bool = omitted(False)
    motion: AnyBowlMotion | None = omitted(None)


class CaseOfBed(CaseFile):
    """The particles of a run of a study, and what they touch.

    Attributes
    ----------
    contact_moduli : mapping
        Contact constants of a particle with a ``particle``, the ``bowl`` and the ``workpiece``,
        softened as the run is.
    attractive : mapping
        By the same names, coefficients that add an attractive force, as simulated; absent if the
        contact law has none.
    classes : tuple of ClassOfRun
        Classes of the media, if there are several.
    bodies : tuple of BodiesOfRun
        Particles by class and size, if they are clumps of spheres.
    unsafe_timestep : str or None
        Why a step of the process beyond the stable one is accepted; absent if it is not.
    """

    gravity_m_s2: float
    media: MediaOfRun
    bowl: BowlOfRun
    contact_moduli: Mapping[str, ContactConstants]
    attractive: Mapping[str, Mapping[str, float]] = omitted({})
    classes: tuple[ClassOfRun, ...] = omitted(())
    bodies: tuple[BodiesOfRun, ...] = omitted(())
    unsafe_timestep: str | None = omitted(None)

    def class_of(self, particle_id: Ints) -> Ints:
        """Number of the class of (N,) particles in `classes`; 0 if there are none."""
        return class_numbers(particle_id, [class_.first_id for class_ in self.classes])

    def body_of(self, sphere_id: Ints) -> Ints:
        """Ids of the bodies of (N,) spheres of clumps; ids below 1, of walls, stay."""
        first = np.array([body.first_sphere for body in self.bodies])
        size = np.maximum(np.searchsorted(first, sphere_id, side="right") - 1, 0)
        many = np.array([len(body.radii_m) for body in self.bodies])[size]
        first_id = np.array([body.first_id for body in self.bodies])[size]
        return np.where(sphere_id > 0, first_id + (sphere_id - first[size]) // many, sphere_id)

    def density_of(self, particle_id: Ints) -> Floats:
        """Density of (N,) particles, kg/m3."""
        densities = [class_.density_kg_m3 for class_ in self.classes] or [self.media.density_kg_m3]
        return np.array(densities)[self.class_of(particle_id)]

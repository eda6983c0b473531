"""``case.json`` of a run of a study: what it models, for whoever reads its output."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import JsonValue, PlainSerializer, PositiveFloat, PositiveInt

from dragdeck.arrays import Floats, Ints, class_numbers
from dragdeck.documents import Part, omitted
from dragdeck.errors import DocumentError, choices
from dragdeck.physics.contact_mechanics import ContactConstants
from dragdeck.physics.run_limits import RunLimits
from dragdeck.records.advised import AdvisedSettings
from dragdeck.records.run import CaseFile, CountOfRun, RanksOfRun, SettlingCriterion
from dragdeck.study.base import Json
from dragdeck.study.drive import PathEntry, SuperposedEntry
from dragdeck.study.model import Study

StudyOfRun = Annotated[Study, PlainSerializer(Study.plain)]
"""The study of a case, with its settings in place of a fidelity's name; its files are not read."""


class FidelityOfRun(RanksOfRun):
    """The settings for speed and accuracy with which this run is simulated.

    A drop test and a filling have their own time step, and no workpiece that could be faster.

    Attributes
    ----------
    name : str
        Name of the fidelity of the case.
    youngs_modulus_scale, speed_factor : float
        Multipliers of every Young's modulus and of the speed of the workpiece.
    timestep_fraction : float
        Time step as a fraction of the Rayleigh time.
    skin_m : float
        Neighbour skin, m.
    ranks : int
        MPI ranks.
    """

    name: str
    youngs_modulus_scale: PositiveFloat
    timestep_fraction: PositiveFloat
    speed_factor: PositiveFloat
    skin_m: PositiveFloat


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
        As in `CaseOfRun`, of a particle of this class; those with other classes by their names.
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


class BowlOfRun(Part):
    """The bowl: a cylinder about the z axis with its floor at z = 0.

    Attributes
    ----------
    radius_m : float
        Inner radius, m.
    walls : str
        ``primitive`` (analytical plane and cylinder) or ``mesh``.
    """

    radius_m: PositiveFloat
    walls: Literal["primitive", "mesh"]


class WorkpieceOfRun(Part):
    """The workpiece.

    Attributes
    ----------
    number, count : int
        Number of this workpiece, from 1, and number of all; absent if there is only one.
    wake_from_m : float or None
        Path length after which its axis is where a workpiece has passed before; absent if that
        never happens, or if the path is not a circle.
    kind : str
        ``cylinder`` or ``mesh``.
    radius_m : float
        Radius of the vertical cylinder around its immersed part, m.
    length_m : float
        Height, m.
    mesh : str
        File of its mesh.
    immersion_depth_m : float
        Depth of its tip below the settled surface, m.
    """

    kind: Literal["cylinder", "mesh"]
    radius_m: PositiveFloat
    length_m: PositiveFloat
    mesh: str
    immersion_depth_m: float
    number: int = omitted(0)
    count: PositiveInt = omitted(1)
    wake_from_m: PositiveFloat | None = omitted(None)


class AssumptionOfRun(Part):
    """A value that the source of the study does not report.

    Attributes
    ----------
    field : str
        Dotted name of the field.
    value : JSON value
        The assumed value.
    why : str
        Reason for the value.
    """

    field: str
    value: JsonValue
    why: str


class StatisticsOfRun(Part):
    """The part of the drag that is excluded from the statistics.

    Attributes
    ----------
    transient_s : float
        Initial time of the drag, s of simulated time.
    """

    transient_s: float


class CaseOfRun(CaseFile):
    """The content of ``case.json`` of a run of a study.

    The attributes are the keys of the document. Those that a scene does not have are absent.

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
    fidelity : FidelityOfRun
        Settings for speed and accuracy.
    assumptions : tuple of AssumptionOfRun
        Values that the source of the study does not report.
    study : Study or None
        The study of the case of a process.
    case : str or None
        Readable name of the case of a process.
    upstream : mapping
        Run ids of the filling and drop test of a process.
    output_of : str or None
        Run whose raw output is read, for a second or further workpiece.
    lead : str or None
        Run id of the softer run that a process continues.
    numbers : mapping
        Dimensionless numbers of a process at the physical modulus and the speed of the study.
    surface_m : float or None
        Height of the settled surface above the floor, m.
    workpiece : WorkpieceOfRun or None
        Geometry and immersion.
    motion, superposed
        Path of the drag as simulated, and motions superposed on it.
    statistics : StatisticsOfRun or None
        Transient that is excluded.
    asked : AdvisedSettings or None
        Tolerance from which the settings were derived.
    restitution : float or None
        Coefficient of restitution in the input script of a drop test.
    """

    gravity_m_s2: float
    fidelity: FidelityOfRun
    media: MediaOfRun
    bowl: BowlOfRun
    contact_moduli: Mapping[str, ContactConstants]
    attractive: Mapping[str, Mapping[str, float]] = omitted({})
    classes: tuple[ClassOfRun, ...] = omitted(())
    bodies: tuple[BodiesOfRun, ...] = omitted(())
    assumptions: tuple[AssumptionOfRun, ...]
    study: StudyOfRun | None = omitted(None)
    case: str | None = omitted(None)
    upstream: Mapping[str, str] = omitted({})
    output_of: str | None = omitted(None)
    lead: str | None = omitted(None)
    numbers: Mapping[str, float] = omitted({})
    surface_m: PositiveFloat | None = omitted(None)
    workpiece: WorkpieceOfRun | None = omitted(None)
    motion: PathEntry | None = omitted(None)
    superposed: tuple[SuperposedEntry, ...] = omitted(())
    statistics: StatisticsOfRun | None = omitted(None)
    asked: AdvisedSettings | None = omitted(None)
    restitution: float | None = omitted(None)

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


class DropTestCase(CaseOfRun):
    """The ``case.json`` of a drop test; `inputs`: what it depends on."""

    scene: Literal["drop_test"] = "drop_test"
    inputs: Json
    restitution: float


class FillingCase(CaseOfRun):
    """The ``case.json`` of a filling; `inputs`: what it depends on."""

    scene: Literal["filling"] = "filling"
    inputs: Json
    settled: SettlingCriterion
    limits: RunLimits


class ProcessCase(CaseOfRun):
    """The ``case.json`` of a process: the workpiece is dragged through the settled packing."""

    scene: Literal["process"] = "process"
    study: StudyOfRun
    case: str
    upstream: Mapping[str, str]
    numbers: Mapping[str, float]
    surface_m: PositiveFloat
    workpiece: WorkpieceOfRun
    motion: PathEntry
    statistics: StatisticsOfRun
    limits: RunLimits
    asked: AdvisedSettings | None = None


_OF_SCENE: Mapping[str, type[CaseOfRun]] = {
    "drop_test": DropTestCase,
    "filling": FillingCase,
    "process": ProcessCase,
}


def load_case(run_dir: Path | str) -> CaseOfRun:
    """Read ``case.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    CaseOfRun
        A `DropTestCase`, `FillingCase` or `ProcessCase`.

    Raises
    ------
    DocumentError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    file = Path(run_dir) / "case.json"
    scene = CaseFile.read(file).scene
    if scene not in _OF_SCENE:
        raise DocumentError(
            "the scene is not one of a study",
            file=file,
            field="scene",
            value=scene,
            limit=choices(scene, _OF_SCENE),
            remedy=CaseFile.remedy,
        )
    return _OF_SCENE[scene].read(file)

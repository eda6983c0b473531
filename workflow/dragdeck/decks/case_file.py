"""``case.json``: what a run models, for whoever reads its output."""

from collections.abc import Mapping, Sequence
from typing import Literal

from pydantic import JsonValue

from dragdeck.documents import Document, Part
from dragdeck.physics.contact_network import ContactConstants
from dragdeck.physics.run_limits import RunLimits
from dragdeck.study.reference import Reference


class RanksOfRun(Part):
    """MPI ranks of a run."""

    ranks: int


class CountOfRun(Part):
    """Particles of a run."""

    count: int


class FidelityOfRun(RanksOfRun):
    """The settings of a run that trade accuracy for speed."""

    name: str
    youngs_modulus_scale: float
    timestep_fraction: float
    filling_timestep_fraction: float
    speed_factor: float
    skin_m: float


class MediaOfRun(CountOfRun):
    """The particles: their number, and the radii and density that the study asks for."""

    radius_mean_m: float
    radius_std_m: float
    density_kg_m3: float


class BowlOfRun(Part):
    """The bowl: a cylinder about the z axis that stands on z = 0."""

    radius_m: float
    walls: Literal["primitive", "mesh"]


class AssumptionOfRun(Part):
    """A value that the study's source does not give."""

    field: str
    value: JsonValue
    why: str


class Phase(Part):
    """A stretch of the run: the steps after the first one up to the last."""

    name: str
    start_step: int
    end_step: int


class CaseFile(Document):
    """What the case files of all scenes share.

    Attributes
    ----------
    run : str
        The run id, and the name of the run's folder.
    inputs : mapping
        The values that the run depends on, by dotted name; of a process all of the study.
    files : mapping
        SHA-256 of every file that the run starts from, as they were written.
    """

    study: str
    title: str
    scene: str
    run: str
    timestep_s: float
    rayleigh_time_s: float
    versions: Mapping[str, str]
    phases: Sequence[Phase] = ()
    files: Mapping[str, str] = {}


class CaseOfStudy(CaseFile):
    """A run of a study's case.

    Attributes
    ----------
    contact_moduli : mapping
        Of a particle with a ``particle``, the ``bowl`` and the ``workpiece``.
    unsafe_timestep : str or None
        Why a step of the process beyond the stable one is accepted.
    """

    gravity_m_s2: float
    fidelity: FidelityOfRun
    inputs: Mapping[str, JsonValue]
    media: MediaOfRun
    bowl: BowlOfRun
    contact_moduli: Mapping[str, ContactConstants]
    assumptions: Sequence[AssumptionOfRun]
    reference: Reference | None
    unsafe_timestep: str | None = None


class DropTestCase(CaseOfStudy):
    """A drop test: the restitution of the input script, and the factor on every modulus."""

    scene: Literal["drop_test"] = "drop_test"
    restitution: float
    youngs_modulus_scale: float


class SettlingCriterion(Part):
    """When a bed rests: mean kinetic energy of a particle over m g d."""

    energy_ratio: float


class SteadyCriterion(Part):
    """When the bed in a rotating bowl moves steadily.

    From the step `from_step` on, the mean kinetic energy of a particle in the first third differs
    from that in the last third by at most the fraction `energy_drift`.
    """

    from_step: int
    energy_drift: float


class FillingCase(CaseOfStudy):
    """A filling."""

    scene: Literal["filling"] = "filling"
    settled: SettlingCriterion
    limits: RunLimits

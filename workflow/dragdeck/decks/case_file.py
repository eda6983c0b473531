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
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    skin_m: float


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
    """

    radius_mean_m: float
    radius_std_m: float
    density_kg_m3: float


class BowlOfRun(Part):
    """The bowl: a cylinder about the z axis with its floor at z = 0.

    Attributes
    ----------
    radius_m : float
        Inner radius, m.
    walls : str
        ``primitive`` (analytical plane and cylinder) or ``mesh``.
    """

    radius_m: float
    walls: Literal["primitive", "mesh"]


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


class Phase(Part):
    """A phase of the run: the steps after `start_step` up to `end_step`.

    Attributes
    ----------
    name : str
        For a process ``plunge``, ``approach`` or ``drag``.
    start_step, end_step : int
        First and last step.
    """

    name: str
    start_step: int
    end_step: int


class CaseFile(Document):
    """Content that the case files of all scenes share.

    Attributes
    ----------
    run : str
        The run id, and the name of the run's folder.
    inputs : mapping
        The values that the run depends on, by dotted name; of a process all of the study.
    files : mapping
        SHA-256 of every file that the run starts from, as they were written.
    timestep_s, rayleigh_time_s : float
        Time step and Rayleigh time of the smallest particle, s.
    phases : sequence of Phase
        Empty if LIGGGHTS determines the number of steps.
    added_forces : sequence of str
        Models of the script's contact law that add a normal force; Coulomb's limit of friction
        does not follow from the contact force then.
    changed_law : sequence of str
        Commands on contact law, constants and coefficients that come from a template of the study.
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
    added_forces: Sequence[str] = ()
    changed_law: Sequence[str] = ()


class CaseOfStudy(CaseFile):
    """A run of a case of a study.

    Attributes
    ----------
    contact_moduli : mapping
        Of a particle with a ``particle``, the ``bowl`` and the ``workpiece``.
    unsafe_timestep : str or None
        Why a step of the process beyond the stable one is accepted.
    fidelity : FidelityOfRun
        Settings for speed and accuracy.
    assumptions : sequence of AssumptionOfRun
        Values that the source of the study does not report.
    reference : Reference or None
        Published values to compare with.
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
    """A drop test.

    Attributes
    ----------
    restitution : float
        Coefficient of restitution in the input script.
    files : mapping
        SHA-256 of every file from which the run starts.
    inputs : mapping
        Values that the run depends on, by dotted name.
    contact_moduli : mapping
        Contact constants of a particle with ``particle``, ``bowl`` and ``workpiece``.
    """

    scene: Literal["drop_test"] = "drop_test"
    restitution: float


class SettlingCriterion(Part):
    """When a packing counts as settled.

    Attributes
    ----------
    energy_ratio : float
        Largest mean kinetic energy per particle / (m g d).
    highest_m : float
        Largest height of any point of a particle above the floor, m: the rim of the bowl.
    """

    energy_ratio: float
    highest_m: float


class SteadyCriterion(Part):
    """When the packing in a rotating bowl moves steadily.

    From the step `from_step` on, the mean kinetic energy of a particle in the first third differs
    from that in the last third by at most the fraction `energy_drift`.
    """

    from_step: int
    energy_drift: float


class FillingCase(CaseOfStudy):
    """A filling.

    Attributes
    ----------
    settled : SettlingCriterion
        When the packing counts as settled.
    limits : RunLimits
        Limits of energy and speed; beyond them the run is stopped.
    files : mapping
        SHA-256 of every file from which the run starts.
    inputs : mapping
        Values that the run depends on, by dotted name.
    contact_moduli : mapping
        Contact constants of a particle with ``particle``, ``bowl`` and ``workpiece``.
    """

    scene: Literal["filling"] = "filling"
    settled: SettlingCriterion
    limits: RunLimits


class RunInputs(Document):
    """What the runner reads of ``case.json``.

    Attributes
    ----------
    entry_step : int
        At which the run begins.
    marks : sequence of str
        Files of states from which other runs go on.
    settled : SettlingCriterion or None
        Of a run that must end with a bed at rest.
    steady : SteadyCriterion or None
        Of a run with a rotating bowl.
    limits : RunLimits or None
        Of a run that is watched.
    """

    remedy = "write it with: dragdeck step render"

    scene: str
    run: str
    fidelity: RanksOfRun
    media: CountOfRun
    phases: Sequence[Phase] = ()
    entry_step: int = 0
    marks: Sequence[str] = ()
    files: Mapping[str, str]
    settled: SettlingCriterion | None = None
    steady: SteadyCriterion | None = None
    limits: RunLimits | None = None

"""What is known of a run: the documents beside it."""

from collections.abc import Mapping, Sequence
from typing import Literal

from pydantic import Field

from dragdeck.documents import Document, Part

State = Literal["running", "stopped", "failed", "complete"]
CheckCode = Literal[
    "ended",
    "no_engine_error",
    "neighbour_builds",
    "at_rest",
    "steady_bed",
    "stable_timestep",
    "particles_kept",
    "finite_numbers",
    "within_limits",
    "output_complete",
    "packing_whole",
    "packing_in_bowl",
    "ranks",
]
CheckReason = Literal["lost_particles", "other", "particles", "finite_numbers", "energy", "speed"]


_SMALLER_STEP = "choose a smaller timestep_fraction or a larger youngs_modulus_scale"
REMEDIES: Mapping[CheckCode, str] = {
    "neighbour_builds": "choose a larger fidelity.skin_m",
    "at_rest": "choose a larger filling.max_time_s or filling.energy_ratio",
    "packing_in_bowl": "use fewer particles, or a wider or higher bowl",
    "steady_bed": "choose a longer motion.transient_m, or more motion.path.revolutions",
    "particles_kept": _SMALLER_STEP,
    "finite_numbers": _SMALLER_STEP,
    "stable_timestep": _SMALLER_STEP,
    "within_limits": _SMALLER_STEP,
    "output_complete": "start the run again with: dragdeck run --again",
    "ranks": "use the mpirun that belongs to this LIGGGHTS (DRAGDECK_LAUNCHER)",
}
"""What to do where a check did not pass; of others, the end of the screen output says it."""


class ParticlesPerRank(Part):
    """Number of particles per MPI rank.

    Attributes
    ----------
    mean, most, least : float
        Mean, largest and smallest number.
    """

    mean: float
    most: int
    least: int


class Decomposition(Part):
    """The decomposition of the simulation box among MPI ranks.

    Attributes
    ----------
    grid : (int, int, int)
        Ranks along x, y and z.
    particles : ParticlesPerRank or None
        At the end of the last ``run`` command; None before one has ended.
    """

    grid: tuple[int, int, int]
    particles: ParticlesPerRank | None


class AcceptanceCheck(Part):
    """A condition that a run must meet to count as a result.

    Attributes
    ----------
    code : str
        Identifier of the check.
    reason : str, optional
        Reason why the check did not pass, if a code has several.
    name, seen, limit : str
        In words: the condition, the observed value, and the limit.
    number : float or None
        Observed value, if it is a single number.
    remedy : str, optional
        Remedy if the check did not pass.
    passed : bool
        Whether the condition is met.
    """

    code: CheckCode
    reason: CheckReason | None = None
    name: str
    passed: bool
    seen: str
    limit: str
    number: float | None = None
    remedy: str | None = None


class RunPart(Part):
    """A part of a run: from its start or a checkpoint to its end or the next interruption.

    Attributes
    ----------
    gap : int or None
        First step that is missing in an output of a finished part.
    part : int
        Number, from 1.
    from : str or None
        Checkpoint from which it resumed; None for the start of the run.
    from_step, to_step : int
        First and last step.
    wall_time_s, cpu_time_s : float
        Wall-clock time, and CPU time of all ranks, s.
    exit_status : int or None
        Exit status of LIGGGHTS; None if it was stopped.
    """

    part: int
    checkpoint: str | None = Field(alias="from")
    from_step: int
    wall_time_s: float | None = None
    cpu_time_s: float | None = None
    exit_status: int | None = None
    to_step: int | None = None
    gap: int | None = None


class RunRecord(Document):
    """The state of a run, or how it ended: ``state.json``, ``run.json`` and ``outcome.json``.

    Steps, times and checks are those of a run that has ended.

    Attributes
    ----------
    inputs : str
        Hash of all that the run depends on.
    started : str
        Date and time of the first start.
    steps_per_s : float or None
        Of all parts; None for a run too short to measure it.
    stopped_early : bool
        Whether it was stopped because it passed a limit.
    state : str
        ``running``, ``stopped``, ``failed`` or ``complete``.
    engine_version : str
        Version of LIGGGHTS.
    ranks : int
        MPI ranks.
    parts : sequence of RunPart
        Parts of the run in order.
    checks : sequence of AcceptanceCheck
        Acceptance checks; empty before the end.
    decomposition : Decomposition or None
        Particles per MPI rank.
    steps : int
        Steps of all parts.
    wall_time_s, cpu_time_s : float
        Wall-clock time, and CPU time of all ranks, of all parts, s.
    """

    remedy = "delete it: the run then starts again, and its files are moved to archive/"

    state: State
    inputs: str
    started: str
    engine_version: str
    ranks: int
    parts: Sequence[RunPart] = ()
    checks: Sequence[AcceptanceCheck] = ()
    decomposition: Decomposition | None = None
    steps: int = 0
    steps_per_s: float | None = None
    wall_time_s: float = 0.0
    cpu_time_s: float = 0.0
    stopped_early: bool = False

    @property
    def last_part(self) -> RunPart:
        """The part that runs or ran last."""
        return self.parts[-1]

"""What the runner reads of ``case.json``, and what it writes: ``run.json`` and its like."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from dragdeck.documents import Document
from dragdeck.errors import RejectedRunError
from dragdeck.files import table_rows
from dragdeck.parts import Part, omitted
from dragdeck.physics.run_limits import RunLimits


class RanksOfRun(Part):
    """MPI ranks of a run."""

    ranks: int


class CountOfRun(Part):
    """Particles of a run, and the spheres of which they consist if they are clumps."""

    count: int
    spheres: int = omitted(0)

    @property
    def n_spheres(self) -> int:
        """Number of LIGGGHTS's particles."""
        return self.spheres or self.count


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


class SettlingCriterion(Part):
    """When a packing counts as settled.

    Attributes
    ----------
    energy_ratio : float
        Largest mean kinetic energy per particle / (m g d).
    highest_m : float
        Largest height of any point of a particle above the floor, m: the rim of the bowl.
    """

    energy_ratio: PositiveFloat
    highest_m: float


class SteadyCriterion(Part):
    """When the packing in a rotating bowl moves steadily.

    From the step `from_step` on, the mean kinetic energy of a particle in the first third differs
    from that in the last third by at most the fraction `energy_drift`.
    """

    from_step: int
    energy_drift: float


class CaseFile(Document):
    """What the engine's runner reads, and the case files of all scenes share.

    Attributes
    ----------
    study_name : str
        Name of the study.
    run : str
        The run id, and the name of the run's folder.
    files : mapping
        SHA-256 of every file that the run starts from, as they were written.
    timestep_s, rayleigh_time_s : float
        Time step and Rayleigh time of the smallest particle, s.
    phases : tuple of Phase
        Plunge, approach and drag; empty if LIGGGHTS determines the number of steps.
    added_forces : tuple of str
        Models of the script's contact law that add a normal force, such as cohesion; Coulomb's
        limit of friction does not follow from the contact force then.
    changed_law : tuple of str
        Commands on contact law, constants and coefficients that come from a template.
    changed_scripts : tuple of str
        Templates that change commands of the script, with their blocks; absent if there are none.
    script_findings : tuple of str
        What rules say of a script that templates change; absent if they say nothing.
    entry_step : int
        Step of the drag at which it continues its lead; absent if it has none.
    marks : tuple of str
        Files of states from which other runs continue; absent if there are none.
    settled : SettlingCriterion or None
        Of a run that must end with a bed at rest; otherwise absent.
    steady : SteadyCriterion or None
        Criterion for a steadily moving bed; absent if the bowl is at rest.
    limits : RunLimits or None
        Limits of energy and speed; beyond them the run is stopped. Absent if it is not watched.
    thrown_m_s : float or None
        Speed of a particle that was thrown, m/s; absent if the speeds are not sampled, or if
        particles may be squeezed out between workpiece and bowl.
    """

    remedy = "give the folder of a run, or write it with: ./run dragdeck step render"

    study_name: str
    title: str
    scene: str
    run: str
    timestep_s: PositiveFloat
    rayleigh_time_s: PositiveFloat
    versions: Mapping[str, str]
    fidelity: RanksOfRun
    media: CountOfRun
    phases: tuple[Phase, ...] = ()
    files: Mapping[str, str] = {}
    added_forces: tuple[str, ...] = ()
    changed_law: tuple[str, ...] = ()
    changed_scripts: tuple[str, ...] = omitted(())
    script_findings: tuple[str, ...] = omitted(())
    entry_step: int = omitted(0)
    marks: tuple[str, ...] = omitted(())
    settled: SettlingCriterion | None = omitted(None)
    steady: SteadyCriterion | None = omitted(None)
    limits: RunLimits | None = omitted(None)
    thrown_m_s: PositiveFloat | None = omitted(None)

    @model_validator(mode="after")
    def _joined(self) -> Self:
        for before, after in pairwise(self.phases):
            assert before.end_step == after.start_step, (
                f"phases: {after.name} does not start where {before.name} ends"
            )
        return self


def changed_in_words(scripts: Sequence[str]) -> str:
    """What templates change in input scripts, in one line; empty where nothing."""
    return f"input scripts changed by templates: {'; '.join(scripts)}" if scripts else ""


State = Literal["running", "stopped", "failed", "complete"]


CHECKS = {row["code"]: row for row in table_rows(Path(__file__).with_name("checks.csv"))}
"""The registry of acceptance checks by code: the name of each, and what to do where it did not
pass; of some, its words or the screen output say it."""


if TYPE_CHECKING:
    CheckCode = str
else:
    CheckCode = Literal[tuple(CHECKS)]


CheckReason = Literal["lost_particles", "other", "particles", "finite_numbers", "energy", "speed"]


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

    @classmethod
    def of(
        cls,
        code: CheckCode,
        passed: bool,
        seen: str,
        limit: str,
        reason: CheckReason | None = None,
        number: float | None = None,
        output: str = "",
    ) -> Self:
        """A check with its name from the registry; `output` is that which it is about."""
        return cls(
            code=code,
            reason=None if passed else reason,
            name=CHECKS[code]["name"].format(output),
            passed=passed,
            seen=seen,
            limit=limit,
            number=number if number is not None and math.isfinite(number) else None,
        )


def causes(checks: Sequence[AcceptanceCheck]) -> Sequence[AcceptanceCheck]:
    """The checks that did not pass; where LIGGGHTS stopped with an error, that one alone."""
    failed = [check for check in checks if not check.passed]
    stopped = [
        check for check in failed if check.code == "no_engine_error" and check.reason == "other"
    ]
    return stopped or failed


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

    @property
    def last_step(self) -> int:
        """The last step that the run is known to have made."""
        return (self.last_part.to_step or 0) if self.parts else 0

    @property
    def complete(self) -> bool:
        """Whether the run came to its end and passed every acceptance check."""
        return self.state == "complete"

    @property
    def failed_checks(self) -> tuple[AcceptanceCheck, ...]:
        """The acceptance checks that did not pass."""
        return tuple(check for check in self.checks if not check.passed)

    @property
    def processor_time_s(self) -> float:
        """Processor time of all ranks; the wall time on every rank where it is not known."""
        return self.cpu_time_s or self.wall_time_s * self.ranks


def refusal(record: RunRecord) -> str | None:
    """Why a run with this ``run.json`` does not count; None if it does."""
    if not record.complete:
        return f"its state is {record.state!r}, not 'complete'"
    if not record.checks:
        return (
            "run.json lists no acceptance checks, so nothing says that its outputs can be trusted"
        )
    failed = [
        f"{check.name} (saw {check.seen}, limit {check.limit})" for check in record.failed_checks
    ]
    return f"acceptance checks failed: {'; '.join(failed)}" if failed else None


def read_accepted(run_dir: Path) -> RunRecord:
    """The ``run.json`` of a run that counts.

    Raises
    ------
    RejectedRunError
        There is no ``run.json``, or it says that the run did not end or that an acceptance check
        did not pass.
    DocumentError
        ``run.json`` cannot be used.
    """
    file = run_dir / "run.json"
    if not file.is_file():
        raise RejectedRunError(
            f"{file}: the file is missing, so the run is not known to be complete"
        )
    record = RunRecord.read(file)
    if (reason := refusal(record)) is not None:
        raise RejectedRunError(f"{run_dir} cannot be used: {reason}")
    return record

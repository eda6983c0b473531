"""How a run ended, and whether it counts as a result: ``run.json`` and its like."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from dragdeck.documents import Document, Part
from dragdeck.errors import RejectedRunError

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


class AcceptanceCheck(Part):
    """A condition that a run must meet to count as a result.

    Attributes
    ----------
    code : str
        What is checked.
    reason : str or None
        Why the check did not pass, where a code has several reasons.
    name, seen, limit : str
        For readers: the condition, what was seen, and what it asks for.
    number : float or None
        What was seen, where it is one number.
    remedy : str or None
        What to do where the check did not pass.
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
    """A part of a run: from its start or a checkpoint to its end or the next interruption."""

    part: int
    checkpoint: str | None = Field(alias="from")
    from_step: int
    to_step: int | None = None
    wall_time_s: float | None = None
    cpu_time_s: float | None = None
    exit_status: int | None = None


class RunRecord(Document):
    """How far a run is, or how it ended: ``state.json``, ``run.json`` and ``outcome.json``.

    Attributes
    ----------
    started : str
        Date and time of the first start.
    steps : int
        Of a run that has ended.
    steps_per_s : float or None
        Of all parts; None for a run too short to measure it.
    wall_time_s, cpu_time_s : float
        Of all parts; processor time is 0 where the machine does not tell it.
    """

    remedy = "make it with: dragdeck run"

    state: State
    started: str
    engine_version: str
    ranks: int
    parts: tuple[RunPart, ...] = ()
    checks: tuple[AcceptanceCheck, ...] = ()
    steps: int = 0
    steps_per_s: float | None = None
    wall_time_s: float = 0.0
    cpu_time_s: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether the run came to its end and passed every acceptance check."""
        return self.state == "complete"

    @property
    def failed_checks(self) -> tuple[AcceptanceCheck, ...]:
        """The acceptance checks that did not pass."""
        return tuple(check for check in self.checks if not check.passed)

    @property
    def last_step(self) -> int:
        """The last step that the run is known to have made."""
        return (self.parts[-1].to_step or 0) if self.parts else 0

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

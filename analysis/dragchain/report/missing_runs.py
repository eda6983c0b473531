"""Runs without a result, and why."""

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from dragdeck.errors import DragdeckError
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord, causes

_STEPS = ("render", "share", "run", "tabulate", "find_chains", "map_loading", "draw")
"""The steps of a run that have a log, in order: the first that failed is to blame."""

_LOG_BYTES = 20_000
_SAID = re.compile(r"^(?:dragdeck|dragchain): (.*)", re.MULTILINE | re.DOTALL)

_READ_SCREEN = "read the end of its last screen.*.txt"


@dataclass(frozen=True)
class MissingRun:
    """A run without a result.

    Attributes
    ----------
    scene : str
    name : str
        The case, or the run id where nothing is known of the case.
    folder : Path
    problem, remedy : str
        For readers: what was found, and what to do.
    """

    scene: str
    name: str
    folder: Path
    problem: str
    remedy: str

    def __str__(self) -> str:
        """A paragraph of a message."""
        return f"{self.scene} {self.name}: {self.problem}\n    remedy: {self.remedy}"


def scene_of(run_dir: Path) -> str:
    """The scene of a run by its case, or by the path of its folder where that has none."""
    try:
        return load_case(run_dir).scene
    except DragdeckError:
        return run_dir.resolve().parent.name


def missing_run(run_dir: Path, error: DragdeckError) -> MissingRun:
    """Say why a run has no result.

    Parameters
    ----------
    run_dir : Path
        Its folder, which need not exist.
    error : DragdeckError
        What reading it ended in; it counts only if the run's logs and records say nothing.
    """
    try:
        case = load_case(run_dir)
        name = case.case or case.run
    except DragdeckError:
        name = run_dir.name
    problem, remedy = _reason(run_dir, error)
    return MissingRun(scene_of(run_dir), name, run_dir, problem, remedy)


def _reason(run_dir: Path, error: DragdeckError) -> tuple[str, str]:
    for step in _STEPS:
        if step == "run" and (reason := _of_records(run_dir)):
            return reason
        if reason := _of_log(run_dir / "logs" / f"{step}.log"):
            return reason
    if not (run_dir / "case.json").is_file():
        return "not run, since a run before it has no result", "see that run"
    return _split(str(error))


def _of_records(run_dir: Path) -> tuple[str, str] | None:
    """What is recorded of a run that did not come to its end, or failed a check."""
    for name in ("state.json", "run.json"):
        with suppress(DragdeckError):
            if reason := _of_record(RunRecord.read(run_dir / name)):
                return reason
    return None


def _of_record(record: RunRecord) -> tuple[str, str] | None:
    if record.state in ("running", "stopped"):
        return (
            f"interrupted, or still running; last known step {record.last_step:,}",
            "run the study again: it goes on from the last checkpoint",
        )
    if not (told := causes(record.checks)):
        return None
    first, *others = told
    more = f"; and {len(others)} more" if others else ""
    seen = f"failed check: {first.name}: {first.seen} (limit: {first.limit}){more}"
    return seen, first.remedy or _READ_SCREEN


def _of_log(log: Path) -> tuple[str, str] | None:
    """The message with which a step ended."""
    if not log.is_file():
        return None
    with log.open("rb") as stream:
        stream.seek(max(0, log.stat().st_size - _LOG_BYTES))
        said = _SAID.search(stream.read().decode("utf-8", "replace"))
    return _split(said.group(1)) if said else None


def _split(message: str) -> tuple[str, str]:
    """The problem and the remedy of a message, each in one line."""
    problem, _, remedy = message.partition("remedy:")
    return " ".join(problem.split()), " ".join(remedy.split()) or "see the logs in its folder"

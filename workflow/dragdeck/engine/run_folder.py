"""A run folder from its input script to ``run.json``: start, resume, keep what there was.

``state.json`` says at any time how far the run is. ``run.json`` has the same
content and exists only for a run that is complete and passed every acceptance check, so
that nothing unfinished can be taken for a result.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from dragdeck.decks import CASE_FILE, COLUMNS_FILE, DECK_FILE
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.engine import log
from dragdeck.engine.acceptance import check_run
from dragdeck.engine.checkpoints import (
    checkpoint_files,
    checkpoint_step,
    newest_checkpoint,
    take_forced_restarts,
)
from dragdeck.engine.process import Ending, Engine, command, execute, find_engine
from dragdeck.engine.record import AcceptanceCheck, RunInputs, RunPart, RunRecord
from dragdeck.engine.watch import LimitMet, Report, Watcher, say
from dragdeck.errors import EngineError, InputError, RejectedRunError

STATE_FILE = "state.json"
_RESULT_FILE = "run.json"
_ARCHIVE = "archive"
_AS_RUN = "as_run"


def run(folder: Path, report: Report, *, again: bool = False, every_s: float = 10.0) -> RunRecord:
    """Bring a run folder to its ``run.json``.

    A complete run of the same inputs is left as it is. An interrupted one goes
    on from its last checkpoint. A run of other inputs is moved to ``archive/``
    and started anew. A run that failed is not repeated unless `again`.

    Parameters
    ----------
    folder : Path
        With input script, case.json and columns.json.
    report : callable
        Gets a line about every `every_s` seconds.
    again : bool
        Start anew even if these inputs failed before.

    Returns
    -------
    RunRecord
        The content of ``run.json``.

    Raises
    ------
    InputError
        The folder holds no input script, or files of another version.
    EngineError
        No engine; or it was stopped or killed: the message says how to go on.
    RejectedRunError
        The run ended but an acceptance check did not pass.
    """
    inputs = RunInputs.read(folder / CASE_FILE)
    columns = ColumnsFile.read(folder / COLUMNS_FILE)
    take_forced_restarts(folder)
    digest = fingerprint(folder)
    record = _record(folder)
    if record and (record.inputs != digest or (again and record.state != "complete")):
        _archive(folder, record.inputs, report)
        record = None
    if record and record.state == "complete":
        report("these inputs were run before and the run is complete")
    elif record and record.state == "failed":
        raise RejectedRunError(
            _failed(folder, record) + "\n  remedy: change the study, or run it --again"
        )
    else:
        engine = find_engine()
        if record is None:
            _keep_inputs(folder)
        record = _begin_part(folder, record, digest, engine, inputs.fidelity.ranks)
        record = _Part(folder, inputs, columns, record, report).execute(engine, every_s)
    record.write(folder / _RESULT_FILE)
    return record


def run_to_outcome(folder: Path, file: Path, report: Report, *, every_s: float = 10.0) -> None:
    """Bring a run to its end, good or bad, and write how it ended to a file.

    For studies of where runs fail: a run that an acceptance check or a limit stopped has an
    outcome too. One that was interrupted has none yet.

    Raises
    ------
    InputError, EngineError
        As `run` does.
    """
    try:
        run(folder, report, every_s=every_s)
    except RejectedRunError as error:
        report(str(error))
    RunRecord.read(folder / STATE_FILE).write(file)


def run_command(folder: Path, outcome: Path | None, again: bool, every_s: float) -> None:
    """Run the input script in a folder, or resume it."""
    if outcome is not None:
        run_to_outcome(folder, outcome, say, every_s=every_s)
    else:
        run(folder, say, again=again, every_s=every_s)


def fingerprint(folder: Path) -> str:
    """Hash of all that a run depends on: deck, data, meshes and the file it starts from.

    Comments in the deck do not count.

    Raises
    ------
    InputError
        The deck, or the file it starts from, is missing.
    """
    deck = folder / DECK_FILE
    if not deck.is_file():
        raise InputError(
            "no input script here", file=folder, remedy="write it with: dragdeck step render"
        )
    text = deck.read_text(encoding="utf-8")
    files = {*folder.glob("*.data"), *folder.glob("*.stl")}
    source = re.search(r"^variable from index (\S+)", text, flags=re.MULTILINE)
    if source is not None:
        files.add(folder / source.group(1))
    commands = [line for line in text.splitlines() if line and not line.startswith("#")]
    total = hashlib.sha256("\n".join(commands).encode())
    for file in sorted(files):
        if not file.is_file():
            raise InputError(
                "a file that the deck starts from is missing",
                file=file,
                remedy="run the scene that makes it first",
            )
        total.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()


def _record(folder: Path) -> RunRecord | None:
    """What is known of the run in a folder; None before its first start."""
    file = folder / STATE_FILE
    return RunRecord.read(file) if file.is_file() else None


def _begin_part(
    folder: Path, record: RunRecord | None, inputs: str, engine: Engine, ranks: int
) -> RunRecord:
    """Note that a part begins, before it does."""
    newest = newest_checkpoint(folder)
    parts = record.parts if record else []
    part = RunPart(
        part=len(parts) + 1,
        checkpoint=newest.name if newest else None,
        from_step=checkpoint_step(newest) if newest else 0,
    )
    record = RunRecord(
        state="running",
        inputs=inputs,
        started=record.started if record else datetime.now(UTC).isoformat(timespec="seconds"),
        engine_version=engine.version,
        ranks=ranks,
        parts=[*parts, part],
    )
    record.write(folder / STATE_FILE)
    return record


@dataclass
class _Part:
    """A part of a run: LIGGGHTS is started, watched, and its output checked."""

    folder: Path
    inputs: RunInputs
    columns: ColumnsFile
    record: RunRecord
    report: Report

    @property
    def screen(self) -> Path:
        return self.folder / f"screen.{self.record.last_part.part}.txt"

    def execute(self, engine: Engine, every_s: float) -> RunRecord:
        """Run LIGGGHTS to its end; whatever happens, ``state.json`` says so."""
        part, ranks = self.record.last_part, self.record.ranks
        source = self.folder / part.checkpoint if part.checkpoint else None
        words = command(engine, DECK_FILE, ranks, part.part, source)
        self.report(
            f"{self.inputs.scene} {self.inputs.run}: part {part.part}, {ranks} "
            f"rank{'s' if ranks > 1 else ''}"
        )
        watcher, begun = self._watcher(every_s), time.monotonic()
        try:
            ending = execute(words, self.folder, self.screen, watcher)
        except LimitMet as met:
            self._end_part(time.monotonic() - begun)
            self.record = self.record.model_copy(update={"stopped_early": True})
            return self._judge([met.check])
        self._end_part(ending.wall_time_s, ending)
        return self._conclude(ending)

    def _watcher(self, every_s: float) -> Watcher:
        part, output = self.record.last_part, self.columns.outputs.get("thermo")
        return Watcher(
            thermo=self.folder / output.pattern.format(part=part.part) if output else None,
            columns=output.columns if output else [],
            first=part.from_step,
            last=self.inputs.phases[-1].end_step if self.inputs.phases else None,
            limits=self.inputs.limits,
            report=self.report,
            every_s=every_s,
        )

    def _end_part(self, wall_time_s: float, ending: Ending | None = None) -> None:
        """Note how the part ended, and what all parts did together."""
        ended = {
            "wall_time_s": round(wall_time_s, 3),
            "to_step": log.last_step(self.screen.read_text(errors="replace")),
        }
        if ending is not None:
            ended["cpu_time_s"] = round(ending.cpu_time_s, 3)
            ended["exit_status"] = ending.exit_status
        parts = [*self.record.parts[:-1], self.record.last_part.model_copy(update=ended)]
        wall_s = sum(part.wall_time_s or 0.0 for part in parts)
        done = sum(max(0, part.to_step - part.from_step) for part in parts if part.to_step)
        totals = {
            "parts": parts,
            "steps": parts[-1].to_step or 0,
            "wall_time_s": round(wall_s, 3),
            "cpu_time_s": round(sum(part.cpu_time_s or 0.0 for part in parts), 3),
            "steps_per_s": round(done / wall_s, 1) if wall_s > 0 else None,
        }
        self.record = self.record.model_copy(update=totals)

    def _conclude(self, ending: Ending) -> RunRecord:
        screen = self.screen.read_text(errors="replace")
        killed = ending.exit_status < 0 or ending.exit_status >= 128
        asked = take_forced_restarts(self.folder) or ending.asked
        if not log.reached_end(screen) and (asked or (killed and not log.engine_errors(screen))):
            self._save(state="stopped")
            raise EngineError(_stopped(self.folder, asked, ending.exit_status))
        self.record = self.record.model_copy(update={"decomposition": log.decomposition(screen)})
        checks = check_run(
            self.folder,
            self.inputs,
            self.columns.outputs,
            ending.exit_status,
            self.record.last_part.part,
            self.record.ranks,
        )
        self._judge(checks)
        for checkpoint in checkpoint_files(self.folder):
            checkpoint.unlink()
        steps, wall_s = self.record.steps, self.record.wall_time_s
        self.report(f"complete: {steps:,} steps in {wall_s:.1f} s")
        return self.record

    def _judge(self, checks: list[AcceptanceCheck]) -> RunRecord:
        """Note the checks, and that the run is complete or failed."""
        passed = all(check.passed for check in checks)
        self._save(state="complete" if passed else "failed", checks=checks)
        if not passed:
            raise RejectedRunError(_failed(self.folder, self.record))
        return self.record

    def _save(self, **update: object) -> None:
        self.record = self.record.model_copy(update=update)
        self.record.write(self.folder / STATE_FILE)


def _stopped(folder: Path, asked: bool, exit_status: int) -> str:
    newest = newest_checkpoint(folder)
    why = "stopped as asked" if asked else f"the engine was killed (exit status {exit_status})"
    if newest is None:
        return f"{folder}: {why}\n  remedy: there is no checkpoint yet; run it again from its start"
    return (
        f"{folder}: {why}\n  value:  checkpoint at step {checkpoint_step(newest):,}\n"
        "  remedy: run it again, and it goes on from there"
    )


def _failed(folder: Path, record: RunRecord) -> str:
    lines = [f"{folder}: run rejected: it did not pass the acceptance checks listed below"]
    for check in record.checks:
        if not check.passed:
            lines.append(f"  check:  {check.name}: {check.seen} (limit: {check.limit})")
    lines.append(f"  log:    {folder / f'screen.{record.last_part.part}.txt'}")
    return "\n".join(lines)


def _keep_inputs(folder: Path) -> None:
    """Keep the deck as it was run: a later render may replace it."""
    kept = folder / _AS_RUN
    kept.mkdir(exist_ok=True)
    for name in (DECK_FILE, CASE_FILE, COLUMNS_FILE):
        shutil.copy2(folder / name, kept / name)


def _archive(folder: Path, inputs: str, report: Report) -> None:
    """Move what a run of other inputs left out of the way; delete nothing."""
    place = folder / _ARCHIVE / inputs[:8]
    number = 1
    while place.exists():
        number += 1
        place = folder / _ARCHIVE / f"{inputs[:8]}-{number}"
    place.mkdir(parents=True)
    new = {DECK_FILE, CASE_FILE, COLUMNS_FILE, _ARCHIVE}
    sources = {file.name for file in (*folder.glob("*.data"), *folder.glob("*.stl"))}
    for file in folder.iterdir():
        if file.name not in new | sources:
            shutil.move(str(file), str(place / file.name))
    report(f"an earlier run of other inputs was moved to {place}")

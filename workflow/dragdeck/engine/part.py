"""A part of a run: LIGGGHTS from its start or a checkpoint to an end, good or bad."""

import re
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from signal import SIGKILL

from dragdeck.decks import DECK_FILE
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.engine import checkpoints, log
from dragdeck.engine.acceptance import check_run
from dragdeck.engine.completeness import cut_outputs, first_gap, part_files
from dragdeck.engine.process import Ending, Engine, command, execute, keeps_last_words, last_words
from dragdeck.engine.reports import Report
from dragdeck.engine.space import SPARE_BYTES, check_space, free_bytes, space_left
from dragdeck.engine.watch import EngineEnded, LimitMet, Watcher, cut_screen
from dragdeck.errors import EngineError, RejectedRunError
from dragdeck.records.run import (
    CHECKS,
    AcceptanceCheck,
    CaseFile,
    CheckCode,
    RunPart,
    RunRecord,
    causes,
)

STATE_FILE = "state.json"
_UNWRITTEN = re.compile("Cannot open (?!mesh|data|clump|file variable)")
"""What LIGGGHTS says of a file that it cannot write; of some that it reads it says the same."""

_WRITTEN: set[CheckCode] = {"output_complete", "packing_whole"}
"""Checks that a full disk alone can fail."""


@dataclass
class PartOfRun:
    """The next part of a run, and the record of all.

    Attributes
    ----------
    folder : Path
    inputs : CaseFile
    columns : ColumnsFile
    record : RunRecord or None
        Of the parts before; None for a first start.
    report : callable
    """

    folder: Path
    inputs: CaseFile
    columns: ColumnsFile
    record: RunRecord | None
    report: Report

    def execute(self, digest: str, engine: Engine, patience_s: float) -> RunRecord:
        """Run LIGGGHTS to its end; whatever happens, ``state.json`` says so.

        Raises
        ------
        EngineError
            It was ended, or an output has a hole: says how to go on.
        RejectedRunError
            An acceptance check did not pass.
        """
        self._begin(digest, engine)
        part, ranks = self._record.last_part, self._record.ranks
        source = self.folder / part.checkpoint if part.checkpoint else None
        words = command(engine, DECK_FILE, ranks, part.part, source)
        self.report(
            f"{self.inputs.scene} {self.inputs.run}: part {part.part}, {ranks} "
            f"rank{'s' if ranks > 1 else ''}"
        )
        watcher, begun = self._watcher(patience_s), time.monotonic()
        try:
            ending = execute(words, self.folder, self._screen, watcher)
        except LimitMet as met:
            self._end(time.monotonic() - begun)
            self._update(stopped_early=True)
            return self._judge([met.check])
        except EngineEnded as ended:
            cut_screen(self._screen)
            self._end(time.monotonic() - begun)
            raise self._stopped(ended.why, f"{ended.remedy}; then ") from None
        self._end(ending.wall_time_s, ending)
        return self._conclude(ending)

    @property
    def _record(self) -> RunRecord:
        assert self.record is not None
        return self.record

    @property
    def _screen(self) -> Path:
        return self.folder / f"screen.{self._record.last_part.part}.txt"

    def _begin(self, digest: str, engine: Engine) -> None:
        """Note that a part begins, before it does."""
        outputs, record = self.columns.outputs, self.record
        parts = record.parts if record else []
        count, ranks = self.inputs.media.n_spheres, self.inputs.fidelity.ranks
        check_space(self.folder, outputs, count)
        gap = first_gap(self.folder, outputs, parts) if parts else -1
        newest = checkpoints.newest_checkpoint(self.folder, count, ranks, gap, self.report)
        first = checkpoints.checkpoint_step(newest) if newest else self.inputs.entry_step
        for damage in cut_outputs(self.folder, outputs, parts, first if newest else -1):
            self.report(f"{damage}; the run writes it again from step {first:,}")
        checkpoint = newest.name if newest else None
        part = RunPart(part=len(parts) + 1, checkpoint=checkpoint, from_step=first)
        self.record = RunRecord(
            state="running",
            inputs=digest,
            started=record.started if record else datetime.now(UTC).isoformat(timespec="seconds"),
            engine_version=engine.version,
            ranks=ranks,
            parts=[*parts, part],
        )
        self._update()

    def _watcher(self, patience_s: float) -> Watcher:
        part, thermo = self._record.last_part, self.columns.outputs.get("thermo")
        return Watcher(
            folder=self.folder,
            screen=self._screen,
            files=part_files(self.folder, self.columns.outputs, [part]),
            thermo=self.folder / thermo.pattern.format(part=part.part) if thermo else None,
            columns=thermo.columns if thermo else [],
            first=part.from_step,
            last=self.inputs.phases[-1].end_step if self.inputs.phases else None,
            particles=self.inputs.media.n_spheres,
            ranks=self._record.ranks,
            limits=self.inputs.limits,
            patience_s=patience_s,
        )

    def _end(self, wall_time_s: float, ending: Ending | None = None) -> None:
        """Note how the part ended, and what all parts did together."""
        ended = {
            "wall_time_s": round(wall_time_s, 3),
            "to_step": log.last_step(self._screen.read_text(errors="replace")),
        }
        if ending is not None:
            ended["cpu_time_s"] = round(ending.cpu_time_s, 3)
            ended["exit_status"] = ending.exit_status
        parts = [*self._record.parts[:-1], self._record.last_part.model_copy(update=ended)]
        wall_s = sum(part.wall_time_s or 0.0 for part in parts)
        done = sum(max(0, part.to_step - part.from_step) for part in parts if part.to_step)
        self.record = self._record.model_copy(
            update={
                "parts": parts,
                "steps": max(0, (parts[-1].to_step or 0) - self.inputs.entry_step),
                "wall_time_s": round(wall_s, 3),
                "cpu_time_s": round(sum(part.cpu_time_s or 0.0 for part in parts), 3),
                "steps_per_s": round(done / wall_s, 1) if wall_s > 0 else None,
            }
        )

    def _conclude(self, ending: Ending) -> RunRecord:
        screen = self._screen.read_text(errors="replace")
        asked = checkpoints.take_forced_restarts(self.folder) or ending.asked
        whole = log.reached_end(screen) and ending.signal != SIGKILL
        why = None if whole else self._interruption(screen, asked, ending)
        if why is not None:
            raise self._stopped(why)
        self.record = self._record.model_copy(update={"decomposition": log.decomposition(screen)})
        checks = check_run(
            self.folder,
            self.inputs,
            self.columns.outputs,
            ending.exit_status,
            self._record.parts,
            self._record.ranks,
        )
        self._refuse_new_gap(checks)
        self._judge(checks)
        for checkpoint in checkpoints.checkpoint_files(self.folder):
            checkpoint.unlink()
        steps, wall_s = self._record.steps, self._record.wall_time_s
        self.report(f"complete: {steps:,} steps in {wall_s:.1f} s")
        return self._record

    def _interruption(self, screen: str, asked: bool, ending: Ending) -> str | None:
        """Why an engine that did not reach its end can go on; None where its input is at fault."""
        errors = log.engine_errors(screen)
        if asked:
            return "stopped on request"
        full = free_bytes(self.folder) < SPARE_BYTES
        if full or any(_UNWRITTEN.search(error) for error in errors):
            said = "; ".join(errors) or "no message of LIGGGHTS"
            left = space_left(self.folder, self.columns.outputs, self.inputs.media.n_spheres)
            return f"the disk is full, or a file cannot be written ({said}); {left}"
        if errors or log.never_settled(screen):
            return None
        killed = ending.signal is not None
        how = "was killed" if killed else "ended prematurely without a message"
        if not killed and not keeps_last_words():
            how += ": stdbuf of GNU coreutils, which would have kept it, is missing"
        if ending.exit_status == 0:  # a signal between two runs of a script leaves no other trace
            how = "was stopped on request, or its script ends early"
        said = "" if killed else f"; the last lines: {last_words(screen) or 'none'}"
        return f"LIGGGHTS {how} (exit status {ending.exit_status}){said}"

    def _refuse_new_gap(self, checks: list[AcceptanceCheck]) -> None:
        """A hole in what was written may come from a full disk: it is written again, but once."""
        failed = {check.code for check in checks if not check.passed}
        parts = self._record.parts
        full = free_bytes(self.folder) < SPARE_BYTES
        tried = len(parts) > 1 and parts[-2].gap is not None
        if not failed or failed - _WRITTEN or (tried and not full):
            return
        missing = first_gap(self.folder, self.columns.outputs, parts)
        gap = min(missing, parts[-1].to_step or 0)
        ended = parts[-1].model_copy(update={"gap": int(gap)})
        self.record = self._record.model_copy(update={"parts": [*parts[:-1], ended]})
        seen = "; ".join(check.seen for check in checks if not check.passed)
        raise self._stopped(seen, "make sure that the disk has space; then ")

    def _judge(self, checks: list[AcceptanceCheck]) -> RunRecord:
        """Note the checks, and that the run is complete or failed."""
        passed, told = all(check.passed for check in checks), causes(checks)
        checks = [
            check.model_copy(update={"remedy": CHECKS[check.code]["remedy"] or None})
            if check in told
            else check
            for check in checks
        ]
        self._update(state="complete" if passed else "failed", checks=checks)
        if not passed:
            raise RejectedRunError(why_rejected(self.folder, self._record))
        return self._record

    def _update(self, **changes: object) -> None:
        self.record = self._record.model_copy(update=changes)
        self.record.write(self.folder / STATE_FILE)

    def _stopped(self, why: str, first: str = "") -> EngineError:
        """Note that the run was stopped; the error says how to go on."""
        self._update(state="stopped")
        count, ranks = self.inputs.media.n_spheres, self._record.ranks
        parts = self._record.parts
        gap = first_gap(self.folder, self.columns.outputs, parts)
        newest = checkpoints.newest_checkpoint(self.folder, count, ranks, gap, self.report)
        lines = [f"{self.folder}: {why}", f"  log:    {self._screen}"]
        if newest is None:
            lines.append(f"  remedy: {first}run it again from its start: no usable checkpoint")
        else:
            lines.append(f"  value:  checkpoint at step {checkpoints.checkpoint_step(newest):,}")
            lines.append(f"  remedy: {first}run it again; it resumes from there")
        return EngineError("\n".join(lines))


def why_rejected(folder: Path, record: RunRecord) -> str:
    """The acceptance checks that a run did not pass, for a reader."""
    lines = [f"{folder}: run rejected: it did not pass the acceptance checks listed below"]
    for check in causes(record.checks):
        lines.append(f"  check:  {check.name}: {check.seen} (limit: {check.limit})")
        lines += [f"  remedy: {check.remedy}"] if check.remedy else []
    lines.append(f"  log:    {folder / f'screen.{record.last_part.part}.txt'}")
    return "\n".join(lines)

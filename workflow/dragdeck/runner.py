"""A run folder from its deck to ``run.json``: start, go on, keep what there was.

``state.json`` says at any time how far the run is. ``run.json`` has the same
content and exists only for a run that is complete and passed every gate, so
that nothing unfinished can be taken for a result.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dragdeck.engine import Engine, command, engine_errors, execute, find_engine
from dragdeck.errors import EngineError, GateError, InputError
from dragdeck.gates import Gate, check_run, split_gate
from dragdeck.limits import breach, held, read_samples
from dragdeck.ranks import decomposition
from dragdeck.render import CASE_FILE, COLUMNS_FILE, DECK_FILE, replace_text

STATE_FILE = "state.json"
RESULT_FILE = "run.json"
ARCHIVE = "archive"
AS_RUN = "as_run"
CHECKPOINTS_KEPT = 2

Report = Callable[[str], None]


@dataclass(frozen=True)
class Progress:
    """Where a running engine is."""

    step: int
    steps: int | None
    steps_per_s: float

    def __str__(self) -> str:
        speed = f"{self.steps_per_s:,.0f} steps/s"
        if not self.steps or not self.steps_per_s:
            return f"step {self.step:,}, {speed}"
        left = (self.steps - self.step) / self.steps_per_s
        share = 100 * self.step / self.steps
        return (
            f"step {self.step:,} of {self.steps:,} ({share:.0f} %), {speed}, "
            f"{left // 60:.0f} min {left % 60:02.0f} s left"
        )


def run(folder: Path, report: Report, *, again: bool = False, every_s: float = 10.0) -> Path:
    """Bring a run folder to its ``run.json``.

    A complete run of the same inputs is left as it is. An interrupted one goes
    on from its last checkpoint. A run of other inputs is moved to ``archive/``
    and started anew. A run that failed is not repeated unless `again`.

    Parameters
    ----------
    folder : Path
        With deck, case.json and columns.json.
    report : callable
        Gets a line about every `every_s` seconds.
    again : bool
        Start anew even if these inputs failed before.

    Returns
    -------
    Path
        The ``run.json``.

    Raises
    ------
    InputError
        The folder holds no deck.
    EngineError
        No engine; or it was stopped or killed: the message says how to go on.
    GateError
        The run ended but a gate did not hold.
    """
    case, columns = _read(folder, CASE_FILE), _read(folder, COLUMNS_FILE)
    _take_forced_restarts(folder)
    inputs = fingerprint(folder)
    state = _state(folder)
    if state and (state["inputs"] != inputs or (again and state["state"] != "complete")):
        _archive(folder, state["inputs"], report)
        state = None
    if state and state["state"] == "complete":
        report("these inputs were run before and the run is complete")
        return _write_result(folder, state)
    if state and state["state"] == "failed":
        raise GateError(_failed(folder, state) + "\n  remedy: change the study, or run it --again")
    engine = find_engine()
    state = _begin_part(folder, state, inputs, engine, case["fidelity"]["ranks"], case["scene"])
    state = _execute_part(folder, state, engine, case, columns, report, every_s)
    return _write_result(folder, state)


def outcome(folder: Path, file: Path, report: Report, *, every_s: float = 10.0) -> None:
    """Bring a run to its end, good or bad, and write how it ended to a file.

    For studies of where runs fail: a run that a gate or a limit stopped has an
    outcome too. One that was interrupted has none yet.

    Raises
    ------
    InputError, EngineError
        As `run` does.
    """
    try:
        run(folder, report, every_s=every_s)
    except GateError as error:
        report(str(error))
    state = _state(folder)
    assert state is not None
    replace_text(file, json.dumps(state, indent=1) + "\n")


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
        raise InputError("no deck here", file=folder, remedy="render it first: dragdeck render")
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


def _read(folder: Path, name: str) -> Any:
    try:
        return json.loads((folder / name).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"no {name} here", file=folder, remedy="dragdeck render") from None


def _state(folder: Path) -> dict[str, Any] | None:
    file = folder / STATE_FILE
    return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else None


def _save(folder: Path, state: Mapping[str, Any]) -> None:
    replace_text(folder / STATE_FILE, json.dumps(state, indent=1) + "\n")


def _write_result(folder: Path, state: Mapping[str, Any]) -> Path:
    result = folder / RESULT_FILE
    replace_text(result, json.dumps(state, indent=1) + "\n")
    return result


def _begin_part(
    folder: Path,
    state: dict[str, Any] | None,
    inputs: str,
    engine: Engine,
    ranks: int,
    scene: str,
) -> dict[str, Any]:
    """Note that a part begins, before it does."""
    if state is None:
        _keep_inputs(folder)
        state = {
            "schema": 1,
            "state": "running",
            "inputs": inputs,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "parts": [],
        }
    newest = _newest_checkpoint(folder)
    state["parts"].append(
        {
            "part": len(state["parts"]) + 1,
            "from": newest.name if newest else None,
            "from_step": _checkpoint_step(newest) if newest else 0,
        }
    )
    ranks = 1 if scene == "drop" else ranks
    state.update(state="running", engine_version=engine.version, ranks=ranks, gates=[])
    _save(folder, state)
    return state


def _execute_part(
    folder: Path,
    state: dict[str, Any],
    engine: Engine,
    case: Mapping[str, Any],
    columns: Mapping[str, Any],
    report: Report,
    every_s: float,
) -> dict[str, Any]:
    part = state["parts"][-1]
    number = part["part"]
    source = folder / part["from"] if part["from"] else None
    steps = case["phases"][-1]["end_step"] if case["phases"] else None
    limits = case.get("limits")
    watcher = _Watcher(folder, columns, number, part["from_step"], steps, report, every_s, limits)
    words = command(engine, DECK_FILE, state["ranks"], number, source)
    report(f"{case['scene']} {case['run']}: part {number}, {state['ranks']} rank(s)")
    screen = folder / f"screen.{number}.txt"
    begun = time.monotonic()
    try:
        ending = execute(words, folder, screen, watcher)
    except _LimitMet as met:
        part.update(wall_time_s=round(time.monotonic() - begun, 3), to_step=_last_step(screen))
        return _stop_early(folder, state, met.gate)
    part.update(
        wall_time_s=round(ending.wall_time_s, 3),
        cpu_time_s=round(ending.cpu_time_s, 3),
        exit_status=ending.exit_status,
        to_step=_last_step(screen),
    )
    return _conclude(folder, state, case, columns, ending.asked, report)


def _stop_early(folder: Path, state: dict[str, Any], gate: Gate) -> dict[str, Any]:
    """Note that a run was stopped because it went past a limit: it failed."""
    state.update(state="failed", gates=[gate.as_json()], stopped_early=True)
    state.update(_totals(state["parts"]))
    _save(folder, state)
    raise GateError(_failed(folder, state))


def _limit_gates(
    folder: Path, case: Mapping[str, Any], columns: Mapping[str, Any], parts: int
) -> list[Gate]:
    """The limits once more, on all rows: the watcher may not have looked at the last ones."""
    output = columns["outputs"].get("thermo")
    if "limits" not in case or output is None:
        return []
    for part in range(1, parts + 1):
        file = folder / output["pattern"].format(part=part)
        rows = file.read_text(errors="replace").splitlines() if file.is_file() else []
        gate = breach(read_samples(rows, output["columns"]), case["limits"])
        if gate is not None:
            return [gate]
    return [held(case["limits"])]


def _conclude(
    folder: Path,
    state: dict[str, Any],
    case: Mapping[str, Any],
    columns: Mapping[str, Any],
    asked: bool,
    report: Report,
) -> dict[str, Any]:
    part = state["parts"][-1]
    screen = (folder / f"screen.{part['part']}.txt").read_text(errors="replace")
    killed = part["exit_status"] < 0 or part["exit_status"] >= 128
    asked = _take_forced_restarts(folder) or asked
    if "DRAGDECK END" not in screen and (asked or (killed and not engine_errors(screen))):
        state["state"] = "stopped"
        _save(folder, state)
        raise EngineError(_stopped(folder, asked, part["exit_status"]))
    state["decomposition"] = decomposition(screen)
    gates = check_run(folder, case, columns, part["exit_status"], part["part"])
    gates.append(split_gate(state["decomposition"], state["ranks"]))
    gates += _limit_gates(folder, case, columns, part["part"])
    state["gates"] = [gate.as_json() for gate in gates]
    state.update(_totals(state["parts"]))
    if not all(gate.passed for gate in gates):
        state["state"] = "failed"
        _save(folder, state)
        raise GateError(_failed(folder, state))
    state["state"] = "complete"
    _save(folder, state)
    for checkpoint in _checkpoints(folder):
        checkpoint.unlink()
    report(f"complete: {state['steps']:,} steps in {state['wall_time_s']:.1f} s")
    return state


def _totals(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Steps that counted, and the time all parts took."""
    wall = sum(part["wall_time_s"] for part in parts if "wall_time_s" in part)
    cpu = sum(part["cpu_time_s"] for part in parts if "cpu_time_s" in part)
    steps = parts[-1]["to_step"] or 0
    done = sum(max(0, part["to_step"] - part["from_step"]) for part in parts if part.get("to_step"))
    return {
        "steps": steps,
        "wall_time_s": round(wall, 3),
        "cpu_time_s": round(cpu, 3),
        "steps_per_s": round(done / wall, 1) if wall > 0 else None,
    }


def _stopped(folder: Path, asked: bool, exit_status: int) -> str:
    newest = _newest_checkpoint(folder)
    why = "stopped as asked" if asked else f"the engine was killed (exit status {exit_status})"
    if newest is None:
        return f"{folder}: {why}\n  remedy: there is no checkpoint yet; run it again from its start"
    return (
        f"{folder}: {why}\n  value:  checkpoint at step {_checkpoint_step(newest):,}\n"
        "  remedy: run it again, and it goes on from there"
    )


def _failed(folder: Path, state: Mapping[str, Any]) -> str:
    lines = [f"{folder}: the run failed and is no result"]
    for gate in state["gates"]:
        if not gate["passed"]:
            lines.append(f"  gate:   {gate['name']}: {gate['seen']} (limit: {gate['limit']})")
    last = state["parts"][-1]["part"]
    lines.append(f"  log:    {folder / f'screen.{last}.txt'}")
    return "\n".join(lines)


def _keep_inputs(folder: Path) -> None:
    """Keep the deck as it was run: a later render may replace it."""
    kept = folder / AS_RUN
    kept.mkdir(exist_ok=True)
    for name in (DECK_FILE, CASE_FILE, COLUMNS_FILE):
        shutil.copy2(folder / name, kept / name)


def _archive(folder: Path, inputs: str, report: Report) -> None:
    """Move what a run of other inputs left out of the way; delete nothing."""
    place = folder / ARCHIVE / inputs[:8]
    number = 1
    while place.exists():
        number += 1
        place = folder / ARCHIVE / f"{inputs[:8]}-{number}"
    place.mkdir(parents=True)
    new = {DECK_FILE, CASE_FILE, COLUMNS_FILE, ARCHIVE}
    sources = {file.name for file in (*folder.glob("*.data"), *folder.glob("*.stl"))}
    for file in folder.iterdir():
        if file.name not in new | sources:
            shutil.move(str(file), str(place / file.name))
    report(f"an earlier run of other inputs was moved to {place}")


def _checkpoints(folder: Path) -> list[Path]:
    """Restart points, oldest first."""
    return sorted(folder.glob("checkpoint.*.restart"), key=_checkpoint_step)


def _checkpoint_step(file: Path) -> int:
    return int(file.name.split(".")[1])


def _newest_checkpoint(folder: Path) -> Path | None:
    """The newest restart point that is whole.

    The engine writes one thing after another: a restart file is whole if a
    text output was written after it, and may be cut short if it was the last.
    """
    texts = [*folder.glob("*.*.txt"), *folder.glob("engine.*.log")]
    latest = max((file.stat().st_mtime_ns for file in texts), default=0)
    whole = [file for file in _checkpoints(folder) if file.stat().st_mtime_ns < latest]
    return whole[-1] if whole else None


def _take_forced_restarts(folder: Path) -> bool:
    """Delete what the engine wrote because it was itself told to end; whether it was.

    A queue signals every process of a job. The engine then ends as if all were well, with
    a restart file that looks like a part of the deck; two ranks need not agree on its step.
    """
    forced = list(folder.glob("restart_forced_*"))
    for file in forced:
        file.unlink()
    return bool(forced)


def _last_step(screen: Path) -> int | None:
    """The last step that the engine's thermo table names."""
    rows = re.findall(r"^ *(\d+) +\d+ ", screen.read_text(errors="replace"), flags=re.MULTILINE)
    return int(rows[-1]) if rows else None


class _LimitMet(Exception):
    """A running engine went past a limit of its scene."""

    def __init__(self, gate: Gate) -> None:
        self.gate = gate
        super().__init__(gate.seen)


class _Watcher:
    """Reads how far a run is, reports it now and then, keeps few checkpoints.

    A run that goes past a limit of its scene ends with `_LimitMet`.
    """

    def __init__(
        self,
        folder: Path,
        columns: Mapping[str, Any],
        part: int,
        first: int,
        steps: int | None,
        report: Report,
        every_s: float,
        limits: Mapping[str, Any] | None = None,
    ) -> None:
        output = columns["outputs"].get("thermo")
        self._columns: list[str] = output["columns"] if output else []
        self._limits, self._place = limits, 0
        self._file = folder / output["pattern"].format(part=part) if output else None
        self._folder, self._first, self._steps = folder, first, steps
        self._report, self._every_s, self._next = report, every_s, every_s

    def __call__(self, seconds: float) -> None:
        if self._file is None or not self._file.is_file():
            return
        self._check_limits(self._file)
        if seconds < self._next:
            return
        self._next = seconds + self._every_s
        for old in _checkpoints(self._folder)[:-CHECKPOINTS_KEPT]:
            old.unlink()
        rows = self._file.read_text(errors="replace").splitlines()
        last = rows[-1].split() if rows else []  # the engine may not have written its header yet
        if last and last[0].isdigit():
            step = int(last[0])
            self._report(str(Progress(step, self._steps, (step - self._first) / seconds)))

    def _check_limits(self, file: Path) -> None:
        """Look at the rows that came since the last look."""
        if self._limits is None:
            return
        with file.open("rb") as stream:
            stream.seek(self._place)
            new, end, _ = stream.read().rpartition(b"\n")
        self._place += len(new) + len(end)
        rows = new.decode("ascii", errors="replace").splitlines()
        gate = breach(read_samples(rows, self._columns), self._limits)
        if gate is not None:
            raise _LimitMet(gate)


__all__ = ["Gate", "Progress", "fingerprint", "run"]

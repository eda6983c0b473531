"""A run folder from its input script to ``run.json``: start, resume, keep what there was.

``state.json`` says at any time how far the run is. ``run.json`` has the same
content and exists only for a run that is complete and passed every acceptance check, so
that nothing unfinished can be taken for a result.
"""

import hashlib
import os
import shutil
from pathlib import Path

from dragdeck.decks import CASE_FILE, COLUMNS_FILE, DECK_FILE, RUN_FILE
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.engine.checkpoints import is_whole, take_forced_restarts
from dragdeck.engine.part import STATE_FILE, PartOfRun, why_rejected
from dragdeck.engine.process import LOCK_FILE, find_engine, only_runner
from dragdeck.engine.reports import Report, say
from dragdeck.engine.space import full_disk_named
from dragdeck.errors import InputError, RejectedRunError
from dragdeck.files import file_checksum
from dragdeck.records.run import CaseFile, RunRecord
from dragdeck.script.commands import files_read

_ARCHIVE = "archive"
_SCREEN = "screen.1.txt"
_OF_THE_WORKFLOW = ("logs", "benchmarks")
"""Folders in which Snakemake has files open while it runs a job here."""

_AS_RUN = "as_run"
_PATIENCE_S = 1800.0
_ANEW = (
    "write it again with: ./run dragdeck step render, or run the scene that creates it; to change "
    "an input script, override a block of its template"
)


def run(
    folder: Path, report: Report, *, again: bool = False, patience_s: float = _PATIENCE_S
) -> RunRecord:
    """Bring a run folder to its ``run.json``.

    A complete run of the same inputs is left as it is. An interrupted one goes
    on from its last checkpoint. A run of other inputs is moved to ``archive/``
    and started anew. A run that failed is not repeated unless `again`.

    Parameters
    ----------
    folder : Path
        With input script, case.json and columns.json.
    report : callable
        Gets a line now and then.
    again : bool
        Start anew even if these inputs failed before.
    patience_s : float
        How long LIGGGHTS may write nothing.

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
    inputs = CaseFile.read(folder / CASE_FILE)
    columns = ColumnsFile.read(folder / COLUMNS_FILE)
    full_disk = full_disk_named(folder, columns.outputs, inputs.media.n_spheres)
    with full_disk, only_runner(folder, report):
        _check_files(folder, inputs)
        take_forced_restarts(folder)
        digest = fingerprint(folder, inputs)
        record = _record(folder)
        if record is None and (folder / _SCREEN).exists():
            _archive(folder, "unknown", report)
        elif record and (record.inputs != digest or (again and record.state != "complete")):
            _archive(folder, record.inputs[:8], report)
            record = None
        if record and record.state == "complete":
            report("the run is already complete with these inputs")
        elif record and record.state == "failed":
            raise RejectedRunError(
                why_rejected(folder, record) + "\n  remedy: change the study, or run it --again"
            )
        else:
            engine = find_engine()
            if record is None:
                _keep_inputs(folder)
            part = PartOfRun(folder, inputs, columns, record, report)
            record = part.execute(digest, engine, patience_s)
        record.write(folder / RUN_FILE)
        return record


def run_to_outcome(
    folder: Path, file: Path, report: Report, *, patience_s: float = _PATIENCE_S
) -> None:
    """Bring a run to its end, good or bad, and write how it ended to a file.

    For studies of where runs fail: a run that an acceptance check or a limit stopped has an
    outcome too. One that was interrupted has none yet.

    Raises
    ------
    InputError, EngineError
        As `run` does.
    """
    try:
        run(folder, report, patience_s=patience_s)
    except RejectedRunError as error:
        report(str(error))
    RunRecord.read(folder / STATE_FILE).write(file)


def run_command(folder: Path, outcome: Path | None, again: bool, patience_s: float) -> None:
    """Run the input script in a folder, or resume it."""
    if outcome is not None:
        run_to_outcome(folder, outcome, say, patience_s=patience_s)
    else:
        run(folder, say, again=again, patience_s=patience_s)


def fingerprint(folder: Path, inputs: CaseFile) -> str:
    """Hash of all that a run depends on: deck, data, meshes and the file it starts from.

    Comments in the deck do not count.
    """
    text = (folder / DECK_FILE).read_text(encoding="utf-8")
    commands = [line for line in text.splitlines() if line and not line.startswith("#")]
    total = hashlib.sha256("\n".join(commands).encode())
    names = _names_of_inputs(folder, inputs) - {DECK_FILE, COLUMNS_FILE}
    for name in sorted(names, key=folder.joinpath):
        checksum = inputs.files.get(name) or file_checksum(folder / name)
        total.update(Path(name).name.encode() + bytes.fromhex(checksum))
    return total.hexdigest()


def _names_of_inputs(folder: Path, inputs: CaseFile) -> set[str]:
    """The files that were written for a run, and those that its script reads beside them."""
    deck = folder / DECK_FILE
    text = deck.read_text(encoding="utf-8") if deck.is_file() else ""
    return {*inputs.files, *files_read(text)}


def _check_files(folder: Path, inputs: CaseFile) -> None:
    """Refuse to start from files that LIGGGHTS cannot read, or that are not those written.

    Raises
    ------
    InputError
        One is missing, empty or truncated, or has changed.
    """
    for name in sorted(_names_of_inputs(folder, inputs)):
        file = Path(os.path.normpath(folder / name))
        problem = ""
        if not file.is_file():
            problem = "a file that the run starts from is missing"
        elif not file.stat().st_size:
            problem = "a file that the run starts from is empty"
        elif name in inputs.files and file_checksum(file) != inputs.files[name]:
            problem = "the file has changed since it was written"
        elif _is_cut(file, inputs.media.n_spheres):
            problem = "a file that the run starts from is truncated"
        if problem:
            raise InputError(problem, file=file, remedy=_ANEW)


def _is_cut(file: Path, particles: int) -> bool:
    """Whether a file is the final state of a run, but not a whole one."""
    record = file.with_name(RUN_FILE)
    if file.suffix != ".restart" or not record.is_file():
        return False
    return not is_whole(file, particles, RunRecord.read(record).ranks)


def _record(folder: Path) -> RunRecord | None:
    """What is known of the run in a folder; None before its first start."""
    file = folder / STATE_FILE
    return RunRecord.read(file) if file.is_file() else None


def _keep_inputs(folder: Path) -> None:
    """Keep the deck as it was run: a later render may replace it."""
    kept = folder / _AS_RUN
    kept.mkdir(exist_ok=True)
    for name in (DECK_FILE, CASE_FILE, COLUMNS_FILE):
        shutil.copy2(folder / name, kept / name)


def _archive(folder: Path, name: str, report: Report) -> None:
    """Move what an earlier run left out of the way; delete nothing.

    What shows that there is such a run goes last, lest its checkpoints are taken for others'.
    """
    place = folder / _ARCHIVE / name
    number = 1
    while place.exists():
        number += 1
        place = folder / _ARCHIVE / f"{name}-{number}"
    place.mkdir(parents=True)
    new = {DECK_FILE, CASE_FILE, COLUMNS_FILE, LOCK_FILE, _ARCHIVE, *_OF_THE_WORKFLOW}
    sources = {file.name for file in (*folder.glob("*.data"), *folder.glob("*.stl"))}
    for file in sorted(folder.iterdir(), key=lambda file: file.name in (STATE_FILE, _SCREEN)):
        if file.name not in new | sources:
            shutil.move(str(file), str(place / file.name))
    report(f"an earlier run was moved to {place}")

"""How far the run in a folder is, as its records and LIGGGHTS' outputs say, whoever runs it."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from dragdeck.decks import CASE_FILE, COLUMNS_FILE
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.engine.completeness import part_files
from dragdeck.engine.log import Sample, last_step, thermo_samples
from dragdeck.engine.part import STATE_FILE, why_rejected
from dragdeck.engine.process import find_engine, is_held
from dragdeck.engine.reports import printable
from dragdeck.errors import DragdeckError, EngineError, InputError
from dragdeck.physics.contact_mechanics import fall_energy
from dragdeck.records.bed import CaseOfBed
from dragdeck.records.run import CaseFile, RunRecord

RunState = Literal["waiting", "running", "interrupted", "failed", "complete"]

_TAIL_BYTES = 20_000
"""More than a row of ``thermo``, or the message that ends a log."""


@dataclass(frozen=True)
class RunStatus:
    """How far a run is.

    Attributes
    ----------
    state : RunState
        ``interrupted``: no process runs it, and it can go on.
    step : int
        The last one that is known.
    last : int or None
        The one at which it ends; None where LIGGGHTS decides.
    final : bool
        It is complete, or was rejected: the same inputs are not run again.
    steps_per_s : float or None
        As measured: of the part that runs, or of all parts where none runs.
    wall_time_s : float
        Of the parts that have ended.
    energy, at_rest : float or None
        Of a filling: mean kinetic energy of a particle over m g d, and the value at rest.
    problem : str
        Why it failed or was interrupted, with a remedy, where that is known.
    """

    state: RunState
    step: int = 0
    last: int | None = None
    final: bool = False
    steps_per_s: float | None = None
    wall_time_s: float = 0.0
    energy: float | None = None
    at_rest: float | None = None
    problem: str = ""


def run_status(folder: Path) -> RunStatus:
    """Look at a run folder, which need not exist; nothing in it is changed."""
    try:
        return _status(folder)
    except (InputError, OSError, ValueError) as error:  # damaged, or being replaced just now
        return RunStatus("failed", problem=printable(str(error)))


def _status(folder: Path) -> RunStatus:
    held = is_held(folder)
    if not (folder / STATE_FILE).is_file():
        said = "" if held else _last_words(folder)
        return RunStatus("failed" if said else "waiting", problem=said)
    record = RunRecord.read(folder / STATE_FILE)
    if record.state not in ("complete", "failed"):
        return _unfinished(folder, record, held)
    complete = record.state == "complete"
    return RunStatus(
        state=record.state,
        step=record.steps,
        final=True,
        steps_per_s=record.steps_per_s,
        wall_time_s=record.wall_time_s,
        problem="" if complete else printable(why_rejected(folder, record)),
    )


def _unfinished(folder: Path, record: RunRecord, held: bool) -> RunStatus:
    """The status of a run that runs, or was interrupted."""
    inputs = CaseFile.read(folder / CASE_FILE)
    sample, seconds = _newest(folder, record)
    first = record.last_part.from_step
    step = max(first, sample.step if sample else _shown_step(folder, record))
    speed = record.steps_per_s  # of a part that runs, not known yet
    if not speed and step > first and seconds > 0:
        speed = (step - first) / seconds
    energy, at_rest = _rest(folder, inputs, sample)
    return RunStatus(
        state="running" if held else "interrupted",
        step=step - inputs.entry_step,
        last=inputs.phases[-1].end_step - inputs.entry_step if inputs.phases else None,
        steps_per_s=speed or None,
        wall_time_s=record.wall_time_s,
        energy=energy,
        at_rest=at_rest,
        problem="" if held else _last_words(folder),
    )


def _newest(folder: Path, record: RunRecord) -> tuple[Sample | None, float]:
    """The last row of ``thermo`` of the last part, and how long after its start it was written."""
    thermo = ColumnsFile.read(folder / COLUMNS_FILE).outputs.get("thermo")
    if thermo is None:
        return None, 0.0
    (file,) = part_files(folder, {"thermo": thermo}, [record.last_part])
    if not file.is_file():
        return None, 0.0
    rows = thermo_samples(_tail(file).splitlines(), thermo.columns)
    seconds = file.stat().st_mtime - (folder / STATE_FILE).stat().st_mtime
    return (rows[-1] if rows else None), seconds


def _shown_step(folder: Path, record: RunRecord) -> int:
    """The last step that LIGGGHTS has printed."""
    screen = folder / f"screen.{record.last_part.part}.txt"
    return (last_step(_tail(screen)) or 0) if screen.is_file() else 0


def _rest(
    folder: Path, inputs: CaseFile, sample: Sample | None
) -> tuple[float | None, float | None]:
    if inputs.settled is None or sample is None:
        return None, None
    case = CaseOfBed.read(folder / CASE_FILE)
    media = case.media
    unit = fall_energy(1, media.weight_kg_m3, media.radius_mean_m, case.gravity_m_s2)
    return sample.mean_energy_j / unit, inputs.settled.energy_ratio


def _last_words(folder: Path) -> str:
    """The message with which the writing of the input script, or the run, ended."""
    for name in ("render", "run", "try"):
        log = folder / "logs" / f"{name}.log"
        if log.is_file() and (said := re.search(r"^dragdeck: (.*)", _tail(log), re.M | re.S)):
            return printable(said.group(1).strip())
    return ""


def _tail(file: Path) -> str:
    """The end of a file."""
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - _TAIL_BYTES))
        return stream.read().decode("utf-8", errors="replace")


def lacks_output(folder: Path) -> bool:
    """Whether an output of a complete run was deleted."""
    if run_status(folder).state != "complete":
        return False
    parts = RunRecord.read(folder / STATE_FILE).parts
    outputs = ColumnsFile.read(folder / COLUMNS_FILE).outputs.values()
    files = (part_files(folder, {"": output}, parts) for output in outputs)
    return not all(any(file.is_file() for file in written) for written in files)


def other_engines(records: Iterable[Path]) -> Iterator[str]:
    """What to say of runs, by their ``run.json``, that another LIGGGHTS made than is here."""
    made = Counter[str]()
    for file in records:
        with suppress(DragdeckError):
            made[RunRecord.read(file).engine_version] += 1
    try:
        here = find_engine().version if made else ""
    except EngineError:
        return
    for version in sorted({*made} - {here}):
        yield (
            f"LIGGGHTS {version} made {made[version]} run(s), which LIGGGHTS {here} would not "
            "make anew; remove their folders if it should"
        )

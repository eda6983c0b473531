"""How much of a disk a run takes."""

import contextlib
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.checkpoints import CHECKPOINTS_KEPT
from dragdeck.engine.reports import shown_bytes
from dragdeck.errors import EngineError, InputError
from dragdeck.files import FULL_DISK

_BINARY_BYTES, _TEXT_BYTES = 8, 12
"""Of a value; text is written with up to nine digits."""

_CHECKPOINT_BYTES = 600
"""Of a particle with six contacts in a checkpoint."""


MOST_BYTES = 1e12
"""More than any run is worth: a rate in the wrong unit."""

_FIELDS = {
    "workpiece_force": "outputs.workpiece_force_hz",
    "first_touch": "outputs.first_touch_fraction",
    "workpiece": "outputs.workpiece_contacts_hz",
    "": "outputs.network_hz",
}
"""By the beginning of an output's name: the field that says how often it is written."""

SPARE_BYTES = 2_000_000
"""What a run leaves free on its disk, beside what it still needs."""


def size_of(file: Path) -> int:
    """Size of a file, bytes; 0 where there is none."""
    return file.stat().st_size if file.is_file() else 0


def free_bytes(folder: Path) -> int:
    """What a user may still write on the disk of a folder."""
    return shutil.disk_usage(folder).free


def expected_bytes(outputs: Mapping[str, OutputOfRun], particles: int) -> float:
    """What the outputs of a whole run and its checkpoints will take."""
    written = sum(_output_bytes(output, particles) for output in outputs.values())
    return written + (CHECKPOINTS_KEPT + 1) * _CHECKPOINT_BYTES * particles


def check_amount(outputs: Mapping[str, OutputOfRun], particles: int) -> None:
    """Refuse a run whose outputs take more than any disk is meant for.

    Raises
    ------
    InputError
        Names the output that takes most, and its field.
    """
    needed = expected_bytes(outputs, particles)
    if needed <= MOST_BYTES:
        return
    most = max(outputs, key=lambda name: _output_bytes(outputs[name], particles))
    part = _output_bytes(outputs[most], particles)
    raise InputError(
        f"a run would write {shown_bytes(needed)}, {shown_bytes(part)} of it as {most}",
        field=next(field for name, field in _FIELDS.items() if most.startswith(name)),
        limit=shown_bytes(MOST_BYTES),
        remedy="reduce this value, the length of the path or the number of particles",
    )


def _output_bytes(output: OutputOfRun, particles: int) -> float:
    last = output.first_step if output.last_step is None else output.last_step
    frames = (last - output.first_step) // output.period_steps + 1
    rows = max(1.0, output.rows_per_particle * particles)
    size = _BINARY_BYTES if output.binary else _TEXT_BYTES
    return frames * rows * len(output.columns) * size


def check_space(folder: Path, outputs: Mapping[str, OutputOfRun], particles: int) -> None:
    """Refuse a run that its disk cannot hold.

    Raises
    ------
    EngineError
        Less is free than the run will still write by the definition of its outputs.
    """
    if free_bytes(folder) < _still_needed(folder, outputs, particles):
        problem = f"{folder}: too little disk space for this run"
        raise _too_little(problem, folder, outputs, particles)


def _too_little(
    problem: str, folder: Path, outputs: Mapping[str, OutputOfRun], particles: int, then: str = ""
) -> EngineError:
    free, needed = free_bytes(folder), _still_needed(folder, outputs, particles)
    return EngineError(
        f"{problem}\n  value:  {shown_bytes(free)} free\n"
        f"  limit:  {shown_bytes(needed)}, estimated from its outputs\n"
        f"  remedy: free disk space, or reduce the rates under outputs in the study{then}"
    )


@contextlib.contextmanager
def full_disk_named(
    folder: Path, outputs: Mapping[str, OutputOfRun], particles: int
) -> Iterator[None]:
    """While inside, say what a run needs if the disk is full when one of its files is written.

    Raises
    ------
    EngineError
        Names the file, and what is free and still needed.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL_DISK:
            raise
        problem = f"{error.filename or folder}: the disk is full ({error.strerror})"
        again = "; then run it again"
        raise _too_little(problem, folder, outputs, particles, again) from None


def space_left(folder: Path, outputs: Mapping[str, OutputOfRun], particles: int) -> str:
    """What is free on the disk of a run, and what it will still write, for a reader."""
    needed = _still_needed(folder, outputs, particles)
    return f"{shown_bytes(free_bytes(folder))} free, {shown_bytes(needed)} needed"


def _still_needed(folder: Path, outputs: Mapping[str, OutputOfRun], particles: int) -> float:
    """What a run will write beyond what its parts have written already, bytes."""
    written = sum(
        size_of(file)
        for output in outputs.values()
        for file in folder.glob(output.pattern.format(part="*"))
    )
    return SPARE_BYTES + max(0.0, expected_bytes(outputs, particles) - written)

"""How much of a disk a run takes."""

import shutil
from collections.abc import Mapping
from pathlib import Path

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.checkpoints import CHECKPOINTS_KEPT
from dragdeck.engine.reports import shown_bytes
from dragdeck.errors import EngineError

_BINARY_BYTES, _TEXT_BYTES = 8, 12
"""Of a value; text is written with up to nine digits."""

_CHECKPOINT_BYTES = 600
"""Of a particle with six contacts in a checkpoint."""


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


def _output_bytes(output: OutputOfRun, particles: int) -> float:
    last = output.first_step if output.last_step is None else output.last_step
    frames = (last - output.first_step) // output.period_steps + 1
    rows = max(1.0, output.rows_per_particle * particles)
    size = _BINARY_BYTES if output.binary else _TEXT_BYTES
    return frames * rows * len(output.columns) * size


def check_space(
    folder: Path, outputs: Mapping[str, OutputOfRun], particles: int, written: float
) -> None:
    """Refuse a run that its disk cannot hold.

    Parameters
    ----------
    written : float
        What earlier parts of the run have written already, bytes.

    Raises
    ------
    EngineError
        Less is free than the run will write by the definition of its outputs.
    """
    free, needed = free_bytes(folder), expected_bytes(outputs, particles) - written
    if free < needed:
        raise EngineError(
            f"{folder}: too little disk space for this run\n  value:  {shown_bytes(free)} free\n"
            f"  limit:  {shown_bytes(needed)}, estimated from its outputs\n"
            "  remedy: free disk space, or reduce the rates under outputs in the study"
        )

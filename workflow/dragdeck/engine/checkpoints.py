"""Checkpoints of a run: which are whole, and from which it can go on.

LIGGGHTS writes ``checkpoint.<step>.restart`` and checks neither that the disk took it nor, when it
reads one, that it is whole: a damaged one ends in an error, in other positions or in an endless
loop. So a checkpoint counts once it was read back, found to hold every particle up to its last
byte, and renamed to hold its own checksum: ``checkpoint.<step>.<checksum>.restart``.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dragdeck.engine.reports import Report
from dragdeck.files import file_checksum

CHECKPOINTS_KEPT = 2
_DAMAGED = "damaged"
_NAME = re.compile(r"checkpoint\.(\d+)(?:\.([0-9a-f]{16}))?\.restart")


def checkpoint_files(folder: Path) -> list[Path]:
    """All checkpoints, oldest first, checked or not."""
    files = [file for file in folder.glob("checkpoint.*") if _NAME.fullmatch(file.name)]
    return sorted(files, key=checkpoint_step)


def checkpoint_step(file: Path) -> int:
    """The step of a checkpoint, from its name."""
    return int(file.name.split(".")[1])


def name_whole_checkpoints(folder: Path, particles: int, ranks: int) -> None:
    """Give every checkpoint that was written since the last call, and is whole, its checksum.

    One that is not whole keeps its name: the engine may still be writing it.
    """
    for file in checkpoint_files(folder):
        if _checksum_in(file) is None and is_whole(file, particles, ranks):
            with file.open("rb") as stream:
                os.fsync(stream.fileno())
            named = f"checkpoint.{checkpoint_step(file)}.{_checksum(file)}.restart"
            file.rename(file.with_name(named))


def drop_old_checkpoints(folder: Path) -> None:
    """Delete all but the newest checkpoints that count."""
    counted = [file for file in checkpoint_files(folder) if _checksum_in(file)]
    for old in counted[:-CHECKPOINTS_KEPT]:
        old.unlink()


def newest_checkpoint(
    folder: Path, particles: int, ranks: int, before: float, report: Report
) -> Path | None:
    """The newest whole checkpoint from which a run can go on.

    Damaged ones are moved to ``damaged/``. No clock and no time of a file plays a part.

    Parameters
    ----------
    folder : Path
    particles, ranks : int
        That a checkpoint must hold.
    before : float
        A checkpoint at this step or later is of no use: an output lacks this step.
    report : callable
        Is told of each damaged checkpoint.
    """
    name_whole_checkpoints(folder, particles, ranks)
    for file in reversed(checkpoint_files(folder)):
        if _checksum_in(file) != _checksum(file):
            kept = folder / _DAMAGED / file.name
            kept.parent.mkdir(exist_ok=True)
            file.replace(kept)
            report(f"{file.name} is damaged, and was moved to {_DAMAGED}/")
        elif checkpoint_step(file) < before:
            return file
    return None


def _checksum_in(file: Path) -> str | None:
    """The checksum in a checkpoint's name; None before it was checked."""
    found = _NAME.fullmatch(file.name)
    return found.group(2) if found else None


def _checksum(file: Path) -> str:
    return file_checksum(file)[:16]


def is_whole(file: Path, particles: int, ranks: int) -> bool:
    """Whether a restart file holds the particles of all ranks up to its last byte.

    After what is common to all, each rank's particles stand as a count of doubles, a 4-byte
    integer, and the doubles; each particle's begin with how many they are (LIGGGHTS 3.8.0,
    write_restart.cpp). So the chunks are found from the end of the file.
    """
    return _holds(file.read_bytes(), particles, ranks)


def _holds(content: bytes, particles: int, ranks: int) -> bool:
    """Whether chunks of so many particles together end at the end of the content."""
    if ranks == 0 or not content:
        return particles == 0
    if content.endswith(bytes(4)) and _holds(content[:-4], particles, ranks - 1):
        return True  # a rank without particles
    return any(
        count <= particles and _holds(content[:start], particles - count, ranks - 1)
        for start, count in _last_chunks(content)
    )


def _last_chunks(content: bytes) -> Iterator[tuple[int, int]]:
    """Where a last chunk may begin, and how many particles it would hold, longest first."""
    doubles = (len(content) - 4) // 8
    if doubles < 1:
        return
    first = len(content) - 4 - 8 * doubles
    words = np.frombuffer(content, "<i4", 2 * doubles + 1, first)[::2]
    lengths = np.arange(doubles, -1, -1)
    for place in np.flatnonzero((words == lengths) & (lengths > 0)):
        start = first + 8 * int(place)
        count = _particles(np.frombuffer(content, "<f8", offset=start + 4))
        if count:
            yield start, count


def _particles(values: np.ndarray) -> int:
    """Number of particles in a chunk; 0 where their lengths do not fill it."""
    place = count = 0
    while place < len(values):
        length = values[place]
        if not 1 <= length <= len(values) - place or length != int(length):
            return 0
        place, count = place + int(length), count + 1
    return count


def take_forced_restarts(folder: Path) -> bool:
    """Delete what the engine wrote because it was itself told to end; whether it was.

    A queue signals every process of a job. The engine then ends as if all were well, with
    a restart file that looks like a part of the deck; two ranks need not agree on its step.
    """
    forced = list(folder.glob("restart_forced_*"))
    for file in forced:
        file.unlink()
    return bool(forced)

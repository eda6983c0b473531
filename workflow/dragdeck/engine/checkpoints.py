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
from typing import BinaryIO

import numpy as np

from dragdeck.engine.reports import Report
from dragdeck.files import file_checksum

CHECKPOINTS_KEPT = 2
_DAMAGED = "damaged"
_PIECE_DOUBLES = 1 << 17
"""Doubles of a checkpoint that are read at once, 1 MiB."""
_NAME = re.compile(r"checkpoint\.(\d+)(?:\.([0-9a-f]{16}))?\.restart")


def checkpoint_files(folder: Path) -> list[Path]:
    """All checkpoints, oldest first, checked or not."""
    files = [file for file in folder.glob("checkpoint.*") if _NAME.fullmatch(file.name)]
    return sorted(files, key=checkpoint_step)


def checkpoint_step(file: Path) -> int:
    """The step of a checkpoint, from its name."""
    return int(file.name.split(".")[1])


def name_whole_checkpoints(
    folder: Path, particles: int, ranks: int, sizes: dict[str, int] | None = None
) -> None:
    """Give every checkpoint that was written since the last call, and is whole, its checksum.

    One that is not whole keeps its name: the engine may still be writing it.

    Parameters
    ----------
    folder : Path
    particles, ranks : int
        That a checkpoint must hold.
    sizes : dict of str to int, optional
        Kept between calls: one that is not whole is read again only once its size has changed.
    """
    sizes = {} if sizes is None else sizes
    for file in checkpoint_files(folder):
        size = file.stat().st_size
        if _checksum_in(file) is not None or sizes.get(file.name) == size:
            continue
        sizes[file.name] = size
        if is_whole(file, particles, ranks):
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
    match = _NAME.fullmatch(file.name)
    return match.group(2) if match else None


def _checksum(file: Path) -> str:
    return file_checksum(file)[:16]


def is_whole(file: Path, particles: int, ranks: int) -> bool:
    """Whether a restart file holds the particles of all ranks up to its last byte.

    After what is common to all, each rank's particles stand as a count of doubles, a 4-byte
    integer, and the doubles; each particle's begin with how many they are (LIGGGHTS 3.8.0,
    write_restart.cpp). So the chunks are found from the end of the file, which is read in pieces.
    """
    with file.open("rb") as stream:
        rests = [iter([(os.fstat(stream.fileno()).st_size, particles, ranks)])]
        while rests:
            rest = next(rests[-1], None)
            if rest is None:
                rests.pop()
                continue
            end, missing, left = rest
            if left and end:
                rests.append(_before_last_chunk(stream, *rest))
            elif missing == 0:
                return True
    return False


def _before_last_chunk(
    stream: BinaryIO, end: int, missing: int, ranks: int
) -> Iterator[tuple[int, int, int]]:
    """Where a last chunk before `end` may begin, and the particles and ranks before it."""
    if _read(stream, end - 4, 4) == bytes(4):
        yield end - 4, missing, ranks - 1  # a rank without particles
    for start, count in _last_chunks(stream, end):
        if count <= missing:
            yield start, missing - count, ranks - 1


def _last_chunks(stream: BinaryIO, end: int) -> Iterator[tuple[int, int]]:
    """Where a last chunk may begin, and how many particles it would hold, shortest first."""
    doubles = (end - 4) // 8
    for least in range(1, doubles + 1, _PIECE_DOUBLES):
        for length in _lengths(stream, end, least, min(least + _PIECE_DOUBLES - 1, doubles)):
            start = end - 4 - 8 * length
            count = _particles(stream, start + 4, length)
            if count:
                yield start, count


def _lengths(stream: BinaryIO, end: int, least: int, most: int) -> list[int]:
    """Lengths in doubles, in a range, that stand before as many doubles, shortest first."""
    lengths = np.arange(most, least - 1, -1)
    content = _read(stream, end - 4 - 8 * most, 8 * len(lengths))
    if not content:  # cut meanwhile
        return []
    whole_lengths: list[int] = lengths[np.frombuffer(content, "<i4")[::2] == lengths].tolist()
    return whole_lengths[::-1]


def _particles(stream: BinaryIO, begin: int, doubles: int) -> int:
    """Number of particles in a chunk; 0 where their lengths do not fill it."""
    count = 0
    while doubles:
        values = np.frombuffer(_read(stream, begin, 8 * min(doubles, _PIECE_DOUBLES)), "<f8")
        place = 0
        while place < len(values):
            length = float(values[place])
            if not 1 <= length <= doubles - place or not length.is_integer():
                return 0
            place, count = place + int(length), count + 1
        if place == 0:  # cut meanwhile
            return 0
        begin, doubles = begin + 8 * place, doubles - place
    return count


def _read(stream: BinaryIO, place: int, size: int) -> bytes:
    """Some bytes of a file; none where it does not have them all."""
    if place < 0:
        return b""
    stream.seek(place)
    content = stream.read(size)
    return content if len(content) == size else b""


def take_forced_restarts(folder: Path) -> bool:
    """Delete what the engine wrote because it was itself told to end; whether it was.

    A queue signals every process of a job. The engine then ends as if all were well, with
    a restart file that looks like a part of the deck; two ranks need not agree on its step.
    """
    forced = list(folder.glob("restart_forced_*"))
    for file in forced:
        file.unlink()
    return bool(forced)

"""Snakemake's own locks survive a ``kill -9``; this one tells whether their holder lives."""

import fcntl
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

_held: list[TextIO] = []
"""Open for as long as this process lives: the system frees the lock with it."""


def clear_stale_locks(folder: Path, report: Callable[[str], None]) -> None:
    """Delete Snakemake's locks if no process holds them any more, and hold ours from now on.

    Parameters
    ----------
    folder : Path
        Snakemake's own folder, ``.snakemake``.
    report : callable
        Is told of locks that were deleted.
    """
    try:
        folder.mkdir(exist_ok=True)
        stream = (folder / "dragdeck.lock").open("a")
    except OSError:  # Snakemake will say that it may not write here
        return
    _held.append(stream)
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another Snakemake is at work: its locks count
        pass
    else:
        stale = list((folder / "locks").glob("*.lock"))
        for lock in stale:
            lock.unlink()
        if stale:
            report("the locks of a Snakemake that was killed were deleted")
    fcntl.flock(stream, fcntl.LOCK_SH)

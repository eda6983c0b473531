"""One runner at a time in a run folder, and no engine without one."""

import contextlib
import fcntl
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import psutil

from dragdeck.decks import DECK_FILE
from dragdeck.engine.reports import Report

LOCK_FILE = ".lock"


@contextlib.contextmanager
def only_runner(folder: Path, report: Report) -> Iterator[None]:
    """Hold the lock of a run folder, and end an engine that was left alone in it.

    The system frees the lock when its holder dies, in whatever way. A living holder is named,
    and waited for: it brings the run to its end.
    """
    with (folder / LOCK_FILE).open("a+", encoding="utf-8") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            stream.seek(0)
            holder = stream.read().strip() or "an unknown process"
            report(f"waiting for another process that runs this folder: {holder}")
            fcntl.flock(stream, fcntl.LOCK_EX)
        stream.truncate(0)
        stream.write(f"process {os.getpid()} on {socket.gethostname()}\n")
        stream.flush()
        for orphan in _engines_in(folder):
            report(f"ended LIGGGHTS, which had outlived its dragdeck process: process {orphan.pid}")
            end_tree(orphan)
            psutil.wait_procs([orphan], timeout=10)
        yield


def is_held(folder: Path) -> bool:
    """Whether a living process runs a folder, here or on another machine that shares its disk."""
    with contextlib.suppress(FileNotFoundError), (folder / LOCK_FILE).open() as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def _engines_in(folder: Path) -> list[psutil.Process]:
    """Processes of this machine that run the deck of a folder."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if DECK_FILE in process.cmdline() and Path(process.cwd()).samefile(folder):
                found.append(process)
    return found


def end_tree(top: psutil.Process) -> None:
    """Kill a process and all that it started: mpirun's ranks have groups of their own."""
    with contextlib.suppress(psutil.NoSuchProcess):
        family = [*top.children(recursive=True), top]
        for process in family:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        psutil.wait_procs([process for process in family if process != top], timeout=10)

"""Snakemake's own locks survive a ``kill -9``; this one tells who holds them, if anybody lives."""

import fcntl
import json
import os
import socket
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import TextIO

import psutil

from dragdeck.files import lock

_FILE = "dragdeck.lock"

_held: list[TextIO] = []
"""Open for as long as this process lives: the system frees the lock with it."""


@dataclass(frozen=True)
class Holder:
    """A Snakemake that works in this project, as it entered itself into the file of the lock.

    Attributes
    ----------
    host : str
    pid : int
    since : str
        Local time, ISO 8601.
    call : str
        Its arguments.
    """

    host: str
    pid: int
    since: str
    call: str

    @classmethod
    def of_this_process(cls, call: str) -> "Holder":
        """The process that asks, from now on."""
        now = datetime.now().isoformat(sep=" ", timespec="seconds")
        return cls(socket.gethostname(), os.getpid(), now, call)

    def may_live(self) -> bool:
        """Whether it is not known to have ended; of another machine nothing is known."""
        if self.host != socket.gethostname():
            return True
        try:
            started = psutil.Process(self.pid).create_time()
        except psutil.NoSuchProcess:
            return False
        return started <= datetime.fromisoformat(self.since).timestamp() + 1


def hold_lock(folder: Path, report: Callable[[str], None], call: str = "") -> None:
    """Delete Snakemake's locks if no process holds them any more, and hold ours from now on.

    Parameters
    ----------
    folder : Path
        Snakemake's own folder, ``.snakemake``.
    report : callable
        Is told of locks that were deleted.
    call : str, optional
        Arguments of this Snakemake; empty if it takes none of Snakemake's locks.
    """
    try:
        folder.mkdir(exist_ok=True)
        stream = (folder / _FILE).open("a")
    except OSError:  # Snakemake will say that it may not write here
        return
    _held.append(stream)
    try:
        if not lock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB):  # then Snakemake's own count
            return
    except BlockingIOError:  # another Snakemake is at work: its locks count
        pass
    else:
        stream.truncate(0)
        stale = list((folder / "locks").glob("*.lock"))
        for file in stale:
            file.unlink()
        if stale:
            report("the locks of a Snakemake that was killed were deleted")
    lock(stream, fcntl.LOCK_SH)
    if call:
        stream.write(json.dumps(asdict(Holder.of_this_process(call))) + "\n")
        stream.flush()


def others_at_work(folder: Path) -> list[Holder]:
    """The other Snakemakes that hold the lock."""
    lines = (folder / _FILE).read_text(encoding="utf-8").splitlines()
    holders = [Holder(**json.loads(line)) for line in lines]
    return [holder for holder in holders if holder.pid != os.getpid() and holder.may_live()]


def why_locked(folder: Path) -> str | None:
    """Who holds Snakemake's lock, and what to do; None if nobody is known to."""
    others = others_at_work(folder)
    if not others:
        return None
    stopped = "PROCESS" if others[1:] else others[0].pid  # which of several it is, nothing says
    return "\n".join(
        [
            "another call is making the same files",
            *(f"  value:  process {other.pid} on {other.host} since {other.since}: {other.call}"
              for other in others),
            "  remedy: give the same command again when it has ended; or stop it with: "
            f"kill -INT {stopped}",
        ]
    )  # fmt: skip

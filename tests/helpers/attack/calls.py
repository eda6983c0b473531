"""Commands under attack: called, limited, killed, and what they said."""

import contextlib
import math
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from preloaded import PACKAGES, USER, environment

LARGEST_FILE = 64 * 2**20
"""No command that is attacked may write a file beyond this, bytes."""

MOST_MEMORY = 6 * 2**30
"""Address space of a command that is attacked, bytes."""

PATIENCE_S = 240.0
"""Processor time after which a command has no answer, s; how long it takes depends on the load."""

HUNG_S = 3600.0
"""After this time a command that uses no processor time has no answer either, s."""

_POLL_S = 0.02


@dataclass(frozen=True)
class Said:
    """What a command said and how it ended; None: it had to be ended."""

    status: int | None
    text: str

    @property
    def has_traceback(self) -> bool:
        return "Traceback (most recent call last)" in self.text

    @property
    def tail(self) -> str:
        return self.text[-2500:]


def refused(said: Said, *names: str) -> bool:
    """Whether a command refused what it was given, rather than accept it.

    Nothing else is allowed: it must answer by itself, without a traceback, and a message that
    refuses matches all `names`, which are regular expressions of what is wrong.
    """
    assert said.status is not None, f"no answer: {said.tail}"
    assert not said.has_traceback, said.tail
    assert said.status >= 0, f"died of signal {-said.status}: {said.tail}"
    if said.status == 0:
        return False
    missing = [name for name in names if not re.search(name, said.text, re.IGNORECASE)]
    assert not missing, f"not in the message: {missing}\n{said.tail}"
    return True


def limit_files() -> None:
    """For this process and all it starts: no file that is larger than allowed."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST_FILE, LARGEST_FILE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


# --- commands as processes ----------------------------------------------------------


def command(name: str, *arguments: object) -> list[str]:
    """Words of ``dragdeck`` or ``dragchain``."""
    return [sys.executable, "-m", f"{name}.cli", *map(str, arguments)]


class Call:
    """A command in a session of its own, which can be attacked while it runs."""

    def __init__(self, words: Sequence[str], folder: Path, log: Path) -> None:
        self.log = log
        self._begun = time.monotonic()
        scripts = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        seen = {**os.environ, "PYTHONPATH": PACKAGES, "PATH": scripts, "PYTHONUNBUFFERED": "1"}
        seen.pop("DISPLAY", None)
        with log.open("wb") as sink:
            self.process = subprocess.Popen(
                words,
                cwd=folder,
                env=seen,
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=limit_files,
            )

    def tree(self) -> list[psutil.Process]:
        """The command and all that it started and that still runs."""
        with contextlib.suppress(psutil.NoSuchProcess):
            first = psutil.Process(self.process.pid)
            return [first, *first.children(recursive=True)]
        return []

    def spent_s(self) -> float:
        """Processor time of the command and all that it started, s."""
        return sum(_spent_s(each) for each in self.tree())

    def wait_until(self, condition: Callable[[], bool], poll_s: float = _POLL_S) -> bool:
        """Wait until something is so while the command runs; whether it came to that."""
        while self.process.poll() is None and not self._is_beyond(PATIENCE_S):
            if condition():
                return True
            time.sleep(poll_s)
        return False

    def _is_beyond(self, patience_s: float) -> bool:
        return self.spent_s() > patience_s or time.monotonic() - self._begun > HUNG_S

    def wait(self, patience_s: float = PATIENCE_S) -> Said:
        """Wait for the end; beyond this processor time everything is killed."""
        while (status := self.process.poll()) is None:
            if self._is_beyond(patience_s):
                kill(self.tree())
                self.process.wait()
                break
            time.sleep(_POLL_S)
        return Said(status, self.log.read_text(encoding="utf-8", errors="replace"))


def call(words: Sequence[str], folder: Path, log: Path, patience_s: float = PATIENCE_S) -> Said:
    """Run a command to its end."""
    return Call(words, folder, log).wait(patience_s)


def kill(processes: Sequence[psutil.Process]) -> None:
    """SIGKILL, all at once."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.send_signal(signal.SIGKILL)


def _spent_s(process: psutil.Process) -> float:
    with contextlib.suppress(psutil.NoSuchProcess):
        times = process.cpu_times()
        return times.user + times.system + times.children_user + times.children_system
    return 0.0


def is_engine(process: psutil.Process) -> bool:
    """Whether a process is LIGGGHTS itself, and no launcher or supervisor of one."""
    with contextlib.suppress(psutil.Error):
        return process.name().startswith("liggghts")
    return False


def engines(folder: Path) -> list[psutil.Process]:
    """Engines that run in a folder or below it, whoever started them."""
    found = []
    for process in filter(is_engine, psutil.process_iter()):
        with contextlib.suppress(psutil.Error, OSError):
            below = Path(process.cwd()).is_relative_to(folder.resolve())
            asked_for_its_version = "-in" not in process.cmdline()
            ended = process.status() == psutil.STATUS_ZOMBIE
            if below and not ended and not asked_for_its_version:
                found.append(process)
    return found


def gone_within(folder: Path, seconds: float) -> bool:
    """Whether no engine of a folder goes on for more than some seconds of processor time."""
    begun: dict[int, float] = {}
    deadline = time.monotonic() + HUNG_S
    while left := engines(folder):
        spent = {each.pid: _spent_s(each) for each in left}
        if any(now - begun.setdefault(number, now) > seconds for number, now in spent.items()):
            return False
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_S)
    return True


# --- commands in a process that has imported them -----------------------------------------


def main_of(
    name: str,
    arguments: Sequence[object],
    folder: Path,
    patience_s: float = 60.0,
    user: int | None = None,
) -> Said:
    """Call a program in a process that is forked for it, as another user.

    The patience is processor time: the machine may be shared.
    """

    def limit() -> None:
        limit_files()
        most = math.ceil(patience_s)
        resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))

    done = subprocess.run(
        [name, *map(str, arguments)],
        cwd=folder,
        env=environment() | ({} if user is None else {USER: str(user)}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=HUNG_S,
        preexec_fn=limit,
    )
    status = done.returncode if done.returncode < 128 else 128 - done.returncode
    text = done.stdout.decode("utf-8", errors="replace")
    return Said(None if status == -signal.SIGXCPU else status, text)

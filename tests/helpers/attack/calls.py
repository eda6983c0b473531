"""Commands under attack: called, limited, killed, and what they said."""

import contextlib
import math
import multiprocessing
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.context import ForkServerContext
from pathlib import Path

import psutil
from paths import ROOT

from attack.case import Got

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
    seconds: float

    @property
    def has_traceback(self) -> bool:
        return "Traceback (most recent call last)" in self.text

    @property
    def tail(self) -> str:
        return self.text[-1500:]


def environment() -> dict[str, str]:
    """Of a command: this project's packages, whatever is installed."""
    paths = os.pathsep.join([str(ROOT / "workflow"), str(ROOT / "analysis"), str(ROOT)])
    scripts = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    seen = {**os.environ, "PYTHONPATH": paths, "PATH": scripts, "PYTHONUNBUFFERED": "1"}
    seen.pop("DISPLAY", None)
    return seen


def limit_files(largest: int = LARGEST_FILE) -> None:
    """For this process and all it starts: no larger file than this."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


# --- commands as processes ----------------------------------------------------------


def command(name: str, *arguments: object) -> list[str]:
    """Words of ``dragdeck`` or ``dragchain``."""
    return [sys.executable, "-m", f"{name}.cli", *map(str, arguments)]


class Call:
    """A command in a session of its own, which can be attacked while it runs."""

    def __init__(self, words: Sequence[str], folder: Path, log: Path) -> None:
        self.folder, self.log = folder, log
        self._begun = time.monotonic()
        with log.open("wb") as sink:
            self.process = subprocess.Popen(
                words,
                cwd=folder,
                env=environment(),
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=limit_files,
            )

    @property
    def running(self) -> bool:
        return self.process.poll() is None

    def tree(self) -> list[psutil.Process]:
        """The command and all that it started and that still runs."""
        found = []
        for number in [self.process.pid, *_below(self.process.pid)]:
            with contextlib.suppress(psutil.NoSuchProcess):
                found.append(psutil.Process(number))
        return found

    def spent_s(self) -> float:
        """Processor time of the command and all that it started, s."""
        return sum(_spent_s(each) for each in self.tree())

    def wait_until(self, condition: Callable[[], bool], poll_s: float = _POLL_S) -> bool:
        """Wait until something is so while the command runs; whether it came to that."""
        while self.running:
            if condition():
                return True
            if self._is_beyond(PATIENCE_S):
                return False
            time.sleep(poll_s)
        return False

    def _is_beyond(self, patience_s: float) -> bool:
        return self.spent_s() > patience_s or time.monotonic() - self._begun > HUNG_S

    def wait(self, patience_s: float = PATIENCE_S) -> Said:
        """Wait for the end; beyond this processor time everything is killed."""
        status: int | None = None
        while (status := self.process.poll()) is None:
            if self._is_beyond(patience_s):
                kill(self.tree())
                self.process.wait()
                break
            time.sleep(_POLL_S)
        text = self.log.read_text(encoding="utf-8", errors="replace")
        return Said(status, text, time.monotonic() - self._begun)


def call(words: Sequence[str], folder: Path, log: Path, patience_s: float = PATIENCE_S) -> Said:
    """Run a command to its end."""
    return Call(words, folder, log).wait(patience_s)


def kill(processes: Sequence[psutil.Process]) -> None:
    """SIGKILL, all at once."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.send_signal(signal.SIGKILL)


def _below(number: int) -> Iterator[int]:
    """Numbers of all processes that a process started, and that those did."""
    with contextlib.suppress(OSError):
        for task in os.listdir(f"/proc/{number}/task"):
            children = Path(f"/proc/{number}/task/{task}/children").read_text().split()
            for child in map(int, children):
                yield child
                yield from _below(child)


def _spent_s(process: psutil.Process) -> float:
    with contextlib.suppress(psutil.NoSuchProcess):
        times = process.cpu_times()
        return times.user + times.system + times.children_user + times.children_system
    return 0.0


def engines(folder: Path) -> list[psutil.Process]:
    """Engines that run in a folder or below it, whoever started them."""
    return list(_engines(str(folder.resolve())))


def _engines(folder: str) -> Iterator[psutil.Process]:
    for number in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(psutil.Error, OSError):
            if not _is_engine(int(number)):
                continue
            process = psutil.Process(int(number))
            if process.status() == psutil.STATUS_ZOMBIE:
                continue
            below = (process.cwd() + os.sep).startswith(folder + os.sep)
            if below and "-in" in process.cmdline():  # and not one that is asked for its version
                yield process


def is_engine(process: psutil.Process) -> bool:
    """Whether a process is LIGGGHTS itself, and no launcher or supervisor of one."""
    return _is_engine(process.pid)


def _is_engine(number: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{number}/comm").read_text().startswith("liggghts")
    return False


def gone_within(folder: Path, seconds: float) -> bool:
    """Whether no engine of a folder goes on for more than some seconds of processor time."""
    begun: dict[int, float] = {}
    deadline = time.monotonic() + HUNG_S
    while left := engines(folder):
        spent = ((each.pid, _spent_s(each)) for each in left)
        if any(now - begun.setdefault(number, now) > seconds for number, now in spent):
            return False
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_S)
    return True


# --- commands as functions, in a process that has imported them -------------------------


_PRELOADED = (
    *("attack.calls", "dragdeck.commands", "dragdeck.engine.run_folder", "dragchain.tables.write"),
    *("dragchain.network.write", "dragchain.loading.write", "dragchain.report.run_figures"),
    *("dragchain.report.study_report", "pyvista", "meshio", "trimesh", "hypothesis"),
)


def _server() -> ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(_PRELOADED))
    return context


def main_of(
    name: str,
    arguments: Sequence[object],
    folder: Path,
    patience_s: float = 60.0,
    user: int | None = None,
) -> Said:
    """Call ``dragdeck`` or ``dragchain`` in a process that is forked for it, as another user.

    An error that leaves ``main`` is a traceback, as it is on a terminal.
    """
    words = [str(word) for word in arguments]
    return run_function(_main, (name, words, user), folder, patience_s)


def run_function(
    function: Callable[..., None], arguments: tuple[object, ...], folder: Path, patience_s: float
) -> Said:
    """Call a function in a process that is forked for it, its output kept.

    The patience is processor time: the machine may be shared.
    """
    log = folder / f"said.{time.monotonic_ns()}.log"
    begun = time.monotonic()
    process = _server().Process(target=_inside, args=(log, folder, patience_s, function, arguments))
    process.start()
    process.join(HUNG_S)
    status = None if process.exitcode == -signal.SIGXCPU else process.exitcode
    if process.is_alive():
        process.kill()
        process.join()
    text = log.read_text(encoding="utf-8", errors="replace") if log.is_file() else ""
    log.unlink(missing_ok=True)
    return Said(status, text, time.monotonic() - begun)


def _inside(
    log: Path,
    folder: Path,
    patience_s: float,
    function: Callable[..., None],
    arguments: tuple[object, ...],
) -> None:
    limit_files()
    most = math.ceil(patience_s)
    resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    os.chdir(folder)
    sink = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for place in (1, 2):
        os.dup2(sink, place)
    sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
    function(*arguments)


def _main(name: str, words: list[str], user: int | None) -> None:
    if user is not None:
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    sys.exit(import_module(f"{name}.cli").main(words))


# --- what was said --------------------------------------------------------------------

REFUSED = "refused, and named"
"""The outcome that most attacks want: an error message that names what is wrong."""

UNNAMED = "refused, but not named"


def judged(said: Said, *names: str, accepted: str = "accepted") -> Got:
    """What came of a command that was given something it should refuse.

    Parameters
    ----------
    said : Said
    names : str
        Regular expressions: a message that names what is wrong matches all of them.
    accepted : str
        The outcome if it was not refused.
    """
    if said.status is None:
        return Got(f"no answer in {said.seconds:.0f} s", said.tail)
    if said.has_traceback:
        return Got("traceback", said.tail)
    if said.status < 0:
        return Got(f"died of signal {-said.status}", said.tail)
    if said.status == 0:
        return Got(accepted, said.tail)
    missing = [name for name in names if not re.search(name, said.text, re.IGNORECASE)]
    if missing:
        return Got(UNNAMED, f"not in the message: {', '.join(missing)}\n{said.tail}")
    return Got(REFUSED, said.tail)

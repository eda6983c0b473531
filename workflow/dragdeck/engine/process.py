"""The engine as a process: find, start, watch and stop it; one runner in a folder at a time."""

import contextlib
import ctypes
import fcntl
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import psutil

from dragdeck.decks import DECK_FILE
from dragdeck.engine.reports import Report
from dragdeck.errors import EngineError
from dragdeck.files import lock

ENGINE_VARIABLE = "DRAGDECK_ENGINE"
"""Environment variable with the path of an engine of one's own."""

LAUNCHER_VARIABLE = "DRAGDECK_LAUNCHER"
"""Environment variable with a launcher of one's own, for example ``srun --mpi=pmix``."""

_QUEUE_VARIABLES = ("SLURM_", "PMI")
"""Beginnings of the names of a queue's variables."""

OLDEST_VERSION = (3, 8, 0)
"""Oldest engine that the decks were run on."""

LOCK_FILE = ".lock"
_SIGNALS = 65
_POLL_S = 0.2
_PR_SET_PDEATHSIG = 1
Watch = Callable[[float], None]


@dataclass(frozen=True)
class Engine:
    """An engine that can be run.

    Attributes
    ----------
    path : str
    version : str
        As it prints it, for example ``3.8.0``.
    """

    path: str
    version: str


@dataclass(frozen=True)
class Ending:
    """How an engine process ended.

    Attributes
    ----------
    exit_status : int
        Negative: killed by that signal.
    asked : bool
        It was asked to stop.
    wall_time_s : float
    cpu_time_s : float
        Processor time of all ranks together.
    """

    exit_status: int
    asked: bool
    wall_time_s: float
    cpu_time_s: float

    @property
    def signal(self) -> int | None:
        """Number of the signal that killed it; a shell and mpirun add 128 to it."""
        number = -self.exit_status if self.exit_status < 0 else self.exit_status - 128
        return number if 0 < number < _SIGNALS else None


def find_engine() -> Engine:
    """Find LIGGGHTS and its version.

    Raises
    ------
    EngineError
        Not found, not LIGGGHTS, or older than `OLDEST_VERSION`.
    """
    wanted = os.environ.get(ENGINE_VARIABLE, "liggghts")
    path = shutil.which(wanted)
    if path is None:
        raise EngineError(
            f"LIGGGHTS was not found: {wanted!r} is not an executable file\n"
            f"  remedy: install Debian's package liggghts, or set {ENGINE_VARIABLE} "
            "to the path of a LIGGGHTS of your own"
        )
    return Engine(path, _version(path))


@cache
def _version(path: str) -> str:
    words = [*_by_line(path), "-h", "-log", "none"]  # else it writes log.liggghts here
    shown = subprocess.run(
        words,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
        timeout=60,
        env=_environment(words),
    )
    match = re.search(r"LIGGGHTS[^\n]*?(\d+)\.(\d+)\.(\d+)", shown.stdout)
    oldest = ".".join(map(str, OLDEST_VERSION))
    if match is None:
        said = last_words(shown.stderr + shown.stdout) or "nothing"
        raise EngineError(
            f"{path} is not recognised as LIGGGHTS\n"
            f"  value:  exit status {shown.returncode}; it said: {said}\n"
            f"  limit:  LIGGGHTS {oldest} or newer\n  remedy: correct {ENGINE_VARIABLE}"
        )
    version = tuple(int(part) for part in match.groups())
    if version < OLDEST_VERSION:
        raise EngineError(
            f"{path} is too old\n  value:  {'.'.join(match.groups())}\n"
            f"  limit:  {oldest} or newer\n  remedy: install a newer one"
        )
    return ".".join(match.groups())


def last_words(text: str) -> str:
    """The last lines of what a program printed, as one."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return " / ".join(lines[-3:])[-300:]


def command(engine: Engine, deck: str, ranks: int, part: int, source: Path | None) -> list[str]:
    """The command line of a run.

    Parameters
    ----------
    engine : Engine
    deck : str
        Name of the deck file.
    ranks : int
    part : int
        Number of this part of the run, from 1.
    source : Path, optional
        The checkpoint to go on from.
    """
    words = [*plain_command(engine, deck), "-var", "part", str(part)]
    if source is not None:
        words += ["-var", "resume", "1", "-var", "from", source.name]
    if ranks == 1:
        return words
    if launcher_words := _own_launcher():
        return [*launcher_words, "-n", str(ranks), *words]
    launcher = shutil.which("mpirun")
    if launcher is None:
        raise EngineError(
            f"{ranks} MPI ranks are requested, but mpirun is missing\n"
            "  remedy: install Open MPI (it comes with Debian's liggghts), or set ranks to 1"
        )
    idle = ["--mca", "mpi_yield_when_idle", "1"]  # free, and kind to whoever shares the cores
    return [launcher, "-np", str(ranks), "--bind-to", "none", "--oversubscribe", *idle, *words]


def plain_command(engine: Engine, deck: str) -> list[str]:
    """The command line of a script without variables, on one rank."""
    return [*_by_line(engine.path), "-in", deck, "-log", "none"]


def keeps_last_words() -> bool:
    """Whether an error that LIGGGHTS prints before it aborts arrives in a file."""
    return shutil.which("stdbuf") is not None


def _by_line(path: str) -> list[str]:
    """The command of an engine that passes on each line at once, with any launcher.

    LIGGGHTS prints an error of a single rank and calls ``MPI_Abort``, which discards what a file
    or pipe has not got yet.
    """
    return ["stdbuf", "-oL", path] if keeps_last_words() else [path]


def _own_launcher() -> list[str]:
    """The launcher that the user named, if any."""
    words = shlex.split(os.environ.get(LAUNCHER_VARIABLE, ""))
    if words and shutil.which(words[0]) is None:
        raise EngineError(
            f"the MPI launcher was not found: {words[0]!r} is not an executable file\n"
            f"  remedy: correct {LAUNCHER_VARIABLE}, or unset it to use mpirun"
        )
    return words


def execute(words: Sequence[str], folder: Path, screen: Path, watch: Watch) -> Ending:
    """Run the engine to its end.

    SIGINT or SIGTERM to this process ends the engine at once; its last
    checkpoint stays. (The engine can write one more when it gets the signal
    itself, but each rank heeds the signal in a step of its own, and two ranks
    in different steps wait for each other for ever.)

    Parameters
    ----------
    words : sequence of str
        The command line.
    folder : Path
        Where to run.
    screen : Path
        Takes all that the engine prints.
    watch : callable
        Called about five times a second with the seconds since the start.
    """
    begun, launched = time.monotonic(), not {"-n", "-np"}.isdisjoint(words)
    with screen.open("wb") as sink:
        process = subprocess.Popen(
            words,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=sink,
            stderr=subprocess.STDOUT,
            env=_environment(list(words)),
            start_new_session=True,  # a Ctrl-C reaches us, not the engine
            preexec_fn=_ends_with_us(signal.SIGTERM if launched else signal.SIGKILL),
        )
        with _heeding_signals() as asked:
            try:
                while (cpu_time_s := _ended(process)) is None and not asked:
                    watch(time.monotonic() - begun)
                    time.sleep(_POLL_S if time.monotonic() - begun > 1 else 0.02)
            finally:
                if process.returncode is None:
                    end_tree(psutil.Process(process.pid))
                    cpu_time_s = _ended(process, options=0)
    assert cpu_time_s is not None
    return Ending(process.returncode, bool(asked), time.monotonic() - begun, cpu_time_s)


def _ended(process: subprocess.Popen[bytes], options: int = os.WNOHANG) -> float | None:
    """Processor time of a process and all it started, s; None while it runs."""
    pid, status, usage = os.wait4(process.pid, options)
    if pid == 0:
        return None
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def _environment(words: list[str]) -> dict[str, str]:
    """What a command sees of our environment.

    Only a launcher of the user's own sees the queue that we may be in. Open MPI would
    hold a lone engine in a Slurm step for a rank that ``srun`` started, and look for the
    others; ``mpirun`` would ask Slurm for nodes, and our ranks stay on this one.
    """
    launched = words[:1] == _own_launcher()[:1]
    hidden = () if launched else _QUEUE_VARIABLES
    seen = {name: value for name, value in os.environ.items() if not name.startswith(hidden)}
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return {**seen, "OMP_NUM_THREADS": "1", **(allowed if os.geteuid() == 0 else {})}


@contextlib.contextmanager
def _heeding_signals() -> Iterator[list[int]]:
    """While inside, SIGINT and SIGTERM are noted in the list instead of acting."""
    asked: list[int] = []
    before = {}
    with contextlib.suppress(ValueError):  # not the main thread: nobody signals us here
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, lambda got, _: asked.append(got))
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _ends_with_us(number: signal.Signals) -> Callable[[], None] | None:
    """What the engine does before it starts: ask Linux for a signal when this process dies.

    So even ``kill -9`` leaves no engine behind. A launcher gets one that it handles, and ends
    its ranks.
    """
    if sys.platform != "linux":
        return None
    us, system = os.getpid(), ctypes.CDLL(None)

    def ask() -> None:
        system.prctl(_PR_SET_PDEATHSIG, number)
        if os.getppid() != us:  # died meanwhile
            os.kill(os.getpid(), number)

    return ask


@contextlib.contextmanager
def only_runner(folder: Path, report: Report) -> Iterator[None]:
    """Hold the lock of a run folder, and end an engine that was left alone in it.

    The system frees the lock when its holder dies, in whatever way. A living holder is named,
    and waited for: it brings the run to its end.
    """
    with (folder / LOCK_FILE).open("a+", encoding="utf-8") as stream:
        try:
            locked = lock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.seek(0)
            holder = stream.read().strip() or "an unknown process"
            report(f"waiting for another process that runs this folder: {holder}")
            locked = lock(stream, fcntl.LOCK_EX)
        if not locked:
            report("warning: this file system has no locks; let no other process run this folder")
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
            lock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def _engines_in(folder: Path) -> list[psutil.Process]:
    """Processes of this machine that run the deck of a folder."""
    engines = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if DECK_FILE in process.cmdline() and Path(process.cwd()).samefile(folder):
                engines.append(process)
    return engines


def end_tree(top: psutil.Process) -> None:
    """Kill a process and all that it started: mpirun's ranks have groups of their own."""
    with contextlib.suppress(psutil.NoSuchProcess):
        family = [*top.children(recursive=True), top]
        for process in family:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        psutil.wait_procs([process for process in family if process != top], timeout=10)

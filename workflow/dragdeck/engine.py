"""The engine as a process: find it, start it, watch it, stop it kindly."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import psutil

from dragdeck.errors import EngineError

ENGINE_VARIABLE = "DRAGDECK_ENGINE"
"""Environment variable with the path of an engine of one's own."""

OLDEST_VERSION = (3, 8, 0)
"""Oldest engine that the decks were run on."""

POLL_S = 0.2
PATIENCE_S = 60.0
"""How long a run that was asked to stop may take to write its checkpoint."""

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
    """

    exit_status: int
    asked: bool
    wall_time_s: float


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
            f"no engine: {wanted!r} is not an executable file\n"
            f"  remedy: install Debian's package liggghts, or set {ENGINE_VARIABLE} "
            "to the path of a LIGGGHTS of your own"
        )
    return Engine(path, _version(path))


def _version(path: str) -> str:
    shown = subprocess.run([path, "-h"], capture_output=True, text=True, check=False, timeout=60)
    found = re.search(r"LIGGGHTS[^\n]*?(\d+)\.(\d+)\.(\d+)", shown.stdout)
    oldest = ".".join(map(str, OLDEST_VERSION))
    if found is None:
        raise EngineError(
            f"{path} does not say that it is LIGGGHTS\n"
            f"  limit:  LIGGGHTS {oldest} or newer\n  remedy: correct {ENGINE_VARIABLE}"
        )
    version = tuple(int(part) for part in found.groups())
    if version < OLDEST_VERSION:
        raise EngineError(
            f"{path} is too old\n  value:  {'.'.join(found.groups())}\n"
            f"  limit:  {oldest} or newer\n  remedy: install a newer one"
        )
    return ".".join(found.groups())


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
    words = [engine.path, "-in", deck, "-log", f"engine.{part}.log", "-var", "part", str(part)]
    if source is not None:
        words += ["-var", "resume", "1", "-var", "from", source.name]
    if ranks == 1:
        return words
    launcher = shutil.which("mpirun")
    if launcher is None:
        raise EngineError(
            f"{ranks} ranks were asked for, but there is no mpirun\n"
            "  remedy: install Open MPI (it comes with Debian's liggghts), or set ranks to 1"
        )
    return [launcher, "-np", str(ranks), "--bind-to", "none", "--oversubscribe", *words]


def execute(words: Sequence[str], folder: Path, screen: Path, watch: Watch) -> Ending:
    """Run the engine to its end.

    SIGINT or SIGTERM to this process asks the engine's ranks to write a
    checkpoint and stop.

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
    begun = time.monotonic()
    with screen.open("wb") as sink:
        process = subprocess.Popen(
            words,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=sink,
            stderr=subprocess.STDOUT,
            env=_environment(),
            start_new_session=True,  # a Ctrl-C reaches us first, and we ask kindly
        )
        with _asking(process, Path(words[0]).name) as asked:
            try:
                while process.poll() is None:
                    watch(time.monotonic() - begun)
                    if asked and time.monotonic() - asked[0] > PATIENCE_S:
                        os.killpg(process.pid, signal.SIGKILL)
                    time.sleep(POLL_S if time.monotonic() - begun > 1 else 0.02)
            except BaseException:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                raise
    return Ending(process.returncode, bool(asked), time.monotonic() - begun)


def _environment() -> dict[str, str]:
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return {**os.environ, "OMP_NUM_THREADS": "1", **(allowed if os.geteuid() == 0 else {})}


@contextlib.contextmanager
def _asking(process: subprocess.Popen[bytes], name: str) -> Iterator[list[float]]:
    """While inside, a stop signal is handed on to the ranks; its time is noted."""
    asked: list[float] = []

    def hand_on(number: int, frame: FrameType | None) -> None:
        if not asked:
            asked.append(time.monotonic())
            ask_to_stop(process.pid, name)

    before = {}
    with contextlib.suppress(ValueError):  # not the main thread: nobody signals us here
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, hand_on)
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ask_to_stop(pid: int, launcher: str) -> None:
    """Send SIGTERM to the ranks of a run, not to mpirun, which would kill them.

    Parameters
    ----------
    pid : int
        Of the process that `execute` started.
    launcher : str
        Its name: ``mpirun``, or the engine itself when it runs alone.
    """
    with contextlib.suppress(psutil.NoSuchProcess):
        top = psutil.Process(pid)
        ranks = top.children(recursive=True) if launcher == "mpirun" else [top]
        for rank in ranks:
            with contextlib.suppress(psutil.NoSuchProcess):
                rank.send_signal(signal.SIGTERM)


def engine_errors(text: str) -> list[str]:
    """The engine's own ERROR lines, once each, in order."""
    return list(dict.fromkeys(re.findall(r"^.*?(ERROR.*?)\s*$", text, flags=re.MULTILINE)))

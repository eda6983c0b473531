"""The command ``dragdeck``: a table of commands, each with the function that it calls."""

import argparse
import contextlib
import os
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from dragdeck import __version__
from dragdeck.errors import DragdeckError


def _argument(*names: str, **options: Any) -> tuple[tuple[str, ...], dict[str, Any]]:
    """An argument as argparse takes it; its name is that of the function's parameter."""
    return names, options


STUDY = _argument("study", help="name of a folder in studies/")
FIDELITY = _argument("--fidelity", help="fidelity to use instead of the study's own")
PLAN = _argument("--plan", help="use the design points of this plan instead of the study's cases")
VERBOSE = _argument("--verbose", action="store_true", help="say all that is known of every run")
OUT_DIR = _argument("--out", type=Path, required=True, metavar="DIR", help="folder of the results")


@dataclass(frozen=True)
class Command:
    """A command: the function that it calls, and that function's parameters."""

    name: str
    help: str
    function: str
    arguments: tuple[tuple[tuple[str, ...], dict[str, Any]], ...]

    def run(self, options: dict[str, Any]) -> None:
        """Import the function and call it."""
        module, _, name = self.function.partition(":")
        getattr(import_module(f"dragdeck.{module}"), name)(**options)


COMMANDS = (
    Command("check", "check a study and LIGGGHTS without running anything", "commands:check",
            (STUDY, FIDELITY, VERBOSE)),
    Command("explain", "what the input scripts model, leave out and cost", "commands:explain", (
        STUDY, FIDELITY, VERBOSE,
        _argument("scene", nargs="?", help="drop_test, filling or process; default: all"))),
    Command("status", "what is done, running, failed or waiting, and how long it will take",
            "status:status", (STUDY, FIDELITY, PLAN, VERBOSE)),
    Command("open", "print the path of a study's report, and open it where there is a display",
            "status:open_report", (STUDY,)),
    Command("preview", "draw what a study describes, without running anything", "commands:preview",
            (STUDY, FIDELITY, _argument("--case", help="case to draw (default: the first)"))),
    Command("new", "make a study that extends another", "commands:new", (
        _argument("study", help="its name"),
        _argument("--from", default="uhlmann2015", metavar="STUDY", dest="base",
                  help="the study that it extends (default: %(default)s)"))),
    Command("cases", "list the cases of a study and their runs", "commands:cases",
            (STUDY, FIDELITY, PLAN)),
    Command("advise", "find settings for a tolerance, with their error and cost",
            "commands:advise", (
        STUDY, FIDELITY,
        _argument("--tolerance", type=float, help="tolerance to use instead of the study's own"),
        _argument("--quantity", help="quantity to which the tolerance applies"),
        _argument("--quick", action="store_true", help="do not measure the speed of LIGGGHTS"))),
    Command("run", "run the input script in a folder, or resume it",
            "engine.run_folder:run_command", (
        _argument("folder", type=Path),
        _argument("--outcome", type=Path, metavar="FILE",
                  help="write the result to FILE and succeed even if the run is rejected"),
        _argument("--again", action="store_true",
                  help="start again even if the run was rejected before"),
        _argument("--patience", type=float, default=1800.0, metavar="S", dest="patience_s",
                  help="seconds without any output after which LIGGGHTS is ended"))),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("render", "write the input script of one run", "commands:render", (
        STUDY, FIDELITY, PLAN,
        _argument("scene", help="drop_test, filling or process"),
        _argument("run", help="run id, as `dragdeck cases` lists it"),
        _argument("--packing", type=Path, help="packing.json of the settled bed (process)"))),
    Command("drops", "run the drop tests that a calibration needs",
            "campaigns.restitution_drops:drops_command", (
                STUDY, FIDELITY, OUT_DIR,
                _argument("set", choices=("sweep", "confirm", "trials")),
                _argument("--fit", type=Path, help="result.json of the fit (confirm)"),
                _argument("--count", type=int, default=10, help="number of trials (trials)"),
                _argument("--seed", type=int, default=1, help="seed of the trials (trials)"))),
)  # fmt: skip
"""What the rules call: ``dragdeck step NAME``."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; see `guarded`."""
    options = vars(_parser().parse_args(arguments))
    command = options.pop("_command")
    return guarded(lambda: command.run(options))


def guarded(call: Callable[[], None]) -> int:
    """Call a function; whatever goes wrong becomes one message on standard error.

    What nobody expected goes to a log file with its traceback, and the message names the file.

    Returns
    -------
    int
        The exit status: 0, 1 after an error, 130 if the user interrupted it.
    """
    try:
        call()
        sys.stdout.flush()
    except BrokenPipeError:  # who reads the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        print("dragdeck: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        print(f"dragdeck: {_told(error)}", file=sys.stderr)
        return 1
    return 0


def _told(error: Exception) -> str:
    """What the user is told of an error."""
    if isinstance(error, DragdeckError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        remedy = "check that the place is there, who may read and write it, and its free space"
        return f"{where}{error.strerror}\n  remedy: {remedy}"
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error}\n  remedy: use a machine with more memory"
    return (
        f"unexpected error: {type(error).__name__}: {str(error)[:300]}\n  log:    {_kept(error)}\n"
        "  remedy: if an input file was damaged, make it again; else report this with the log,"
        " see README.md, section Reporting a problem"
    )


def _kept(error: Exception) -> str:
    """Write an error with its traceback to a new file here, or where temporary files go."""
    said = "".join(traceback.format_exception(error))
    about = f"dragdeck {__version__}, Python {sys.version}, {platform.platform()}"
    for folder in (".", tempfile.gettempdir()):
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(".log", "dragdeck-error-", folder)
            with open(number, "w", encoding="utf-8", errors="replace") as stream:
                stream.write(f"{about}\n{shlex.join(sys.argv)}\n\n{said}")
            return name
    return f"none could be written\n{said}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dragdeck", description="From a study file to LIGGGHTS input scripts and runs."
    )
    parser.add_argument("--version", action="version", version=f"dragdeck {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, COMMANDS)
    step = commands.add_parser("step", help="a step of the workflow: dragdeck step --help")
    _add(step.add_subparsers(required=True, metavar="STEP"), STEPS)
    return parser


def _add(parsers: Any, commands: Sequence[Command]) -> None:
    for command in commands:
        parser = parsers.add_parser(command.name, help=command.help, description=command.help)
        for names, options in command.arguments:
            parser.add_argument(*names, **options)
        parser.set_defaults(_command=command)


if __name__ == "__main__":
    sys.exit(main())

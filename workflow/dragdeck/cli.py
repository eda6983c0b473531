"""The command ``dragdeck``: a table of commands, each with the function that it calls."""

import argparse
import contextlib
import os
import platform
import shlex
import shutil
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
from dragdeck.files import FULL_DISK


def _argument(*names: str, **options: Any) -> tuple[tuple[str, ...], dict[str, Any]]:
    """An argument as argparse takes it; its name is that of the function's parameter."""
    return names, options


STUDY = _argument("study", metavar="STUDY", help="name of the study: a folder in studies/")
FIDELITY = _argument(
    "--fidelity", metavar="NAME",
    help="use these settings for speed and accuracy instead of the study's: draft, standard, fine, "
    "full, reference, or a name under fidelities in the study (default: those of the study)",
)  # fmt: skip
PLAN = _argument(
    "--plan", metavar="NAME",
    help="use the design points of this plan in workflow/plans/ instead of the study's cases",
)  # fmt: skip
OUT_DIR = _argument(
    "--out", type=Path, required=True, metavar="DIR", help="folder for the results; required"
)
SCENE = "drop_test, filling or process"


@dataclass(frozen=True)
class Command:
    """A command: the function that it calls, and that function's parameters.

    `help` is for the list of commands, `about` for the command's own help.
    """

    name: str
    help: str
    about: str
    function: str
    arguments: tuple[tuple[tuple[str, ...], dict[str, Any]], ...]
    example: str = ""

    def run(self, options: dict[str, Any]) -> None:
        """Import the function and call it."""
        module, _, name = self.function.partition(":")
        getattr(import_module(f"dragdeck.{module}"), name)(**options)


COMMANDS = (
    Command("check", "check a study without running it",
            "Check a study: build every input script in memory, look for LIGGGHTS, and print the "
            "expected number and cost of the runs, and warnings. It reads studies/STUDY and writes "
            "nothing.",
            "commands:check", (
        STUDY, FIDELITY,
        _argument("--verbose", action="store_true",
                  help="also print time step, packing and clearances expected for each run")),
            "dragdeck check uhlmann2015 --fidelity draft"),
    Command("explain", "explain what the input scripts model",
            "Explain what the input scripts of a study model, what they leave out, and what both "
            "cost. It reads studies/STUDY and the speeds of earlier runs, and writes nothing.",
            "commands:explain", (
        STUDY, FIDELITY,
        _argument("--verbose", action="store_true",
                  help="print every run, with reasons, costs and expectations"),
        _argument("scene", nargs="?", metavar="SCENE",
                  help=f"explain one scene only: {SCENE} (default: all three)")),
            "dragdeck explain uhlmann2015 process"),
    Command("status", "show the progress of a study",
            "Show which runs of a study are complete, running, interrupted, failed or waiting, and "
            "how long the remaining ones will take. It reads results/STUDY and writes nothing, so "
            "it can be called at any time.",
            "status:status", (
        STUDY, FIDELITY, PLAN,
        _argument("--verbose", action="store_true",
                  help="list every run (default: all failed, at most eight of each other state)")),
            "dragdeck status uhlmann2015"),
    Command("open", "open the report of a study",
            "Print the path of results/STUDY/report/report.html and open it if there is a display.",
            "status:open_report", (STUDY,)),
    Command("preview", "draw the set-up of a study",
            "Draw bowl, packing, workpiece and path of one case, and print its clearances and "
            "dimensionless numbers. It runs nothing and writes preview.png, preview.html and "
            "set_up.png to results/STUDY.",
            "commands:preview", (
        STUDY, FIDELITY,
        _argument("--case", metavar="NAME",
                  help="case to draw, as dragdeck cases lists it (default: the first)")),
            "dragdeck preview planetary"),
    Command("new", "create a study",
            "Create studies/STUDY/study.yaml, a study that extends another: fields that it does "
            "not set are taken from the other study.",
            "commands:new", (
        _argument("study", metavar="STUDY", help="name of the new study, without spaces"),
        _argument("--from", default="uhlmann2015", metavar="STUDY", dest="base",
                  help="study to extend (default: %(default)s)")),
            "dragdeck new my-part --from uhlmann2015"),
    Command("cases", "list the cases of a study",
            "List the cases of a study with the run ids of their drop test, filling and process. "
            "It reads studies/STUDY and writes nothing.",
            "commands:cases", (STUDY, FIDELITY, PLAN)),
    Command("advise", "find settings for a tolerance",
            "Find the cheapest settings that keep the error of a quantity within a tolerance, and "
            "show the error and cost of each setting. It reads the measured trade-off, measures "
            "the speed of LIGGGHTS on this machine, and writes results/STUDY/advice.json.",
            "commands:advise", (
        STUDY, FIDELITY,
        _argument("--tolerance", type=float, metavar="X",
                  help="largest relative error caused by the settings, from 0 to 1 (default: "
                  "the study's, or 0.05)"),
        _argument("--quantity", metavar="NAME",
                  help="quantity to which the tolerance applies, for example drag_mean, drag_std, "
                  "workpiece_contacts or restitution; docs/reference/study.md lists all (default: "
                  "the study's, or drag_mean)"),
        _argument("--quick", action="store_true",
                  help="estimate costs from earlier runs instead of measuring the speed here")),
            "dragdeck advise uhlmann2015 --tolerance 0.05 --quantity drag_mean"),
    Command("run", "run or resume one input script",
            "Run the input script in.liggghts of a run folder with LIGGGHTS, or resume it from its "
            "last checkpoint, and apply the acceptance checks. It writes the raw output and "
            "state.json to that folder.",
            "engine.run_folder:run_command", (
        _argument("folder", type=Path, metavar="RUN_DIR",
                  help="folder of the run: results/STUDY/SCENE/RUN"),
        _argument("--outcome", type=Path, metavar="FILE",
                  help="write the result of the run to FILE and exit with 0 even if the run is "
                  "rejected (default: exit with 1)"),
        _argument("--again", action="store_true",
                  help="start again from the beginning if the run was rejected before"),
        _argument("--patience", type=float, default=1800, metavar="S", dest="patience_s",
                  help="terminate LIGGGHTS after this many seconds without output (default: "
                  "%(default)s)")),
            "dragdeck run results/uhlmann2015/filling/RUN"),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("render", "write the input script of one run",
            "Write in.liggghts, case.json, columns.json, initial particles and meshes of one run "
            "to results/STUDY/SCENE/RUN.",
            "commands:render", (
        STUDY, FIDELITY, PLAN,
        _argument("scene", metavar="SCENE", help=f"scene of the run: {SCENE}"),
        _argument("run", metavar="RUN", help="run id, as dragdeck cases lists it"),
        _argument("--packing", type=Path, metavar="FILE",
                  help="packing.json of the settled packing; required for a process"))),
    Command("drops", "run the drop tests of a calibration",
            "Run the drop tests that the calibration of the restitution requires, and write "
            "drops.json to the folder.",
            "campaigns.restitution_drops:drops_command", (
                STUDY, FIDELITY, OUT_DIR,
                _argument("set", choices=("sweep", "confirm"),
                          help="sweep: a range of restitutions; confirm: the fitted one"),
                _argument("--fit", type=Path, metavar="FILE",
                          help="result.json of the fit; required for confirm"))),
)  # fmt: skip
"""What the rules call: ``dragdeck step NAME``."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; see `guarded`."""
    options = vars(_parser().parse_args(arguments))
    command = options.pop("_command")
    return guarded(lambda: command.run(options))


def guarded(call: Callable[[], None]) -> int:
    """Call a function; whatever goes wrong becomes one message on standard error.

    An unexpected error is written to a log file with its traceback; the message names the file.

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
        print(f"dragdeck: {_message(error)}", file=sys.stderr)
        return 1
    return 0


def _message(error: Exception) -> str:
    """The message of an error."""
    if isinstance(error, DragdeckError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        remedy = "check that the path exists, its permissions, and the free space on the disk"
        if error.errno in FULL_DISK:
            place = Path(error.filename or ".").resolve().parent
            free = shutil.disk_usage(place if place.is_dir() else ".").free
            where, remedy = f"{where}{free:,} bytes free: ", "free disk space, then try again"
        return f"{where}{error.strerror}\n  remedy: {remedy}"
    if isinstance(error, MemoryError):
        return f"not enough memory: {error}\n  remedy: use a machine with more memory"
    return (
        f"unexpected error: {type(error).__name__}: {str(error)[:300]}\n  log:    {_kept(error)}\n"
        "  remedy: if an input file is damaged, create it again; otherwise report the problem with "
        "the log: README.md, section Reporting a problem"
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
        prog="dragdeck",
        description="Write LIGGGHTS input scripts for the cases of a study, run and check them.",
        epilog="Each command has its own help: dragdeck COMMAND --help",
    )
    parser.add_argument("--version", action="version", version=f"dragdeck {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, COMMANDS)
    step = commands.add_parser("step", help="run a step of the workflow: dragdeck step --help")
    _add(step.add_subparsers(required=True, metavar="STEP"), STEPS)
    return parser


def _add(parsers: Any, commands: Sequence[Command]) -> None:
    for command in commands:
        example = f"example: {command.example}" if command.example else None
        parser = parsers.add_parser(
            command.name, help=command.help, description=command.about, epilog=example
        )
        for names, options in command.arguments:
            parser.add_argument(*names, **options)
        parser.set_defaults(_command=command)


if __name__ == "__main__":
    sys.exit(main())

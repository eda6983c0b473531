"""The command ``dragchain``: a table of commands, each with the function that it calls."""

import argparse
import contextlib
import math
import os
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dragchain.errors import DragchainError


@dataclass(frozen=True)
class Argument:
    """An argument as argparse takes it; its name is that of the function's parameter."""

    names: tuple[str, ...]
    options: Mapping[str, Any]


def _argument(*names: str, **options: Any) -> Argument:
    return Argument(names, options)


RUN_DIR = _argument("run_dir", type=Path, metavar="RUN_DIR", help="folder of one run")
RUN_DIRS = _argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="run folders")
OUT_DIR = _argument(
    "--out", type=Path, required=True, metavar="DIR", dest="out_dir", help="folder of the results"
)
MADE_BY = _argument("--command", help="command that made the runs, for the record")
DROPS = _argument("--drops", type=Path, required=True, dest="drops_file", help="drops.json")
RECORD = _argument("record", type=Path, metavar="RECORD", help="CSV of force against time")
STIFFNESS = _argument("--record", type=Path, required=True, metavar="FILE", help="stiffness.json")
MEASURES = _argument(
    "measures", type=Path, nargs="+", metavar="MEASURES", help="measures.json of the runs"
)


@dataclass(frozen=True)
class Command:
    """A command: the function that it calls, and that function's parameters.

    What the function returns is printed if it is text.
    """

    name: str
    help: str
    function: str
    arguments: tuple[Argument, ...]

    def run(self, options: Mapping[str, object]) -> None:
        """Import the function and call it."""
        module, _, name = self.function.partition(":")
        said = getattr(import_module(f"dragchain.{module}"), name)(**options)
        if isinstance(said, str):
            print(said)


COMMANDS = (
    Command("tables", "make the tables of a run from its raw outputs", "tables.write:write_tables",
            (RUN_DIR,)),
    Command("chains", "find contact network and force chains of a run, from its tables",
            "network.write:write_chains", (RUN_DIR,)),
    Command("loading", "map load, sliding and friction work on the workpiece",
            "loading.write:write_loading", (RUN_DIR,)),
    Command("figures", "draw the figures of a run, from its tables",
            "report.run_figures:write_figures",
            (RUN_DIR,)),
    Command("network", "write the interactive page on a run's contact network",
            "network_page.page:write_page", (RUN_DIR,)),
    Command("journal", "draw the figures of a process run for a publication",
            "report.journal:write_journal_figures", (
        RUN_DIR,
        _argument("--paper-colours", action="store_true",
                  help="forces from green to red, as in Uhlmann et al. (2015)"),
    )),
    Command("export", "export a run to ParaView or OVITO", "export.write:export_command", (
        RUN_DIR,
        _argument("--to", required=True, choices=("paraview", "xyz"),
                  help="VTP files with a PVD time series, or extended XYZ"),
        _argument("--out", type=Path, metavar="DIR", help="default: export/TO in the run's folder"),
        _argument("--from-time", type=float, metavar="S", help="first simulated time, s"),
        _argument("--to-time", type=float, metavar="S", help="last simulated time, s"),
        _argument("--every", type=int, default=1, metavar="N", help="every N-th frame only"),
        _argument("--replace", action="store_true", help="overwrite an earlier export"))),
    Command("report", "write the report on the process runs of a study",
            "report.study_report:write_report", (
        OUT_DIR, RUN_DIRS,
        _argument("--advice", type=Path, metavar="FILE", help="advice.json of the study"))),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("numbers", "print where a report is, and its main numbers",
            "report.numbers:main_numbers",
            (_argument("report_dir", type=Path, metavar="REPORT_DIR"),)),
    Command("measure", "make tables, chains and measures of a run of a plan",
            "tradeoff.measure_run:write_measures", (
                RUN_DIR,
                _argument("--packing", type=Path, required=True, dest="packing_table",
                          help="packing.json of its packing"))),
    Command("tradeoff", "write the report on speed and accuracy",
            "tradeoff.report:write_tradeoff", (
        OUT_DIR, MEASURES, MADE_BY,
        _argument("--reference", type=Path, required=True, metavar="RUN_DIR",
                  dest="reference_run", help="a run at the reference settings"),
        _argument("--drops", type=Path, nargs="*", default=[], metavar="RUN_DIR",
                  help="drop tests"),
        _argument("--costs", type=Path, metavar="FILE", help="costs.json"),
        _argument("--promises", type=Path, metavar="FILE", help="promises.json"),
        _argument("--plan", default="", metavar="NAME", help="name of the plan"),
        _argument("--largest-step", type=float, default=math.inf,
                  help="largest fraction of the Rayleigh time to recommend"))),
    Command("promises", "test the advisor's predictions on other scenes",
            "tradeoff.promises:promises_command", (OUT_DIR, MEASURES, STIFFNESS)),
    Command("stiffness", "fit what a reduced Young's modulus does to each quantity",
            "tradeoff.stiffness_record:stiffness_command", (
                MEASURES,
                _argument("--out", type=Path, required=True, metavar="FILE", dest="out_file",
                          help="stiffness.json"),
                _argument("--tradeoff", type=Path, required=True, metavar="FILE",
                          help="tradeoff.json of a scene to check the laws with"))),
    Command("extrapolate", "extrapolate a run's quantities to the physical Young's modulus",
            "tradeoff.extrapolate:extrapolate_run", (RUN_DIR, STIFFNESS)),
    Command("scaling", "fit a power law of the mean drag over one field",
            "scaling.fit:scaling_command", (
        OUT_DIR, RUN_DIRS, MADE_BY,
        _argument("--field", required=True, help="dotted name of the field"),
        _argument("--expected", type=float, metavar="N", help="expected exponent"),
        _argument("--source", help="source of the expected exponent"),
        _argument("--fit-range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                  help="levels for which the exponent is expected"))),
    Command("crate", "write a study's inputs, runs and report as an RO-Crate",
            "report.crate:write_crate", (
        OUT_DIR, RUN_DIRS,
        _argument("--report", type=Path, required=True, metavar="DIR", dest="report_dir",
                  help="folder of the study's report"),
        _argument("--inputs", type=Path, nargs="*", default=[], metavar="FILE",
                  help="study files, templates and meshes"),
        _argument("--licence", metavar="TEXT", help="licence of the results"))),
    Command("record", "find the impacts of a measured drop test",
            "calibration.results:write_record", (
        RECORD,
        _argument("--fall-time", type=float, required=True, metavar="S", dest="fall_time_s",
                  help="free fall before the first impact, s"),
        _argument("--out", type=Path, required=True, metavar="FILE", help="record.json"))),
    Command("calibrate", "fit the restitution to a measured drop test",
            "calibration.results:calibrate_command", (RECORD, DROPS, OUT_DIR)),
    Command("trials", "recover known restitutions from synthetic records",
            "calibration.trials:write_trials", (
                DROPS,
                _argument("--trials", type=Path, required=True, dest="trials_file",
                          help="drops.json of the trials"),
                _argument("--seed", type=int, default=1,
                          help="seed of the sensors and their noise"),
                _argument("--records", type=int, default=1, help="number of records per drop"),
                _argument("--out", type=Path, required=True, metavar="FILE", help="trials.json"))),
    Command("calibration-report", "write figures and page of a calibration",
            "calibration.report:write_report", (
                RECORD,
                _argument("folder", type=Path, metavar="DIR", help="folder of the calibration"))),
)  # fmt: skip
"""What the rules call: ``dragchain step NAME``."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; see `guarded`.

    Parameters
    ----------
    arguments : sequence of str, optional
        The arguments, without the command's name; those of the process if None. A wrong use of
        the command exits with 2.
    """
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
        print("dragchain: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        print(f"dragchain: {_told(error)}", file=sys.stderr)
        return 1
    return 0


def _told(error: Exception) -> str:
    """What the user is told of an error."""
    if isinstance(error, DragchainError):
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
    about = f"dragchain, Python {sys.version}, {platform.platform()}"
    for folder in (".", tempfile.gettempdir()):
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(".log", "dragchain-error-", folder)
            with open(number, "w", encoding="utf-8", errors="replace") as stream:
                stream.write(f"{about}\n{shlex.join(sys.argv)}\n\n{said}")
            return name
    return f"none could be written\n{said}"


if TYPE_CHECKING:
    Parsers = argparse._SubParsersAction[argparse.ArgumentParser]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dragchain", description="Tables, figures and reports of what LIGGGHTS wrote."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, COMMANDS)
    step = commands.add_parser("step", help="a step of the workflow: dragchain step --help")
    _add(step.add_subparsers(required=True, metavar="STEP"), STEPS)
    return parser


def _add(parsers: "Parsers", commands: Sequence[Command]) -> None:
    for command in commands:
        parser = parsers.add_parser(command.name, help=command.help, description=command.help)
        for argument in command.arguments:
            parser.add_argument(*argument.names, **argument.options)
        parser.set_defaults(_command=command)


if __name__ == "__main__":
    sys.exit(main())

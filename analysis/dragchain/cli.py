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


RUN_DIR = _argument("run_dir", type=Path, metavar="RUN_DIR",
                    help="folder of the run: results/STUDY/SCENE/RUN")  # fmt: skip
RUN_DIRS = _argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR",
                     help="folders of the runs: results/STUDY/process/RUN")  # fmt: skip
OUT_DIR = _argument("--out", type=Path, required=True, metavar="DIR", dest="out_dir",
                    help="folder for the results; required")  # fmt: skip
MADE_BY = _argument("--command", metavar="TEXT",
                    help="command that made the runs, to be recorded with the results")  # fmt: skip
DROPS = _argument("--drops", type=Path, required=True, metavar="FILE", dest="drops_file",
                  help="drops.json of the simulated drop tests (sweep); required")  # fmt: skip
RECORD = _argument("record", type=Path, metavar="RECORD",
                   help="measured drop test: CSV file of force against time")  # fmt: skip
WINDOWS_RECORD = _argument(
    "--record", type=Path, required=True, metavar="FILE",
    help="windows.json, what windows of other scenes say; required",
)  # fmt: skip
MEASURES = _argument("measures", type=Path, nargs="+", metavar="MEASURES",
                     help="measures.json of each run, made by dragchain step measure")  # fmt: skip


@dataclass(frozen=True)
class Command:
    """A command: the function that it calls, and that function's parameters.

    `help` is for the list of commands, `about` for the command's own help. What the function
    returns is printed if it is text.
    """

    name: str
    help: str
    about: str
    function: str
    arguments: tuple[Argument, ...]
    example: str = ""

    def run(self, options: Mapping[str, object]) -> None:
        """Import the function and call it."""
        module, _, name = self.function.partition(":")
        said = getattr(import_module(f"dragchain.{module}"), name)(**options)
        if isinstance(said, str):
            print(said)


COMMANDS = (
    Command("tables", "make the tables of a run",
            "Make the tables of a run. It reads the raw output, case.json and columns.json in "
            "RUN_DIR and writes Parquet tables and documents to RUN_DIR/tables.",
            "tables.write:write_tables", (RUN_DIR,),
            "dragchain tables results/uhlmann2015/process/RUN"),
    Command("chains", "find contact networks and force chains",
            "Find the contact network, its clusters and force chains in each frame of a process "
            "run. It reads the tables of the run and writes network.parquet, clusters.parquet and "
            "chains.parquet to RUN_DIR/tables.",
            "network.write:write_chains", (RUN_DIR,)),
    Command("loading", "map the load on the workpiece",
            "Map load, sliding distance and friction work on the workpiece and classify its "
            "contact events. It reads the tables of a process run and writes facets.parquet, "
            "contact_events.parquet, loading.json and workpiece.vtp to RUN_DIR/tables.",
            "loading.write:write_loading", (RUN_DIR,)),
    Command("figures", "draw the figures of a run",
            "Draw the figures of a run. It reads the tables and writes PNG files to "
            "RUN_DIR/figures and their values to RUN_DIR/tables/figures.json.",
            "report.run_figures:write_figures", (RUN_DIR,)),
    Command("network", "write the interactive page on the contact network",
            "Write network.html, an interactive page on the contact network of a process run. It "
            "reads the tables and force chains of the run and writes the page to RUN_DIR.",
            "network_page.page:write_page", (RUN_DIR,)),
    Command("journal", "draw the figures of a run for a publication",
            "Draw the figures of a process run in the format of a journal, as SVG, PDF and PNG. It "
            "reads the tables and figures.json of the run and writes to RUN_DIR/figures/journal.",
            "report.journal:write_journal_figures", (
        RUN_DIR,
        _argument("--paper-colours", action="store_true",
                  help="show forces from green to red, as in Uhlmann et al. (2015) (default: "
                  "a map for every kind of colour vision)"))),
    Command("export", "export a run to ParaView or OVITO",
            "Export the frames of a run to other programs. It reads the tables of the run and "
            "writes one file per frame for ParaView, or one file for OVITO.",
            "export.write:export_command", (
        RUN_DIR,
        _argument("--to", required=True, choices=("paraview", "xyz"),
                  help="paraview: VTP files with a PVD time series; xyz: extended XYZ for OVITO; "
                  "required"),
        _argument("--out", type=Path, metavar="DIR",
                  help="folder for the export (default: export/paraview or export/xyz in RUN_DIR)"),
        _argument("--from-time", type=float, metavar="S",
                  help="simulated time of the first frame, s (default: start of the run)"),
        _argument("--to-time", type=float, metavar="S",
                  help="simulated time of the last frame, s (default: end of the run)"),
        _argument("--every", type=int, default=1, metavar="N",
                  help="export every N-th frame only (default: %(default)s)"),
        _argument("--replace", action="store_true",
                  help="overwrite an earlier export (default: refuse to)")),
            "dragchain export results/uhlmann2015/process/RUN --to paraview --every 10"),
    Command("report", "write the report on a study",
            "Write the report on the process runs of a study. It reads their tables and figures "
            "and writes report.html and summary.csv, .parquet and .xlsx to the folder.",
            "report.study_report:write_report", (
        OUT_DIR, RUN_DIRS,
        _argument("--advice", type=Path, metavar="FILE",
                  help="advice.json, made by dragdeck advise, to compare its predicted costs "
                  "with the actual ones"),
        _argument("--preview", type=Path, metavar="FILE",
                  help="picture of the set-up, set_up.png of dragdeck preview, for the report"))),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("numbers", "print the main numbers of a report",
            "Print the path of a report and the mean drag of each case. It reads summary.parquet.",
            "report.summary:main_numbers",
            (_argument("report_dir", type=Path, metavar="REPORT_DIR",
                       help="folder of the report: results/STUDY/report"),)),
    Command("measure", "measure a run of a plan",
            "Make tables and force chains of one run of a plan and measure its quantities. It "
            "reads the raw output and outcome.json of the run and writes measures.json to RUN_DIR.",
            "tradeoff.measure_run:write_measures", (
                RUN_DIR,
                _argument("--packing", type=Path, required=True, metavar="FILE",
                          dest="packing_table",
                          help="packing.json of the packing at the start of the run; required"))),
    Command("tradeoff", "write the report on the speed-accuracy trade-off",
            "Estimate the error and cost of each setting from the runs of a plan. It reads "
            "measures.json of the runs and writes report.html, tradeoff.json, runs.csv and "
            "errors.csv to the folder.",
            "tradeoff.report:write_tradeoff", (
        OUT_DIR, MEASURES, MADE_BY,
        _argument("--reference", type=Path, required=True, metavar="RUN_DIR",
                  dest="reference_run", help="folder of a run at the reference settings; required"),
        _argument("--drops", type=Path, nargs="*", default=[], metavar="RUN_DIR",
                  help="folders of drop tests with other settings (default: none)"),
        _argument("--costs", type=Path, metavar="FILE",
                  help="costs.json: measured CPU time of model and output options"),
        _argument("--plan", default="", metavar="NAME", help="name of the plan, for the report"),
        _argument("--largest-step", type=float, default=math.inf, metavar="X",
                  help="largest time step to recommend, as a fraction of the Rayleigh time "
                  "(default: no limit)"))),
    Command("extrapolate", "quantities of a run, and at the physical Young's modulus",
            "Measure the quantities of a run, and take those at the physical Young's modulus from "
            "its windows, if it has any. It reads the tables of the run and writes "
            "extrapolated.json to RUN_DIR.",
            "windows.extrapolate:extrapolate_run", (
                RUN_DIR, WINDOWS_RECORD,
                _argument("--round", type=Path, metavar="FILE", dest="round_file",
                          help="last round of windows of the run, from dragchain step windows"))),
    Command("windows", "what windows say of a run at the physical Young's modulus",
            "Estimate the quantities of a run with reduced moduli at the physical Young's modulus "
            "from its windows, and how many more windows the tolerance requires. It reads the "
            "tables of the run and the raw output of the windows.",
            "windows.rounds:judge_windows", (
                RUN_DIR,
                _argument("--windows", type=Path, nargs="+", required=True, metavar="RUN_DIR",
                          help="folder of each window so far; required"),
                _argument("--before", type=Path, metavar="FILE",
                          help="the round before, whose windows are not measured again"),
                _argument("--tolerance", type=float, required=True, metavar="X",
                          help="relative half-width of the 95 %% confidence interval; required"),
                _argument("--quantities", nargs="+", required=True, metavar="NAME",
                          help="quantities to which the tolerance applies; required"),
                _argument("--most", type=int, required=True, metavar="N",
                          help="largest number of windows; required"),
                WINDOWS_RECORD,
                _argument("--out", type=Path, required=True, metavar="FILE",
                          help="file to write; required"))),
    Command("scaling", "fit a power law to the mean drag",
            "Fit a power law of the mean drag as a function of one field of the study. It reads "
            "the tables of the runs and writes scaling.json, .csv and .png to the folder.",
            "scaling.fit:scaling_command", (
        OUT_DIR, RUN_DIRS, MADE_BY,
        _argument("--field", required=True, metavar="FIELD",
                  help="dotted name of the field, for example motion.immersion_depth_m; required"),
        _argument("--expected", type=float, metavar="N",
                  help="expected exponent, with which the fitted one is compared"),
        _argument("--source", metavar="TEXT", help="source of the expected exponent"),
        _argument("--fit-range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                  help="lowest and highest level at which the exponent is expected (default: all "
                  "levels)"))),
    Command("crate", "pack a study as an RO-Crate",
            "Pack the inputs, runs and report of a study as an RO-Crate, with a checksum for each "
            "file. It reads the given folders and writes the crate to the folder.",
            "report.crate:write_crate", (
        OUT_DIR, RUN_DIRS,
        _argument("--report", type=Path, required=True, metavar="DIR", dest="report_dir",
                  help="folder of the study's report; required"),
        _argument("--inputs", type=Path, nargs="*", default=[], metavar="FILE",
                  help="study files, templates and meshes to include (default: none)"),
        _argument("--licence", metavar="TEXT",
                  help="licence of the results: SPDX name or address (default: unknown)"))),
    Command("record", "find the impacts of a measured drop test",
            "Find the impacts in the force record of a drop test. It reads the CSV file and writes "
            "record.json.",
            "calibration.results:write_record", (
        RECORD,
        _argument("--fall-time", type=float, required=True, metavar="S", dest="fall_time_s",
                  help="duration of the free fall before the first impact, s; required"),
        _argument("--out", type=Path, required=True, metavar="FILE",
                  help="file to write: record.json; required"))),
    Command("calibrate", "fit the restitution to a measured drop test",
            "Fit the coefficient of restitution to a measured drop test. It reads the CSV file and "
            "the simulated drop tests, writes result.json, impacts.csv and bias.csv to the folder, "
            "and prints the value for the study.",
            "calibration.results:calibrate_command", (RECORD, DROPS, OUT_DIR)),
    Command("calibration-report", "write the report on a calibration",
            "Write the report on a calibration. It reads the CSV file and the results in DIR, and "
            "writes report.html and figures to DIR.",
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
        print("dragchain: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        print(f"dragchain: {_message(error)}", file=sys.stderr)
        return 1
    return 0


def _message(error: Exception) -> str:
    """The message of an error."""
    if isinstance(error, DragchainError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        remedy = "check that the path exists, its permissions, and the free space on the disk"
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
        prog="dragchain",
        description="Make tables, figures and reports from the output of LIGGGHTS.",
        epilog="Each command has its own help: dragchain COMMAND --help",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, COMMANDS)
    step = commands.add_parser("step", help="run a step of the workflow: dragchain step --help")
    _add(step.add_subparsers(required=True, metavar="STEP"), STEPS)
    return parser


def _add(parsers: "Parsers", commands: Sequence[Command]) -> None:
    for command in commands:
        example = f"example: {command.example}" if command.example else None
        parser = parsers.add_parser(
            command.name, help=command.help, description=command.about, epilog=example
        )
        for argument in command.arguments:
            parser.add_argument(*argument.names, **argument.options)
        parser.set_defaults(_command=command)


if __name__ == "__main__":
    sys.exit(main())

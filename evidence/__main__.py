"""Commands behind verification suite, stability map and validation: python -m evidence."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from dragchain.errors import DragchainError
from dragdeck.cli import FIDELITY, STUDY, guarded
from dragdeck.errors import DragdeckError

Argument = tuple[tuple[str, ...], dict[str, Any]]

_OUT_DIR: Argument = ("--out",), {
    "type": Path, "required": True, "dest": "out_dir", "metavar": "DIR",
    "help": "folder for the results; required",
}  # fmt: skip
_RUN_DIRS: Argument = ("run_dirs",), {
    "type": Path, "nargs": "+", "metavar": "RUN_DIR", "help": "folders of the runs",
}  # fmt: skip
_REPORT_DIR: Argument = ("report_dir",), {
    "type": Path, "metavar": "DIR", "help": "folder of the report on the verification suite",
}  # fmt: skip
_REGIME: Argument = ("regime",), {
    "metavar": "REGIME",
    "help": "impact, settle, column or drag; beds: only the packings from which drags start",
}  # fmt: skip
_MAP: Argument = ("--map",), {
    "type": Path, "required": True, "dest": "points", "metavar": "FILE",
    "help": "map.yaml, the points of the stability map; required",
}  # fmt: skip
_MADE_BY: Argument = ("--command",), {
    "required": True, "metavar": "TEXT",
    "help": "command that made the runs, to be recorded with the results; required",
}  # fmt: skip
_LISTS: Argument = ("lists",), {
    "type": Path, "nargs": "+", "metavar": "POINTS",
    "help": "points/REGIME.json of each regime, made by run-map",
}  # fmt: skip

COMMANDS: dict[str, tuple[str, str, tuple[Argument, ...]]] = {
    "render-suite": ("write the input scripts of all cases of the verification suite",
                     "verification.suite:render_suite", (STUDY, FIDELITY)),
    "judge-suite": ("compare the runs of the verification suite with reference solutions",
                    "verification.report:write_verification", (_OUT_DIR, _RUN_DIRS)),
    "verdict": ("print the verdict of the verification suite; fail if a quantity failed",
                "verification.report:verdict", (_REPORT_DIR,)),
    "run-map": ("run all points of one regime of the stability map",
                "stability.runs:stability_command", (_REGIME, _MAP)),
    "report-map": ("write the report on a stability map",
                   "stability.report:write_stability", (_OUT_DIR, _LISTS)),
    "validate": ("compare the runs of a study with the publication it reproduces; write the report",
                 "validation.report:write_validation", (_OUT_DIR, _RUN_DIRS, _MADE_BY)),
}  # fmt: skip
"""By name: help, function and its parameters."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; see `dragdeck.cli.guarded`."""
    parser = argparse.ArgumentParser(prog="python -m evidence", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="_command")
    for name, (words, _, own) in COMMANDS.items():
        command = commands.add_parser(
            name, help=words, description=f"{words[0].upper()}{words[1:]}."
        )
        for names, options in own:
            command.add_argument(*names, **options)
    given = vars(parser.parse_args(arguments))
    return guarded(partial(_call, COMMANDS[given.pop("_command")][1], given))


def _call(function: str, options: dict[str, Any]) -> None:
    """Import a function of this package and call it; what it returns as text is printed."""
    module, _, name = function.partition(":")
    try:
        said = getattr(import_module(f"evidence.{module}"), name)(**options)
    except DragchainError as error:
        raise DragdeckError(str(error)) from error
    if isinstance(said, str):
        print(said)


if __name__ == "__main__":
    sys.exit(main())

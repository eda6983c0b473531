"""What the rules of suite, stability map and validation call: ``python -m evidence``."""

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

_OUT_DIR: Argument = ("--out",), {"type": Path, "required": True, "dest": "out_dir"}
_RUN_DIRS: Argument = ("run_dirs",), {"type": Path, "nargs": "+", "metavar": "RUN_DIR"}
_REPORT_DIR: Argument = ("report_dir",), {"type": Path, "metavar": "DIR"}
_REGIME: Argument = ("regime",), {"help": "impact, settle, beds, column or drag"}
_MAP: Argument = ("--map",), {"type": Path, "required": True, "dest": "points", "help": "map.yaml"}
_MADE_BY: Argument = ("--command",), {"required": True, "help": "for the record"}
_LISTS: Argument = ("lists",), {"type": Path, "nargs": "+", "metavar": "POINTS"}

COMMANDS: dict[str, tuple[str, str, tuple[Argument, ...]]] = {
    "render-suite": ("write the input scripts of the verification suite",
                     "verification.suite:render_suite", (STUDY, FIDELITY)),
    "judge-suite": ("check the runs of the verification suite",
                    "verification.report:write_verification", (_OUT_DIR, _RUN_DIRS)),
    "verdict": ("fail if a quantity of the suite failed",
                "verification.report:verdict", (_REPORT_DIR,)),
    "run-map": ("run one regime of the stability map",
                "stability.map_runs:stability_command", (_REGIME, _MAP)),
    "report-map": ("write the report on a stability map",
                   "stability.report:write_stability", (_OUT_DIR, _LISTS)),
    "validate": ("compare the runs of a study with its source",
                 "validation.report:write_validation", (_OUT_DIR, _RUN_DIRS, _MADE_BY)),
}  # fmt: skip
"""By name: help, function and its parameters."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; see `dragdeck.cli.guarded`."""
    parser = argparse.ArgumentParser(prog="python -m evidence", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="_command")
    for name, (words, _, own) in COMMANDS.items():
        command = commands.add_parser(name, help=words, description=words)
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

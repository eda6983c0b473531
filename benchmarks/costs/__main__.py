"""The cost of each option that a study's input scripts omit (docs/evidence/costs.md).

    python benchmarks/costs STUDY --out FILE [--rounds 3] [--seconds 0.15] [--only NAME ...]

Run it inside the project, on a machine that does nothing else. What it keeps is in ``costs/``
beside the result; an interrupted measurement goes on from there.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from cost_timing import SECONDS, measure
from dragdeck.errors import DragdeckError
from dragdeck.project import find_project


def main(arguments: Sequence[str] | None = None) -> int:
    """Time a study's variants; errors of the user's go to standard error without a traceback."""
    options = _parser().parse_args(arguments)
    try:
        _measure(options)
    except DragdeckError as error:
        print(f"costs: {error}", file=sys.stderr)
        return 1
    return 0


def _measure(options: argparse.Namespace) -> None:
    project = find_project(Path.cwd())
    measure(
        project.cases(options.study, options.fidelity)[0],
        project.templates,
        options.out,
        _report,
        rounds=options.rounds,
        seconds=options.seconds,
        only=options.only,
    )


def _report(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/costs",
        description="Time what each omitted option would cost.",
    )
    parser.add_argument("study", help="name of a folder in studies/")
    parser.add_argument("--fidelity", help="instead of the study's own")
    parser.add_argument(
        "--rounds", type=int, default=3, help="number of timings of each input script"
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=SECONDS,
        metavar="S",
        help="simulated time of the timed drag, s",
    )
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="time only these variants"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="costs.json")
    return parser


if __name__ == "__main__":
    sys.exit(main())

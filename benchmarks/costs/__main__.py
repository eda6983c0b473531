"""The cost of each option that a study's input scripts omit (docs/evidence/costs.md).

    python benchmarks/costs STUDY --out FILE [--rounds 3] [--seconds 0.15] [--only NAME ...]

Run it inside the project, on a machine that does nothing else. What it keeps is in ``costs/``
beside the result; an interrupted measurement goes on from there.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

from cost_timing import SECONDS, time_variants
from dragdeck.command_line import guarded
from dragdeck.engine.reports import say
from dragdeck.project import find_project


def main() -> int:
    """Time a study's variants and return the exit status; see `dragdeck.command_line.guarded`."""
    parser = argparse.ArgumentParser(
        prog="python benchmarks/costs", description="Time what each omitted option would cost."
    )
    add = parser.add_argument
    add("study", help="name of a folder in studies/")
    add("--fidelity", help="instead of the study's own")
    add("--rounds", type=int, default=3, help="number of timings of each input script")
    add("--seconds", type=float, default=SECONDS, help="simulated time of the timed drag, s")
    add("--only", nargs="+", default=[], metavar="NAME", help="time only these variants")
    add("--out", type=Path, required=True, metavar="FILE", help="costs.json")
    return guarded("costs", partial(_measure, parser.parse_args()))


def _measure(asked: argparse.Namespace) -> None:
    project = find_project(Path.cwd())
    case = project.cases(asked.study, asked.fidelity)[0]
    how = {"rounds": asked.rounds, "seconds": asked.seconds, "only": asked.only}
    time_variants(case, project.templates, asked.out, say, **how)


if __name__ == "__main__":
    sys.exit(main())

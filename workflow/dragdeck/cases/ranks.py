"""How many MPI ranks a run gets."""

import os
from pathlib import Path

from dragdeck.errors import InputError

CORES_VARIABLE = "DRAGDECK_CORES"
"""Environment variable: cores that ``ranks: auto`` may count on, if not those seen here."""

FEWEST_PARTICLES_A_RANK = 5000
"""``ranks: auto`` assigns no rank fewer particles. Two ranks of this size cost little more CPU time
than one rank with all particles (docs/development/benchmarks.md). Smaller runs are short in any
case, and on a shared machine their ranks wait for each other."""

_ALWAYS_ACCEPTED = 2
"""Ranks that a study may have on any machine: the default."""


_AROUND_COLUMN = (8, 4, 2, 1)
"""Ranks among which a ring is split evenly: others have a part in the column, or the fullest has
half more than the mean (tests/dragdeck/cases/test_ranks.py)."""


def auto_ranks(particles: int, cases: int, cores: int, *, column: bool = False) -> int:
    """Ranks of a run of a study with that many cases.

    Ranks wait for each other, cases do not: where there are as many cases as cores, each
    gets one. The cores that are left share a case as long as each has enough particles.

    Parameters
    ----------
    particles : int
        In one run.
    cases : int
        That can run beside each other.
    cores : int
        Of the machine.
    column : bool
        Whether a column stands in the middle of the bowl.
    """
    most = max(1, min(cores // cases, particles // FEWEST_PARTICLES_A_RANK))
    return next(count for count in _AROUND_COLUMN if count <= most) if column else most


def ranks_within(ranks: int) -> int:
    """MPI ranks of a run that is to have this many: two, the default, are one on a single core.

    `check_ranks` refuses more than two where there are not as many cores.
    """
    return min(ranks, cores_here()) if ranks <= _ALWAYS_ACCEPTED else ranks


def check_ranks(ranks: int, file: Path) -> None:
    """Refuse more ranks than this machine has cores; the default of two runs everywhere.

    Raises
    ------
    InputError
        Names `CORES_VARIABLE`, for runs that are on another machine.
    """
    cores = max(cores_here(), _ALWAYS_ACCEPTED)
    if ranks > cores:
        raise InputError(
            "more MPI ranks than cores: the ranks would wait for each other",
            file=file,
            field="fidelity.ranks",
            value=ranks,
            limit=f"at most {cores} here",
            remedy=f"use fewer, or auto; or set {CORES_VARIABLE} to the cores of another machine",
        )


def cores_here() -> int:
    """Cores that this process may use, or the number in `CORES_VARIABLE`.

    Raises
    ------
    InputError
        The variable is no number above zero.
    """
    told = os.environ.get(CORES_VARIABLE)
    if told is None:
        return len(os.sched_getaffinity(0))
    if not told.isdecimal() or int(told) < 1:
        raise InputError(
            "not a number of cores",
            field=CORES_VARIABLE,
            value=told,
            limit="a whole number, at least 1",
            remedy="correct the environment variable, or unset it",
        )
    return int(told)

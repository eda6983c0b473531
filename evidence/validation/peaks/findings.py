"""Do chains explain the peaks of the drag? The paper's claim, test by test.

Uhlmann et al. (2015, section 5) say that the peaks of the drag are caused by contact chains
between workpiece and bowl. What can be tested without circular reasoning is limited: the force of
a chain on the workpiece is a part of the drag, so it is high at a peak by construction. The
verdicts rest on tests free of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dragchain.documents import Document, Part
from dragchain.errors import TableError
from evidence.validation.peaks import averages, run_series
from evidence.validation.peaks.lags import LagCurves, lag_curves
from evidence.validation.peaks.runs import read_run
from evidence.validation.peaks.settings import DEFAULTS, DEFINITIONS, Definition
from evidence.validation.peaks.shift_test import SHIFTS, draw_shifts
from evidence.validation.peaks.tests import ASIDE_S, NEAR_S, STRONG_STDS, PeakTest, tests_of
from evidence.validation.peaks.verdicts import LEVEL, SMALL, StatementVerdict, judge


class RunRow(Part):
    """What is known of a run: its frames, and its peaks by every rule."""

    run: str
    label: str
    frames: int
    interval_s: float
    peaks: int
    distinct_peaks: int
    slow_peaks: int
    separation_s: float
    sense: int


class Thresholds(Part):
    """Choices that the findings rest on; ``family`` counts the tests that Holm adjusts for."""

    reach_s: float = run_series.REACH_S
    aside_s: tuple[float, float] = ASIDE_S
    near_s: float = NEAR_S
    strong_stds: float = STRONG_STDS
    top: float = averages.TOP
    distinct_stds: float = run_series.DISTINCT_STDS
    averaged_s: float = run_series.AVERAGED_S
    level: float = LEVEL
    small_stds: float = SMALL
    shifts: int
    family: int


class Findings(Document):
    """The content of ``peaks.json``."""

    runs: tuple[RunRow, ...]
    limits: Thresholds
    definitions: Mapping[Definition, str]
    statements: tuple[StatementVerdict, ...]
    tests: tuple[PeakTest, ...]
    lags: LagCurves
    ranks: Mapping[run_series.PeakRule, Mapping[Definition, averages.Ranks]]
    geometry: Mapping[Definition, averages.Geometry]
    lifetimes: Mapping[Definition, averages.Lifetimes]


@dataclass(frozen=True)
class Study:
    """What tables, figures and page are made of."""

    runs: tuple[run_series.RunSeries, ...]
    findings: Findings


def study(run_dirs: Sequence[Path]) -> Study:
    """Read the runs, make all tests and judge them.

    Raises
    ------
    TableError
        No run is given, a table is missing, or a run has no peak.
    """
    if not run_dirs:
        raise TableError("no folder of a run is given, so there are no peaks to explain")
    return study_of([read_run(Path(folder)) for folder in run_dirs])


def study_of(runs: Sequence[run_series.RunSeries], count: int = SHIFTS) -> Study:
    """Make all tests of runs that are read, each with so many shifts, and judge them."""
    shifts = draw_shifts([len(run.time_s) for run in runs], count)
    tests = tests_of(runs, shifts)
    findings = Findings(
        runs=tuple(_run_row(run) for run in runs),
        limits=Thresholds(
            shifts=len(shifts), family=sum(bool(np.isfinite(test.p_holm)) for test in tests)
        ),
        definitions=DEFINITIONS,
        statements=judge(tests),
        tests=tuple(tests),
        lags=lag_curves(runs, shifts),
        ranks={
            rule: {name: averages.ranks(runs, at, rule) for name, at in DEFAULTS.items()}
            for rule in run_series.rules_of(runs)
        },
        geometry={name: averages.geometry(runs, at) for name, at in DEFAULTS.items()},
        lifetimes={name: averages.lifetimes(runs, at) for name, at in DEFAULTS.items()},
    )
    return Study(tuple(runs), findings)


def _run_row(run: run_series.RunSeries) -> RunRow:
    peaks = {"peaks": len(run.peaks), "slow_peaks": len(run.slow)}
    distinct = int(run.peaks["distinct"].sum())
    frames = {"frames": len(run.time_s), "interval_s": run.interval_s}
    return RunRow.model_validate({**vars(run), **frames, **peaks, "distinct_peaks": distinct})

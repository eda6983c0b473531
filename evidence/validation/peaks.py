"""Whether force chains explain the peaks of the drag.

Uhlmann et al. (2015, section 5) say that the peaks are caused by contact chains between workpiece
and bowl. The force of a chain on the workpiece is a part of the drag, so it is high at a peak by
construction. The chain of a frame is therefore the dominant path to the bowl that is found, and
measured, without the forces on the workpiece.

A series of frames is tested against the peaks by circular shifts. A shift moves all events of a run
by the same number of frames, round the end to the beginning. It keeps the autocorrelation of the
series and the spacing of the events and breaks only what ties the one to the other. Runs are
shifted independently of each other, so their joint null distribution is that of the mean over runs
of one shift each.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.signal import find_peaks

from dragchain.arrays import Floats, Ints
from dragchain.drag import drag_peaks, peak_separation_s, read_counted
from dragchain.errors import TableError
from dragchain.network.chains import dominant_path, widest_paths
from dragchain.network.frame import WORKPIECE, NetworkFrame, network_frames
from dragchain.statistics.estimate import Estimate, Real, Verdict, mean_of
from dragdeck.documents import Document, Part
from dragdeck.records.case import load_case

# --- tests by circular shifts ------------------------------------------------------------------

SHIFTS = 19_999
"""Random shifts of the joint null distribution: the smallest p-value is 1 in 20,000."""

_SEED = 20150101
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class ShiftTest(Estimate):
    """A statistic at the events against its null distribution.

    Its value is the mean over the runs, NaN if no run has one; its interval comes from the spread
    over the runs (`mean_of`).

    Attributes
    ----------
    p_greater : float
        Share of shifts, the true position included, whose statistic is at least as large.
    """

    p_greater: float


def shifted_means(series: Floats, events: Ints, reach: int) -> Floats:
    """Mean of a series around the events, for every circular shift of the events.

    Parameters
    ----------
    series : (N,) ndarray
        One value a frame; NaN where there is none. Such frames count in no mean.
    events : (K,) ndarray of int
        Frames of the events.
    reach : int
        Frames before and after each event that count for it.

    Returns
    -------
    (N,) ndarray
        Element s: events moved s frames later; NaN where no frame has a value.
    """
    count = len(series)
    near = np.zeros(count)
    offsets = np.arange(-reach, reach + 1)
    np.add.at(near, (events[:, None] + offsets).ravel() % count, 1.0)
    there = np.isfinite(series)
    sums = _correlate(near, np.where(there, series, 0.0))
    weights = np.rint(_correlate(near, there.astype(np.float64)))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(weights > 0, sums / weights, np.nan))


def _correlate(near: Floats, series: Floats) -> Floats:
    spectrum = np.conj(np.fft.rfft(near)) * np.fft.rfft(series)
    return np.asarray(np.fft.irfft(spectrum, len(series)))


def standardised(series: Floats, means: Floats) -> Floats:
    """Return means less the series' mean over its standard deviation (divisor N - 1)."""
    known = series[np.isfinite(series)]
    spread = float(known.std(ddof=1)) if len(known) > 1 else 0.0
    if spread == 0.0:
        return np.full(len(means), np.nan)
    return np.asarray((means - known.mean()) / spread)


def draw_shifts(lengths: Sequence[int], count: int = SHIFTS, seed: int = _SEED) -> Ints:
    """Draw shifts for runs of these numbers of frames, (count, runs); the same every time."""
    parts = np.random.default_rng(seed).random((count, len(lengths)))
    return np.asarray(np.floor(parts * np.asarray(lengths)), dtype=np.int64)


def joint(by_shift: Sequence[Floats], shifts: Ints) -> Floats:
    """The mean over runs for each row of `shifts`, runs without a value left out.

    Parameters
    ----------
    by_shift : sequence of (N_r,) ndarray
        A run's statistic for each of its circular shifts.
    shifts : (S, R) ndarray of int
        A shift for each run, modulo its number of frames.
    """
    drawn = np.stack([run[shifts[:, at] % len(run)] for at, run in enumerate(by_shift)])
    there = np.isfinite(drawn)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(there, drawn, 0.0).sum(axis=0) / there.sum(axis=0))


def shift_test(by_shift: Sequence[Floats], shifts: Ints) -> ShiftTest:
    """Test the true position, shift 0 of every run, against joint shifts.

    Parameters
    ----------
    by_shift : sequence of (N_r,) ndarray
        As for `joint`.
    shifts : (S, R) ndarray of int
        As drawn by `draw_shifts`.
    """
    zero = np.zeros((1, len(by_shift)), dtype=np.int64)
    value = float(joint(by_shift, zero)[0])
    if not np.isfinite(value):
        return ShiftTest(np.nan, np.nan, np.nan, p_greater=np.nan)
    over_runs = mean_of([float(run[0]) for run in by_shift])
    null = joint(by_shift, shifts)
    reached = null[np.isfinite(null)] >= value - _ROUNDING
    return ShiftTest(value, over_runs.ci95_low, over_runs.ci95_high, p_greater=_p_value(reached))


def _p_value(reached: NDArray[np.bool_]) -> float:
    return float((1 + reached.sum()) / (1 + len(reached)))


def holm(p_values: ArrayLike) -> Floats:
    """Adjust p-values for their number (Holm 1979, Scand. J. Statist. 6, 65-70); NaN stays NaN."""
    given = np.asarray(p_values, dtype=np.float64)
    adjusted = np.full(given.shape, np.nan)
    known = np.flatnonzero(np.isfinite(given))
    order = known[np.argsort(given[known], kind="stable")]
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * given[order]), 1.0)
    return adjusted


# --- chains and peaks --------------------------------------------------------------------------

REACH_S = 0.02
"""Frames within this time of a peak count as at the peak."""

NEAR_S = 0.05
"""A strong chain within this time of a peak counts as together with it."""

STRONG_STDS = 1.0
"""A chain is strong if its strength is this many standard deviations above the mean of the run."""

LEVEL = 0.05
"""A test supports a statement with a p-value below, after Holm's adjustment."""

SMALL = 0.2
"""An effect below this many standard deviations is small (Cohen 1988)."""

Statement = Literal["presence", "dominance", "coverage", "reverse"]
"""Statements of the paper: at a peak the chain is stronger than at other times (presence) and than
the general rise of the forces explains (dominance); most peaks come with a strong chain (coverage)
and most strong chains with a peak (reverse)."""

STRENGTH = "strength"
DESCRIPTORS: Mapping[str, Statement] = {
    STRENGTH: "presence",
    "strength_over_surroundings": "dominance",
    "strength_over_drag": "dominance",
}
"""Numbers of a frame's chain, with the statement that each of them tests."""

_CONSERVATIVE = "strength_over_drag"
"""Errs against its statement, for the drag is high at a peak: it can only support."""


@dataclass(frozen=True)
class ChainSeries:
    """Frames and peaks of a run.

    Attributes
    ----------
    run : str
        The case's readable name.
    time_s : (N,) ndarray
        Times of the network frames.
    peaks : (K,) ndarray of int
        The frame nearest to each peak.
    separation_s : float
        Least time between peaks.
    chains : mapping of str to (N,) ndarray
        `DESCRIPTORS` of every frame, NaN where there is no chain.
    """

    run: str
    time_s: Floats
    peaks: Ints
    separation_s: float
    chains: Mapping[str, Floats]

    @property
    def interval_s(self) -> float:
        """Time between frames."""
        return float(np.median(np.diff(self.time_s)))

    def strong_frames(self) -> Ints:
        """Frames with a strong chain (`STRONG_STDS`)."""
        strength = np.nan_to_num(self.chains[STRENGTH])
        level = strength.mean() + STRONG_STDS * strength.std(ddof=1)
        return np.flatnonzero(strength > level)

    def strongest_frames(self) -> Ints:
        """Frames at which a strong chain is strongest, no two closer than peaks may be."""
        apart = max(1.0, self.separation_s / self.interval_s)
        index, _ = find_peaks(np.nan_to_num(self.chains[STRENGTH]), distance=apart)
        return np.asarray(index[np.isin(index, self.strong_frames())], dtype=np.int64)


class PeakTest(Part):
    """A test by circular shifts.

    Attributes
    ----------
    test, statement : str
        A descriptor or a statement on fractions, and the statement that is tested.
    at_peaks, expected : float
        Means over the runs at peaks and at all times; a fraction, and its mean by chance.
    effect, ci95_low, ci95_high : float
        The difference in standard deviations of the run, or the fraction, with the interval over
        the packings.
    p, p_holm : float
        One-sided, before and after Holm's adjustment.
    """

    test: str
    statement: Statement
    at_peaks: Real
    expected: Real
    effect: Real
    ci95_low: Real
    ci95_high: Real
    p: Real
    p_holm: Real = math.nan

    @property
    def _fraction(self) -> bool:
        return self.test not in DESCRIPTORS

    @property
    def supports(self) -> bool:
        """Whether it supports its statement; most peaks, or chains, are more than one half."""
        return self.p_holm < LEVEL and self.effect > (0.5 if self._fraction else 0.0)

    @property
    def confirms(self) -> bool:
        """Whether the interval over the packings excludes no effect, too."""
        return self.supports and self.ci95_low > (0.5 if self._fraction else 0.0)

    @property
    def contradicts(self) -> bool:
        """Whether the interval over the packings excludes all but a small effect."""
        return not self.supports and self.ci95_high < (0.5 if self._fraction else SMALL)


class Judgement(Part):
    """The verdict on a statement, and whether a test supports it."""

    statement: Statement
    verdict: Verdict
    supported: bool


class RunRow(Part):
    """What is known of a run."""

    run: str
    frames: int
    peaks: int


class PeakFindings(Document):
    """The content of ``peaks.json``."""

    runs: tuple[RunRow, ...]
    shifts: int
    statements: tuple[Judgement, ...]
    tests: tuple[PeakTest, ...]

    def table(self) -> pd.DataFrame:
        """The tests, one row per test."""
        return pd.DataFrame([dict(test) for test in self.tests])


def of_runs(run_dirs: Sequence[Path]) -> PeakFindings:
    """Test the runs, which differ by their packing, and judge the statements.

    Raises
    ------
    TableError
        A table is missing, or a run has no peak.
    """
    return peak_findings([read_run(folder) for folder in run_dirs])


def peak_findings(runs: Sequence[ChainSeries], count: int = SHIFTS) -> PeakFindings:
    """Make all tests, each with so many shifts, and judge the statements."""
    shifts = draw_shifts([len(run.time_s) for run in runs], count)
    tests = [_difference(runs, shifts, name) for name in DESCRIPTORS]
    tests += [
        _fraction("coverage", [(run, run.peaks, run.strong_frames()) for run in runs], shifts),
        _fraction("reverse", [(run, run.strongest_frames(), run.peaks) for run in runs], shifts),
    ]
    adjusted = holm([test.p for test in tests]).tolist()
    tests = [test.model_copy(update={"p_holm": p}) for test, p in zip(tests, adjusted, strict=True)]
    return PeakFindings(
        runs=tuple(
            RunRow(run=run.run, frames=len(run.time_s), peaks=len(run.peaks)) for run in runs
        ),
        shifts=count,
        statements=tuple(judge_statement(name, tests) for name in get_args(Statement)),
        tests=tuple(tests),
    )


def judge_statement(statement: Statement, tests: Sequence[PeakTest]) -> Judgement:
    """The verdict on a statement.

    Confirmed if a test supports it and all but the conservative one confirm it; contradicted if no
    test supports it and all but that one contradict it; otherwise not confirmed.
    """
    about = [test for test in tests if test.statement == statement]
    full = [test for test in about if test.test != _CONSERVATIVE]
    supported = any(test.supports for test in about)
    verdict: Verdict = "not confirmed"
    if all(test.confirms for test in full):
        verdict = "confirmed"
    elif not supported and all(test.contradicts for test in full):
        verdict = "contradicted"
    return Judgement(statement=statement, verdict=verdict, supported=supported)


# --- the chains of a run ---------------------------------------------------------------------


def read_run(run_dir: Path) -> ChainSeries:
    """Read a process run and describe the chains of its frames.

    Raises
    ------
    TableError
        If a table is missing, or the drag has no peak.
    """
    case = load_case(run_dir)
    rows = [{"time_s": frame.time_s, **chain_numbers(frame)} for frame in network_frames(run_dir)]
    columns = {name: np.array([row[name] for row in rows]) for name in ("time_s", *DESCRIPTORS)}
    time_s = columns.pop("time_s")
    peak_s = drag_peaks(read_counted(run_dir, ("time_s", "drag_n")), case).time_s
    if not len(peak_s):
        raise TableError(
            f"{run_dir}: the drag has no peak, so there is nothing to explain; drag for longer"
        )
    return ChainSeries(
        run=case.case or case.run,
        time_s=time_s,
        peaks=np.abs(time_s[None, :] - peak_s[:, None]).argmin(axis=1),
        separation_s=peak_separation_s(case),
        chains=columns,
    )


def chain_numbers(frame: NetworkFrame) -> dict[str, float]:
    """`DESCRIPTORS` of a frame's chain, NaN where it has none.

    Its strength is the force of its weakest contact behind the workpiece over the mean normal force
    of all contacts but the workpiece's. The surroundings are the contacts between the particles
    that the workpiece pushes and others, by their root mean square.
    """
    paths = widest_paths(frame, with_workpiece=False)
    path = dominant_path(frame, paths, with_workpiece=False)
    if path is None:
        return dict.fromkeys(DESCRIPTORS, math.nan)
    forces, on_workpiece = frame.normal_force, frame.other == WORKPIECE
    weakest = float(forces[list(path.contacts[1:])].min())
    pushed = np.zeros(frame.particle_id.size, dtype=bool)
    pushed[frame.a[on_workpiece & (forces > 0.0)]] = True
    shell = forces[frame.between_particles() & (pushed[frame.a] | pushed[frame.b])]
    around = float(np.sqrt(np.mean(shell**2))) if shell.size else math.nan
    heading = np.array([np.cos(frame.direction_rad), np.sin(frame.direction_rad), 0.0])
    drag = float((frame.force[on_workpiece] @ heading).sum())
    return {
        STRENGTH: weakest / frame.mean_force_n(with_workpiece=False),
        "strength_over_surroundings": weakest / around,
        _CONSERVATIVE: weakest / drag if drag > 0.0 else math.nan,
    }


# --- the tests -------------------------------------------------------------------------------


def _difference(runs: Sequence[ChainSeries], shifts: Ints, name: str) -> PeakTest:
    """Whether a descriptor is higher around the peaks than at other times."""
    series = [run.chains[name] for run in runs]
    means = [
        shifted_means(one, run.peaks, round(REACH_S / run.interval_s))
        for run, one in zip(runs, series, strict=True)
    ]
    by_shift = [standardised(one, mean) for one, mean in zip(series, means, strict=True)]
    at_peaks, expected = _mean([mean[:1] for mean in means]), _mean(series)
    found = shift_test(by_shift, shifts)
    names = {"test": name, "statement": DESCRIPTORS[name]}
    return _test(found, **names, at_peaks=at_peaks, expected=expected)


def _fraction(
    statement: Statement, events: Sequence[tuple[ChainSeries, Ints, Ints]], shifts: Ints
) -> PeakTest:
    """Whether events of each run have one of the others near more often than by chance."""
    by_shift = [
        shifted_means(near_any(run.time_s, run.time_s[others], NEAR_S).astype(float), own, 0)
        for run, own, others in events
    ]
    found = shift_test(by_shift, shifts)
    names = {"test": statement, "statement": statement}
    return _test(found, **names, at_peaks=found.value, expected=_mean(by_shift))


def _test(found: ShiftTest, **known: str | float) -> PeakTest:
    numbers = {**vars(found), "effect": found.value, "p": found.p_greater}
    return PeakTest.model_validate({**known, **numbers})


def _mean(series: Sequence[Floats]) -> float:
    """The mean over the runs of the mean of the finite values; NaN if there is none."""
    means = [one[np.isfinite(one)].mean() for one in series if np.isfinite(one).any()]
    return float(np.mean(means)) if means else math.nan


def near_any(time_s: Floats, events_s: Floats, reach_s: float) -> NDArray[np.bool_]:
    """Which times lie within `reach_s` of an event."""
    gaps = np.abs(time_s[:, None] - events_s[None, :]).min(axis=1, initial=np.inf)
    return np.asarray(gaps <= reach_s)

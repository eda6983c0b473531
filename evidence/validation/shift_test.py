"""Tests of a series against events by circular shifts, over several runs.

A shift moves all events of a run by the same number of frames, round the end to the beginning. It
keeps the autocorrelation of the series and the spacing of the events and breaks only what ties the
one to the other. Runs are shifted independently of each other, so their joint null distribution is
that of the mean over runs of one shift each.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dragchain.arrays import Floats, Ints
from dragchain.statistics.estimate import Estimate, mean_of

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

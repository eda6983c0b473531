"""Peaks of the drag force."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.run.kinematics import motion_of
from dragdeck.records.case import CaseOfRun


@dataclass(frozen=True)
class Peaks:
    """Peaks of the resistance to the drag.

    Attributes
    ----------
    index : (N,) ndarray of int64
        Positions in the series.
    time_s, drag_n, prominence_n : (N,) ndarray
        When they are, the force along the motion there (negative), and how far
        each stands out of its surroundings.
    """

    index: NDArray[np.int64]
    time_s: Floats
    drag_n: Floats
    prominence_n: Floats


def drag_peaks(samples: pd.DataFrame, case: CaseOfRun) -> Peaks:
    """The peaks of counted samples with ``time_s`` and ``drag_n``; see `find_drag_peaks`."""
    time_s, drag_n = (samples[name].to_numpy(np.float64) for name in ("time_s", "drag_n"))
    return find_drag_peaks(time_s, drag_n, min_separation_s=peak_separation_s(case))


def find_drag_peaks(
    time_s: Floats,
    drag_n: Floats,
    *,
    min_separation_s: float,
    min_prominence_n: float | None = None,
) -> Peaks:
    """Find the peaks of the resistance ``-drag_n``.

    A peak is a local maximum that stands out by `min_prominence_n` and from
    which every higher one is at least `min_separation_s` away: of two closer
    ones the lower is dropped (`scipy.signal.find_peaks`; Virtanen et al. 2020,
    Nature Methods 17, 261-272). The series is not smoothed.

    Parameters
    ----------
    time_s : (N,) ndarray
        Times at equal intervals, s.
    drag_n : (N,) ndarray
        Force along the motion, N.
    min_separation_s : float
        Least time between peaks, s; see `peak_separation_s`.
    min_prominence_n : float, optional
        Least prominence, N; the standard deviation of the series (divisor
        N - 1) if None.

    Returns
    -------
    Peaks
        In order of time; none if the series is constant.

    Raises
    ------
    SeriesError
        If there are fewer than 3 samples or the intervals are not equal.
    """
    from scipy.signal import find_peaks

    if len(time_s) < 3:
        raise SeriesError(f"peaks require at least 3 samples; the series has {len(time_s)}")
    intervals = np.diff(time_s)
    interval = float(np.median(intervals))
    if not np.allclose(intervals, interval, rtol=1e-3, atol=0.0):
        raise SeriesError("peaks require a constant sampling interval")
    prominence = float(np.std(drag_n, ddof=1)) if min_prominence_n is None else min_prominence_n
    distance = max(1.0, min_separation_s / interval)
    index, found = find_peaks(-drag_n, prominence=prominence, distance=distance)
    return Peaks(index.astype(np.int64), time_s[index], drag_n[index], found["prominences"])


def peak_separation_s(case: CaseOfRun) -> float:
    """The time in which the workpiece travels one mean particle radius, s."""
    return case.media.radius_mean_m / motion_of(case).axis_speed_m_s

"""The force on the workpiece: counted samples, their means and peaks, and where around it they act.

A workpiece of facets touches most of its particles with the edges between them, and the edges lie
at the very angles that divide a circumference: straight ahead, abeam, at 45 degrees. The last
digit of a written number would decide the side of such a contact; instead half of it
counts on either.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import SeriesError
from dragchain.run.kinematics import axis_speed
from dragchain.statistics.correlated import estimates, frame_sums
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import intact
from dragdeck.records.case import CaseOfRun

FORCES = ("drag_n", "lateral_n", "vertical_n")
"""The force on the workpiece in the workpiece frame."""


def read_counted(run_dir: Path | str, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the samples of the force on the workpiece that statistics use.

    Parameters
    ----------
    run_dir : Path or str
        The run folder, with its tables made.
    columns : sequence of str, optional
        Columns to read; all if None.

    Returns
    -------
    DataFrame
        The rows of ``workpiece_force.parquet`` with ``in_statistics`` true.

    Raises
    ------
    TableError
        If the table is not there or damaged.
    """
    file = Path(run_dir) / "tables" / "workpiece_force.parquet"
    wanted = None if columns is None else list(columns)
    with intact(file):
        return pd.read_parquet(file, columns=wanted, filters=[("in_statistics", "==", True)])


@dataclass(frozen=True)
class DragPeaks:
    """Peaks of the resistance to the drag.

    Attributes
    ----------
    index : (N,) ndarray of int64
        Positions in the series.
    time_s, drag_n : (N,) ndarray
        When they are, and the force along the motion there (negative).
    """

    index: NDArray[np.int64]
    time_s: Floats
    drag_n: Floats


def drag_peaks(samples: pd.DataFrame, case: CaseOfRun) -> DragPeaks:
    """The peaks of counted samples with ``time_s`` and ``drag_n``; see `find_drag_peaks`."""
    time_s, drag_n = (samples[name].to_numpy(np.float64) for name in ("time_s", "drag_n"))
    return find_drag_peaks(time_s, drag_n, min_separation_s=peak_separation_s(case))


def find_drag_peaks(time_s: Floats, drag_n: Floats, *, min_separation_s: float) -> DragPeaks:
    """Find the peaks of the resistance ``-drag_n``.

    A peak is a local maximum that stands out by the standard deviation of the
    series (divisor N - 1) and from which every higher one is at least
    `min_separation_s` away: of two closer ones the lower is dropped
    (`scipy.signal.find_peaks`; Virtanen et al. 2020, Nature Methods 17,
    261-272). The series is not smoothed.

    Parameters
    ----------
    time_s : (N,) ndarray
        Times at equal intervals, s.
    drag_n : (N,) ndarray
        Force along the motion, N.
    min_separation_s : float
        Least time between peaks, s; see `peak_separation_s`.

    Returns
    -------
    DragPeaks
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
    distance = max(1.0, min_separation_s / interval)
    index, _ = find_peaks(-drag_n, prominence=float(np.std(drag_n, ddof=1)), distance=distance)
    return DragPeaks(index.astype(np.int64), time_s[index], drag_n[index])


def peak_separation_s(case: CaseOfRun) -> float:
    """The time in which the workpiece travels one mean particle radius, s."""
    return case.media.radius_mean_m / axis_speed(case)


_ON_LIMIT_RAD = 1e-6
"""A contact nearer to a limit than this is on it; points are written with nine digits."""


def beyond(angle_rad: Floats) -> Floats:
    """Share of each contact that is on the positive side of a limit: 1, 0, or 1/2 on it.

    Parameters
    ----------
    angle_rad : (c,) ndarray
        Angle from the limit.
    """
    return np.heaviside(np.where(np.abs(angle_rad) < _ON_LIMIT_RAD, 0.0, angle_rad), 0.5)


def within_angle(azimuth_rad: Floats, limit_rad: float) -> Floats:
    """Share of each contact that lies within an angle of the direction of motion.

    Parameters
    ----------
    azimuth_rad : (c,) ndarray
        Azimuth from the direction of motion.
    limit_rad : float
        The largest angle to either side.
    """
    return beyond(limit_rad - np.abs(azimuth_rad))


def circumference(bins: int) -> Floats:
    """Limits of equal parts of the circumference, (bins + 1,), from -pi to pi."""
    return np.linspace(-np.pi, np.pi, bins + 1)


def parts(azimuth_rad: Floats, bins: int) -> tuple[Ints, Ints]:
    """The part of the circumference that each half of a contact belongs to.

    Returns
    -------
    tuple of (c,) ndarray
        Two numbers of parts, 0 to `bins` - 1, the same unless the contact is on a limit.
    """
    width = 2.0 * np.pi / bins

    def part(angle: Floats) -> Ints:
        number: Ints = np.floor((angle + np.pi) / width).astype(np.int64) % bins
        return number

    return part(azimuth_rad - _ON_LIMIT_RAD), part(azimuth_rad + _ON_LIMIT_RAD)


AZIMUTH_BINS = 24
DEPTH_BINS = 10


# --- the force around the workpiece ---------------------------------------------------------------


def ahead_behind(
    frame: Ints, frames: int, azimuth_rad: Floats, normal_force_n: Floats
) -> dict[str, Estimate]:
    """Compare the normal force ahead of the workpiece with the one behind it.

    Parameters
    ----------
    frame : (c,) array
        Frame of each contact, 0 to `frames` - 1.
    frames
        Number of frames, those without a contact included.
    azimuth_rad, normal_force_n : (c,) array
        Azimuth from the direction of motion and normal force of each contact.

    Returns
    -------
    dict
        ``ahead_n`` and ``behind_n``: sum of the normal forces within 90 degrees of the direction
        of motion and beyond, mean over the frames. A contact abeam counts half on either side.
    """
    ahead = within_angle(azimuth_rad, np.pi / 2)
    weights = np.stack([normal_force_n * ahead, normal_force_n * (1.0 - ahead)], axis=1)
    sums = estimates(frame_sums(frame, frames, weights), lambda means: means)
    return dict(zip(("ahead_n", "behind_n"), sums, strict=True))


def azimuth_profile(
    frame: Ints, frames: int, azimuth_rad: Floats, normal_force_n: Floats, bins: int = AZIMUTH_BINS
) -> tuple[Floats, list[Estimate]]:
    """The edges of equal bins over the circumference and the mean force a frame in each, N.

    A contact on an edge counts half on either side.
    """
    sums = np.zeros((frames, bins))
    for row in parts(azimuth_rad, bins):
        np.add.at(sums, (frame, row), 0.5 * normal_force_n)
    return circumference(bins), estimates(sums, lambda means: means)


# --- the force against depth -----------------------------------------------------------------


def depth_profile(
    frame: Ints,
    frames: int,
    depth_m: Floats,
    normal_force_n: Floats,
    bins: int = DEPTH_BINS,
    edges_m: Floats | None = None,
) -> tuple[Floats, list[Estimate], list[Estimate]]:
    """How the normal force changes with depth, in equal bins or those of other edges.

    Returns
    -------
    edges : (bins + 1,) array
        Edges of equal bins in m, from the shallowest contact to the deepest.
    contact_n : list of Estimate
        Mean normal force of a contact in each bin in N, NaN for a bin without contacts.
    line_load_n_per_m : list of Estimate
        Sum of the normal forces of a frame by depth, in N per metre of depth.
    """
    equal = np.linspace(depth_m.min(), depth_m.max(), bins + 1)
    edges = equal if edges_m is None else edges_m
    row = np.clip(np.searchsorted(edges, depth_m, side="right") - 1, 0, bins - 1)
    force = np.zeros((frames, bins))
    count = np.zeros((frames, bins))
    np.add.at(force, (frame, row), normal_force_n)
    np.add.at(count, (frame, row), 1.0)
    thickness = edges[1] - edges[0]
    contact = estimates(np.hstack([force, count]), lambda s: s[..., :bins] / s[..., bins:])
    return edges, contact, estimates(force, lambda s: s / thickness)


def depth_slope(frame: Ints, frames: int, depth_m: Floats, normal_force_n: Floats) -> Estimate:
    """The least-squares slope of a contact's normal force against its depth, in N/m."""
    ones = np.ones_like(depth_m)
    products = [ones, depth_m, normal_force_n, depth_m**2, depth_m * normal_force_n]

    def statistic(sums: Floats) -> Floats:
        n, x, y, xx, xy = np.moveaxis(sums, -1, 0)
        return np.asarray((n * xy - x * y) / (n * xx - x**2))[..., None]

    return estimates(frame_sums(frame, frames, np.stack(products, axis=1)), statistic)[0]

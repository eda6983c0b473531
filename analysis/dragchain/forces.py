"""The force on the tool: phases, workpiece frame, counted samples, peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.signal import find_peaks

from dragchain.case import Case, Circle, Line, Phase
from dragchain.errors import SeriesError, TableError
from dragchain.stats import MeanEstimate, estimate_mean
from dragchain.streams import needed_table

Floats = NDArray[np.float64]
T = TypeVar("T")


def phase_codes(steps: NDArray[np.int64], phases: Sequence[Phase]) -> NDArray[np.int8]:
    """Phase of each step, as an index into `phases`.

    A phase owns the steps after its start up to and including its end: the
    step at which two phases meet was computed with the motion of the earlier
    one. The very first step belongs to the first phase.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    phases : sequence of Phase
        The phases, one after another.

    Returns
    -------
    (N,) ndarray of int8
        Indices into `phases`.

    Raises
    ------
    TableError
        If a step lies outside all phases.
    """
    if not phases:
        raise TableError("case.json lists no phases, so no step can be given one")
    first, last = phases[0].start_step, phases[-1].end_step
    outside = (steps < first) | (steps > last)
    if outside.any():
        step = int(steps[outside][0])
        raise TableError(f"step {step} lies outside the phases, which span {first} to {last}")
    ends = np.array([phase.end_step for phase in phases])
    return np.searchsorted(ends, steps, side="left").astype(np.int8)


def counted_mask(steps: NDArray[np.int64], case: Case) -> NDArray[np.bool_]:
    """Mark the samples that statistics use: those of the drag, after the run-in.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    case : Case
        The case, of a process.

    Returns
    -------
    (N,) ndarray of bool
        True from ``run_in_s`` after the start of the drag to its end.
    """
    drag = drag_phase(case)
    elapsed = (steps - drag.start_step) * case.timestep_s
    run_in = needed(case.run_in_s, "statistics.run_in_s")
    after = elapsed >= run_in - 0.5 * case.timestep_s
    return (steps > drag.start_step) & (steps <= drag.end_step) & after


def drag_phase(case: Case) -> Phase:
    """Return the phase named ``drag``."""
    for phase in case.phases:
        if phase.name == "drag":
            return phase
    raise TableError(f"{case.run}: case.json lists no phase named drag")


def needed(value: T | None, name: str) -> T:
    """Return a value that this scene must have."""
    if value is None:
        raise TableError(f"case.json has no {name}, which these tables need")
    return value


def motion_of(case: Case) -> Circle | Line:
    """Return the motion of the tool in the drag."""
    if case.motion is None:
        raise TableError("case.json has no motion, which these tables need")
    return case.motion


def headings(steps: NDArray[np.int64], ref_xy_m: Floats, case: Case) -> Floats:
    """Direction of the tool's motion in the horizontal plane.

    On a circle that is ``sense * z x r`` with r the unit vector from the
    bowl's axis to the reference point, in the drag; before it, the direction
    with which the drag starts. On a line it is the line's direction.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    ref_xy_m : (N, 2) ndarray
        Reference point of the tool at these steps, m.
    case : Case
        The case, of a process.

    Returns
    -------
    (N,) ndarray
        Angles from x towards y, rad, in (-pi, pi].
    """
    motion = motion_of(case)
    if not isinstance(motion, Circle):
        return np.full(len(steps), wrap_angle(motion.heading_rad))
    radial = np.arctan2(ref_xy_m[:, 1], ref_xy_m[:, 0])
    tangential = wrap_angle(radial + motion.sense * np.pi / 2.0)
    start = wrap_angle(motion.start_heading_rad)
    return np.where(steps > drag_phase(case).start_step, tangential, start)


def tool_velocity(
    steps: NDArray[np.int64], point_m: Floats, ref_xy_m: Floats, case: Case
) -> Floats:
    """Velocity of points that are fixed to the tool, in the drag.

    A tool that turns with its circle rotates about the bowl's axis, w x r with
    w = sense speed / radius; every other tool is moved without turning, along
    its heading.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    point_m : (N, 3) ndarray
        The points at these steps, m.
    ref_xy_m : (N, 2) ndarray
        Reference point of the tool at these steps, m.
    case : Case
        The case, of a process.

    Returns
    -------
    (N, 3) ndarray
        Velocities, m/s; NaN outside of the drag, of which alone ``case.json``
        gives the motion.
    """
    motion = motion_of(case)
    drag = drag_phase(case)
    if isinstance(motion, Circle) and motion.turns_with_path:
        turning = motion.sense * motion.speed_m_s / motion.radius_m
        along = turning * np.column_stack([-point_m[:, 1], point_m[:, 0]])
    else:
        heading = headings(steps, ref_xy_m, case)
        along = motion.speed_m_s * np.column_stack([np.cos(heading), np.sin(heading)])
    velocity = np.column_stack([along, np.zeros(len(steps))])
    dragged = (steps > drag.start_step) & (steps <= drag.end_step)
    return np.where(dragged[:, None], velocity, np.nan)


def wrap_angle(angle_rad: ArrayLike) -> Floats:
    """Wrap angles into (-pi, pi]."""
    turned = np.pi - np.asarray(angle_rad, dtype=np.float64)
    return np.asarray(np.pi - np.mod(turned, 2.0 * np.pi))


def workpiece_frame(force_n: Floats, heading_rad: Floats) -> Floats:
    """Turn forces into the workpiece frame.

    Parameters
    ----------
    force_n : (N, 3) ndarray
        Forces along x, y, z, N.
    heading_rad : (N,) ndarray
        Direction of motion, rad.

    Returns
    -------
    (N, 3) ndarray
        Forces along the direction of motion, along its left (z cross motion)
        and up, N.
    """
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    along = force_n[:, 0] * cos + force_n[:, 1] * sin
    left = force_n[:, 1] * cos - force_n[:, 0] * sin
    return np.column_stack([along, left, force_n[:, 2]])


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
    if len(time_s) < 3:
        raise SeriesError(f"peaks need at least 3 samples, the series has {len(time_s)}")
    intervals = np.diff(time_s)
    interval = float(np.median(intervals))
    if not np.allclose(intervals, interval, rtol=1e-3, atol=0.0):
        raise SeriesError("peaks need samples at equal intervals, these are not")
    prominence = float(np.std(drag_n, ddof=1)) if min_prominence_n is None else min_prominence_n
    distance = max(1.0, min_separation_s / interval)
    index, found = find_peaks(-drag_n, prominence=prominence, distance=distance)
    return Peaks(index.astype(np.int64), time_s[index], drag_n[index], found["prominences"])


def peak_separation_s(case: Case) -> float:
    """Return the time in which the tool travels one mean ball radius, s."""
    return case.media.radius_mean_m / motion_of(case).speed_m_s


def read_counted(run_dir: Path | str, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the samples of the force on the tool that statistics use.

    Parameters
    ----------
    run_dir : Path or str
        The run folder, with its tables made.
    columns : sequence of str, optional
        Columns to read; all if None.

    Returns
    -------
    DataFrame
        The rows of ``rod_force.parquet`` with ``counted`` true.

    Raises
    ------
    TableError
        If the table is not there.
    """
    file = Path(run_dir) / "tables" / "rod_force.parquet"
    wanted = None if columns is None else list(columns)
    return pd.read_parquet(needed_table(file), columns=wanted, filters=[("counted", "==", True)])


def summarise_forces(run_dir: Path | str) -> dict[str, MeanEstimate]:
    """Mean and spread of the force on the tool in the workpiece frame.

    Parameters
    ----------
    run_dir : Path or str
        The run folder, with its tables made.

    Returns
    -------
    dict of str to MeanEstimate
        For ``drag_n``, ``lateral_n`` and ``vertical_n``, in N.

    Raises
    ------
    TableError
        If ``rod_force.parquet`` is not there.
    SeriesError
        If too few samples are counted.
    """
    names = ("drag_n", "lateral_n", "vertical_n")
    samples = read_counted(run_dir, names)
    return {name: estimate_mean(samples[name].to_numpy()) for name in names}

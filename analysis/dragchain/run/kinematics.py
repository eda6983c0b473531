"""How the workpiece moves: phases of a run, paths, the workpiece's frame, counted samples."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import Phase
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.rotations import Orientations, about_vertical, rotated, wrap_angle


def drag_start_s(case: CaseOfRun) -> float:
    """The simulated time at which the drag begins, the zero of process time."""
    return drag_phase(case).start_step * case.timestep_s


def process_time(simulated_s: Floats, case: CaseOfRun) -> Floats:
    """Process time of simulated times: from the start of the drag, at the speed of the process.

    A workpiece that is f times as fast takes 1/f of the time for the same path.

    Parameters
    ----------
    simulated_s : (N,) ndarray
        Simulated times, s.
    case : CaseOfRun
        The case, of a process.

    Returns
    -------
    (N,) ndarray
        Process times, s.
    """
    return np.asarray((simulated_s - drag_start_s(case)) * case.fidelity.speed_factor)


T = TypeVar("T")


def phase_codes(steps: Ints, phases: Sequence[Phase]) -> NDArray[np.int8]:
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
        raise TableError("case.json lists no phases, so steps cannot be assigned to phases")
    first, last = phases[0].start_step, phases[-1].end_step
    outside = (steps < first) | (steps > last)
    if outside.any():
        step = int(steps[outside][0])
        raise TableError(f"step {step} lies outside the phases, which span {first} to {last}")
    ends = np.array([phase.end_step for phase in phases])
    return np.searchsorted(ends, steps, side="left").astype(np.int8)


def counted_mask(steps: Ints, case: CaseOfRun) -> NDArray[np.bool_]:
    """Mark the samples that statistics use: those of the drag, after the transient.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    case : CaseOfRun
        The case, of a process.

    Returns
    -------
    (N,) ndarray of bool
        True from ``transient_s`` after the start of the drag to its end.
    """
    drag = drag_phase(case)
    elapsed = (steps - drag.start_step) * case.timestep_s
    transient = needed(case.statistics, "statistics").transient_s
    after = elapsed >= transient - 0.5 * case.timestep_s
    return (steps > drag.start_step) & (steps <= drag.end_step) & after


def drag_phase(case: CaseOfRun) -> Phase:
    """The phase named ``drag``."""
    for phase in case.phases:
        if phase.name == "drag":
            return phase
    raise TableError(f"{case.run}: case.json lists no phase named drag")


def needed(value: T | None, name: str) -> T:
    """A value that this scene must have."""
    if value is None:
        raise TableError(f"case.json has no {name}, which these tables require")
    return value


def motion_of(case: CaseOfRun) -> DrivenMotion:
    """The motion of the workpiece in the drag, from the study.

    Raises
    ------
    TableError
        ``case.json`` has no motion, or it is not what this version makes of the study.
    """
    entry = needed(case.motion, "motion")
    start, factor = drag_phase(case).start_step, case.fidelity.speed_factor
    driven = DrivenMotion.of(needed(case.study, "study").motion, case.timestep_s, factor, start)
    made = [driven.path_entry(), *driven.superposed_entries()], [entry, *case.superposed]
    if not _alike(*([motion.model_dump() for motion in entries] for entries in made)):
        raise TableError(
            f"{case.run}: case.json is of another version of dragdeck (motion and superposed do "
            "not follow from the study): render and run it again"
        )
    return driven


def _alike(a: Any, b: Any) -> bool:
    """Whether plain data are the same, numbers up to rounding."""
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12)
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(_alike(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(_alike, a, b))
    return bool(a == b)


def headings(steps: Ints, ref_xy_m: Floats, case: CaseOfRun) -> Floats:
    """Direction of the workpiece's motion in the horizontal plane.

    In the drag that of its path; before it, the direction with which the drag starts.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    ref_xy_m : (N, 2) ndarray
        Reference point of the workpiece at these steps, m.
    case : CaseOfRun
        The case, of a process.

    Returns
    -------
    (N,) ndarray
        Angles from x towards y, rad, in (-pi, pi].
    """
    driven, since = motion_of(case), steps - drag_phase(case).start_step
    start = wrap_angle(driven.motion.path.direction_rad)
    return np.where(since > 0, driven.directions(since, ref_xy_m), start)


def workpiece_rotation(steps: Ints, direction_rad: Floats, case: CaseOfRun) -> Orientations:
    """Orientations of the workpiece's own frame.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    direction_rad : (N,) ndarray
        Direction of motion at these steps, rad.
    case : CaseOfRun
        The case, of a process.
    """
    since = steps - drag_phase(case).start_step
    return motion_of(case).rotation_along(since, direction_rad)


def axis_speed(case: CaseOfRun) -> float:
    """Speed of the workpiece's axis relative to the bowl, the mean along its path, m/s."""
    return needed(case.motion, "motion").axis_speed_m_s


def path_passed(time_s: Floats, case: CaseOfRun) -> Floats:
    """Length of the path up to simulated times, (N,) in m, at the mean speed along it."""
    elapsed, begin = time_s - drag_start_s(case), motion_of(case).drive.begin
    if begin.steps:
        elapsed = begin.advance(elapsed / case.timestep_s) * case.timestep_s
    return np.asarray(elapsed * axis_speed(case))


def drag_surface_speed(case: CaseOfRun) -> float:
    """Highest speed of the workpiece's surface in the drag, m/s: of its axis, and what is added."""
    return axis_speed(case) * (1.0 + case.numbers.get("superposed_speed", 0.0))


def spins(case: CaseOfRun) -> bool:
    """Whether the workpiece turns in the frame of its path."""
    return motion_of(case).motion.turns


def workpiece_velocity(steps: Ints, point_m: Floats, ref_m: Floats, case: CaseOfRun) -> Floats:
    """Velocity of points that are fixed to the workpiece, in the drag.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    point_m : (N, 3) ndarray
        The points at these steps, m.
    ref_m : (N, 3) ndarray
        Reference point of the workpiece at these steps, m.
    case : CaseOfRun
        The case, of a process.

    Returns
    -------
    (N, 3) ndarray
        Velocities, m/s; NaN outside of the drag, of which alone ``case.json``
        gives the motion.
    """
    drag = drag_phase(case)
    velocity = motion_of(case).velocity(steps - drag.start_step, point_m, ref_m)
    dragged = (steps > drag.start_step) & (steps <= drag.end_step)
    return np.where(dragged[:, None], velocity, np.nan)


def bowl_velocity(point_m: Floats, case: CaseOfRun) -> Floats:
    """Velocity of (N, 3) points that are fixed to the bowl, (N, 3) in m/s."""
    return about_vertical(motion_of(case).bowl_rad_s, point_m)


def workpiece_frame(force_n: Floats, direction_rad: Floats) -> Floats:
    """Turn forces into the workpiece frame.

    Parameters
    ----------
    force_n : (N, 3) ndarray
        Forces along x, y, z, N.
    direction_rad : (N,) ndarray
        Direction of motion, rad.

    Returns
    -------
    (N, 3) ndarray
        Forces along the direction of motion, along its left (z cross motion)
        and up, N.
    """
    return rotated(force_n, -direction_rad)

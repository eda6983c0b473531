"""The force on the workpiece: phases, workpiece frame, counted samples, peaks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.case import Case, Circle, Line, Phase


def drag_start_s(case: Case) -> float:
    """The simulated time at which the drag begins, the zero of process time."""
    return drag_phase(case).start_step * case.timestep_s


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
    """Mark the samples that statistics use: those of the drag, after the transient.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    case : Case
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


def drag_phase(case: Case) -> Phase:
    """The phase named ``drag``."""
    for phase in case.phases:
        if phase.name == "drag":
            return phase
    raise TableError(f"{case.run}: case.json lists no phase named drag")


def needed(value: T | None, name: str) -> T:
    """A value that this scene must have."""
    if value is None:
        raise TableError(f"case.json has no {name}, which these tables need")
    return value


def motion_of(case: Case) -> Circle | Line:
    """The motion of the workpiece in the drag."""
    if case.motion is None:
        raise TableError("case.json has no motion, which these tables need")
    return case.motion


def directions(steps: NDArray[np.int64], ref_xy_m: Floats, case: Case) -> Floats:
    """Direction of the workpiece's motion in the horizontal plane.

    On a circle that is ``sense * z x r`` with r the unit vector from the
    bowl's axis to the reference point, in the drag; before it, the direction
    with which the drag starts. On a line it is the line's direction.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    ref_xy_m : (N, 2) ndarray
        Reference point of the workpiece at these steps, m.
    case : Case
        The case, of a process.

    Returns
    -------
    (N,) ndarray
        Angles from x towards y, rad, in (-pi, pi].
    """
    motion = motion_of(case)
    if not isinstance(motion, Circle):
        return np.full(len(steps), wrap_angle(motion.direction_rad))
    radial = np.arctan2(ref_xy_m[:, 1], ref_xy_m[:, 0])
    tangential = wrap_angle(radial + motion.sign * np.pi / 2.0)
    start = wrap_angle(motion.start_direction_rad)
    return np.where(steps > drag_phase(case).start_step, tangential, start)


def workpiece_velocity(
    steps: NDArray[np.int64], point_m: Floats, ref_xy_m: Floats, case: Case
) -> Floats:
    """Velocity of points that are fixed to the workpiece, in the drag.

    A workpiece that turns with its circle rotates about the bowl's axis, w x r with
    w = sense speed / radius; every other workpiece is moved without turning, along
    its heading.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    point_m : (N, 3) ndarray
        The points at these steps, m.
    ref_xy_m : (N, 2) ndarray
        Reference point of the workpiece at these steps, m.
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
    if isinstance(motion, Circle) and motion.orientation == "follow_path":
        turning = motion.sign * motion.axis_speed_m_s / motion.radius_m
        along = turning * np.column_stack([-point_m[:, 1], point_m[:, 0]])
    else:
        heading = directions(steps, ref_xy_m, case)
        along = motion.axis_speed_m_s * np.column_stack([np.cos(heading), np.sin(heading)])
    velocity = np.column_stack([along, np.zeros(len(steps))])
    dragged = (steps > drag.start_step) & (steps <= drag.end_step)
    return np.where(dragged[:, None], velocity, np.nan)


def wrap_angle(angle_rad: ArrayLike) -> Floats:
    """Wrap angles into (-pi, pi]."""
    turned = np.pi - np.asarray(angle_rad, dtype=np.float64)
    return np.asarray(np.pi - np.mod(turned, 2.0 * np.pi))


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
    cos, sin = np.cos(direction_rad), np.sin(direction_rad)
    along = force_n[:, 0] * cos + force_n[:, 1] * sin
    left = force_n[:, 1] * cos - force_n[:, 0] * sin
    return np.column_stack([along, left, force_n[:, 2]])

"""How the workpiece moves: phases of a run, paths, the workpiece's frame, counted samples."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.run.case import Case, Circle, Line, Phase


def drag_start_s(case: Case) -> float:
    """The simulated time at which the drag begins, the zero of process time."""
    return drag_phase(case).start_step * case.timestep_s


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
        raise TableError("case.json lists no phases, so no step can be given one")
    first, last = phases[0].start_step, phases[-1].end_step
    outside = (steps < first) | (steps > last)
    if outside.any():
        step = int(steps[outside][0])
        raise TableError(f"step {step} lies outside the phases, which span {first} to {last}")
    ends = np.array([phase.end_step for phase in phases])
    return np.searchsorted(ends, steps, side="left").astype(np.int8)


def counted_mask(steps: Ints, case: Case) -> NDArray[np.bool_]:
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


@dataclass(frozen=True)
class WorkpiecePath(ABC):
    """How the workpiece is driven in the drag.

    Attributes
    ----------
    axis_speed_m_s : float
        Speed of the workpiece's axis.
    start_direction_rad : float
        Direction of motion when the drag begins, from x towards y.
    """

    axis_speed_m_s: float
    start_direction_rad: float

    @abstractmethod
    def directions(self, ref_xy_m: Floats) -> Floats:
        """Direction of motion, (N,), where the reference point is at (N, 2) places, m."""

    def velocity(self, point_m: Floats, direction_rad: Floats) -> Floats:
        """Horizontal velocity, (N, 2) in m/s, of (N, 3) points that are fixed to the workpiece."""
        across = np.column_stack([np.cos(direction_rad), np.sin(direction_rad)])
        return self.axis_speed_m_s * across

    def turn(self, direction_rad: Floats) -> Floats:
        """Angle of the workpiece's own frame about the vertical at (N,) directions of motion."""
        return direction_rad


@dataclass(frozen=True)
class LinePath(WorkpiecePath):
    """A straight line, along which the workpiece moves without turning."""

    @classmethod
    def of(cls, motion: Line) -> "LinePath":
        """The path of a motion."""
        return cls(motion.axis_speed_m_s, motion.direction_rad)

    def directions(self, ref_xy_m: Floats) -> Floats:
        """The line's direction everywhere."""
        return np.full(len(ref_xy_m), wrap_angle(self.start_direction_rad))


@dataclass(frozen=True)
class CirclePath(WorkpiecePath):
    """A circle about the bowl's axis, with a workpiece that is moved without turning.

    Attributes
    ----------
    sign : int
        1 for a counter-clockwise path, -1 for a clockwise one.
    radius_m : float
        Of the axis' path.
    """

    sign: int
    radius_m: float

    @classmethod
    def of(cls, motion: Circle) -> "CirclePath":
        """The path of a motion."""
        kind = CirclePath if motion.orientation == "fixed" else _TurningCirclePath
        speed, start = motion.axis_speed_m_s, motion.start_direction_rad
        return kind(speed, start, motion.sign, motion.radius_m)

    def directions(self, ref_xy_m: Floats) -> Floats:
        """``sign * z x r`` with r the unit vector from the bowl's axis to the reference point."""
        radial = np.arctan2(ref_xy_m[:, 1], ref_xy_m[:, 0])
        return wrap_angle(radial + self.sign * np.pi / 2.0)

    def turn(self, direction_rad: Floats) -> Floats:
        """The first direction, which the workpiece keeps."""
        return np.full_like(direction_rad, self.start_direction_rad)


@dataclass(frozen=True)
class _TurningCirclePath(CirclePath):
    """A circle whose workpiece turns with it: ``w x r`` with ``w = sign speed / radius``."""

    def velocity(self, point_m: Floats, direction_rad: Floats) -> Floats:
        """Velocity of a rotation about the bowl's axis."""
        turning = self.sign * self.axis_speed_m_s / self.radius_m
        return turning * np.column_stack([-point_m[:, 1], point_m[:, 0]])

    def turn(self, direction_rad: Floats) -> Floats:
        """The direction of motion."""
        return direction_rad


_PATHS: Mapping[str, Callable[[Any], WorkpiecePath]] = {
    "circle": CirclePath.of,
    "line": LinePath.of,
}
"""The path of each kind of motion."""


def path_of(case: Case) -> WorkpiecePath:
    """How the workpiece is driven in the drag."""
    motion = motion_of(case)
    return _PATHS[motion.kind](motion)


def directions(steps: Ints, ref_xy_m: Floats, case: Case) -> Floats:
    """Direction of the workpiece's motion in the horizontal plane.

    In the drag that of its path; before it, the direction with which the drag starts.

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
    path = path_of(case)
    start = wrap_angle(path.start_direction_rad)
    return np.where(steps > drag_phase(case).start_step, path.directions(ref_xy_m), start)


def workpiece_velocity(steps: Ints, point_m: Floats, ref_xy_m: Floats, case: Case) -> Floats:
    """Velocity of points that are fixed to the workpiece, in the drag.

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
    drag = drag_phase(case)
    across = path_of(case).velocity(point_m, directions(steps, ref_xy_m, case))
    velocity = np.column_stack([across, np.zeros(len(steps))])
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

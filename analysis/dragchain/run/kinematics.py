"""How the workpiece moves: phases of a run, paths, the workpiece's frame, counted samples."""

from collections.abc import Sequence
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter

from dragchain.arrays import Floats, Ints, wrap_angle
from dragchain.errors import TableError
from dragchain.run.paths.circle import Circle
from dragchain.run.paths.kind import WorkpiecePath
from dragchain.run.paths.line import Line
from dragchain.run.paths.rest import Rest
from dragchain.run.paths.waypoints import Waypoints
from dragchain.run.superposed.kind import SuperposedMotion
from dragchain.run.superposed.oscillation import Oscillation
from dragchain.run.superposed.spin import Spin
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import Phase

_PATH: TypeAdapter[WorkpiecePath] = TypeAdapter(
    Annotated[Circle | Line | Rest | Waypoints, Field(discriminator="kind")]
)
_SUPERPOSED: TypeAdapter[SuperposedMotion] = TypeAdapter(
    Annotated[Spin | Oscillation, Field(discriminator="kind")]
)


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


def motion_of(case: CaseOfRun) -> WorkpiecePath:
    """The motion of the workpiece in the drag."""
    return _PATH.validate_python(needed(case.motion, "motion").model_dump())


def superposed_on(case: CaseOfRun) -> list[SuperposedMotion]:
    """The motions superposed on the path."""
    return [_SUPERPOSED.validate_python(one.model_dump()) for one in case.superposed]


def directions(steps: Ints, ref_xy_m: Floats, case: CaseOfRun) -> Floats:
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
    path, since = motion_of(case), steps - drag_phase(case).start_step
    start = wrap_angle(path.start_direction_rad)
    return np.where(since > 0, path.directions(since, case.timestep_s, ref_xy_m), start)


def workpiece_turn(steps: Ints, direction_rad: Floats, case: CaseOfRun) -> Floats:
    """Angle of the workpiece's own frame about the vertical, (N,) in rad.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Steps.
    direction_rad : (N,) ndarray
        Direction of motion at these steps, rad.
    case : CaseOfRun
        The case, of a process.
    """
    turn, since = motion_of(case).turn(direction_rad), steps - drag_phase(case).start_step
    for motion in superposed_on(case):
        turn = turn + motion.turn(since, case.timestep_s)
    return turn


def surface_speed(case: CaseOfRun) -> float:
    """Highest speed of the workpiece's surface in the drag, m/s: of its axis, and what is added."""
    return motion_of(case).axis_speed_m_s * (1.0 + case.numbers.get("superposed_speed", 0.0))


def spins(case: CaseOfRun) -> bool:
    """Whether a superposed motion turns the workpiece."""
    return any(one.turns for one in superposed_on(case))


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
    drag, dt = drag_phase(case), case.timestep_s
    since, heading = steps - drag.start_step, directions(steps, ref_m[:, :2], case)
    velocity = motion_of(case).velocity(since, dt, point_m, heading)
    for motion in superposed_on(case):
        velocity = velocity + motion.velocity(since, dt, point_m - ref_m)
    dragged = (steps > drag.start_step) & (steps <= drag.end_step)
    return np.where(dragged[:, None], velocity, np.nan)


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

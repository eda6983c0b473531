"""Where the workpiece goes: plunge, approach, drag.

What is superposed on the path (`dragdeck.study.superposed`) moves the workpiece during the drag
only.

A `Course` is the motion in whole steps, as the engine makes it. Input script, ``case.json``, checks
and preview are made from it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from dragdeck.cases.bed import bed_timestep
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.legs import Place, TimedLeg, drag_in, plunge_point
from dragdeck.scenes.periods import output_periods
from dragdeck.study.model import Motion, Study
from dragdeck.study.paths.kind import Leg, Stages
from dragdeck.study.stages import chain
from dragdeck.study.superposed.kind import DragSteps, EngineMotion, SuperposedOfRun
from dragdeck.study.workpiece import MeshShape

_STAGES_PER_FORMULA = 10
"""Formulas of one stage each take three times as long."""


@dataclass(frozen=True)
class Course:
    """The whole motion of a workpiece.

    Attributes
    ----------
    start_m : tuple of 3 floats
        Its reference point before the plunge.
    turn_rad : float
        Turn about +z, as it starts.
    legs : sequence of TimedLeg
        The last one is the drag.
    drag : DragSteps
    superposed : mapping
        What is superposed on the drag, by name.
    """

    start_m: tuple[float, float, float]
    turn_rad: float
    legs: Sequence[TimedLeg]
    drag: DragSteps
    superposed: Mapping[str, SuperposedOfRun]

    def begun(self) -> Iterator[tuple[TimedLeg, Place]]:
        """Each leg, and where it begins."""
        place: Place = (*self.start_m, self.turn_rad)
        for leg in self.legs:
            yield leg, place
            place = leg.pose(place, leg.steps)

    def pose(self, leg: TimedLeg, begun: Place, steps: float) -> Place:
        """Where the workpiece is so many steps after the beginning of a leg."""
        x, y, z, turn = leg.pose(begun, steps)
        for one in self.superposed.values() if leg is self.legs[-1] else ():
            z += one.lift_m(steps, self.drag.timestep_s)
            turn += one.turn_rad(steps, self.drag.timestep_s)
        return x, y, z, turn


def drag_leg(study: Study) -> TimedLeg:
    """The drag in whole steps, counted from its start.

    Its speed is as much higher or lower than asked as its steps take less or more time: it ends
    at the end of the path.
    """
    motion, timestep = study.motion, bed_timestep(study, "timestep_fraction")
    asked = motion.axis_speed_m_s * study.chosen_fidelity().speed_factor
    return drag_in(max(1, round(motion.path_length_m / asked / timestep)), timestep, motion)


def driven_speed(study: Study) -> float:
    """Speed of the workpiece's axis along its path, or of the bowl under it, m/s: the mean."""
    return float(study.motion.path_length_m / drag_leg(study).duration_s)


def driven_factor(study: Study) -> float:
    """Speed that is driven over the study's own: about the speed factor."""
    return driven_speed(study) / study.motion.axis_speed_m_s


def driven_surface_speed(study: Study, radius_m: float) -> float:
    """The same of the motion that is driven."""
    moving = study.motion.superposed(driven_factor(study)).values()
    return drag_leg(study).fastest_m_s + sum(one.surface_speed_m_s(radius_m) for one in moving)


def workpiece_turn(study: Study) -> float:
    """A mesh looks along +x in its own file: turn it into the direction of motion, rad."""
    if not isinstance(study.workpiece.shape, MeshShape) and not study.motion.tilt_deg:
        return 0.0
    return study.motion.path.direction_rad


def course(study: Study, bed: Bed) -> Course:
    """The motion of a workpiece in a bed."""
    motion, timestep = study.motion, bed_timestep(study, "timestep_fraction")
    clear = round_to(bed.top_m + study.media.radius_mean_m, 6)
    dive = clear - (bed.surface_m - motion.immersion_depth_m + motion.path.start_height_m)
    found, begun, period = list[TimedLeg](), 0, output_periods(study, timestep).network
    for leg in _entry(motion, dive, study.chosen_fidelity().speed_factor):
        timed, steps = _in_periods(leg, timestep, period)
        found.append(TimedLeg(timed, begun, begun + steps, motion.path.direction_rad))
        begun += steps
    last = drag_leg(study)
    drag = DragSteps(begun, begun + last.steps, timestep)
    found.append(replace(last, start_step=drag.start, end_step=drag.end))
    moving = motion.superposed(driven_factor(study))
    return Course(
        start_m=(*plunge_point(motion), clear),
        turn_rad=workpiece_turn(study),
        legs=found,
        drag=drag,
        superposed={name: one.of_run(drag) for name, one in moving.items()},
    )


def on_engine(stages: Stages, start_step: int) -> EngineMotion | None:
    """Velocities that depend on the step only, so that a resumed run goes on; None if no stages."""
    if not stages:
        return None
    variables, last = dict[str, str](), []
    for axis, name in enumerate("xyz"):
        values = [(stage.steps, stage.velocity_m_s[axis]) for stage in stages]
        formulas = chain(f"stage_v{name}", start_step, values, _STAGES_PER_FORMULA)
        variables |= formulas
        last.append(f"v_{[*formulas][-1]}")
    return EngineMotion(variables, f"linear/variable {' '.join(last)}")


def _entry(motion: Motion, dive_m: float, speed_factor: float) -> Iterator[Leg]:
    """Plunge and approach; the tip goes down by `dive_m`."""
    speed = motion.plunge_speed_m_s * speed_factor
    yield Leg("plunge", "linear", dive_m / speed, (0.0, 0.0, -speed))
    begin, end = plunge_point(motion), motion.path.start_point
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    distance = math.hypot(dx, dy)
    if distance:
        speed = motion.approach_speed_m_s * speed_factor
        velocity = (speed * dx / distance, speed * dy / distance, 0.0)
        yield Leg("approach", "linear", distance / speed, velocity)


def _in_periods(leg: Leg, timestep_s: float, period: int) -> tuple[Leg, int]:
    """A leg that is a little slower, and so ends with a whole period of the network; its steps."""
    steps = period * max(1, math.ceil(leg.duration_s / timestep_s / period - 1e-9))
    duration = steps * timestep_s
    slower = leg.duration_s / duration
    x, y, z = (round_to(slower * v, 12) for v in leg.velocity_m_s)
    timed = replace(leg, duration_s=round_to(duration, 12), velocity_m_s=(x, y, z))
    return timed, steps

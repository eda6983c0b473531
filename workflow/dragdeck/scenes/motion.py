"""Where the workpiece goes: plunge, approach, drag.

The workpiece's position is that of its reference point, the centre of its tip. What is superposed
on the path (`dragdeck.study.superposed`) moves the workpiece during the drag only.

A `Course` is the motion in whole steps, as the engine makes it. Input script, ``case.json``, checks
and preview are made from it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from dragdeck.cases.bed import bed_timestep
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.periods import output_periods
from dragdeck.study.model import Motion, Study
from dragdeck.study.paths.kind import Leg, Point, StageOfRun, Stages
from dragdeck.study.stages import chain, in_steps, integral
from dragdeck.study.superposed.kind import DragSteps, EngineMotion, SuperposedOfRun
from dragdeck.study.workpiece import MeshShape

Place = tuple[float, float, float, float]
"""Position of the reference point, m, and turn of the workpiece about +z, rad."""

_STAGES_PER_FORMULA = 10
"""Formulas of one stage each take three times as long."""

_MANY_STEPS = 1_000_000
"""Enough for every stage of a path to have one."""


@dataclass(frozen=True)
class TimedLeg:
    """A leg of the motion in whole steps, as the engine makes it.

    Attributes
    ----------
    leg : Leg
        It ends where it should after its steps.
    start_step, end_step : int
    direction_rad : float
        Direction of the drag from +x when it begins.
    stages : sequence
        Of a leg in stages: their steps and velocities.
    """

    leg: Leg
    start_step: int
    end_step: int
    direction_rad: float
    stages: Stages = ()

    name = property(lambda self: self.leg.name)
    kind = property(lambda self: self.leg.kind)
    duration_s = property(lambda self: self.leg.duration_s)
    velocity_m_s = property(lambda self: self.leg.velocity_m_s)
    angular_speed_rad_s = property(lambda self: self.leg.angular_speed_rad_s)

    @property
    def steps(self) -> int:
        """How many it takes."""
        return self.end_step - self.start_step

    @property
    def speed_m_s(self) -> float:
        """Speed of the workpiece's axis, m/s."""
        return math.hypot(*self.leg.velocity_m_s)

    @property
    def fastest_m_s(self) -> float:
        """Highest speed of the workpiece's axis, m/s."""
        return max(math.hypot(*velocity) for _, velocity in self._velocities())

    @property
    def chord_speed_m_s(self) -> float:
        """Speed along the chord of the arc of a step, m/s: places after whole steps are exact."""
        half = self.leg.angular_speed_rad_s * self.duration_s / self.steps / 2
        return float(self.speed_m_s * math.sin(half) / half)

    @property
    def period_s(self) -> float:
        """Time of a revolution, s."""
        return 2 * math.pi / abs(self.leg.angular_speed_rad_s)

    @property
    def sense(self) -> float:
        """1 counter-clockwise from above, -1 not."""
        return math.copysign(1.0, self.leg.angular_speed_rad_s)

    def pose(self, start: Place, steps: float) -> Place:
        """Where the workpiece is so many steps after it was at the start."""
        x, y, z, turn = start
        time = steps * self.duration_s / self.steps
        if self.kind in ("rotate", "circle"):
            angle = self.leg.angular_speed_rad_s * time
            c, s = math.cos(angle), math.sin(angle)
            return (c * x - s * y, s * x + c * y, z, turn + angle * (self.kind == "rotate"))
        if self.kind == "rest":
            return start
        ends = self._velocities()
        dx, dy, dz = (integral([(end, v[axis]) for end, v in ends], time) for axis in range(3))
        return (x + dx, y + dy, z + dz, turn)

    def corners(self, start: Place) -> list[Place]:
        """Where it begins, changes its velocity and ends: no place of it is farther out."""
        steps = accumulate((stage.steps for stage in self.stages[:-1]), initial=0)
        return [self.pose(start, step) for step in (*steps, self.steps)]

    def _velocities(self) -> Sequence[tuple[float, tuple[float, float, float]]]:
        """End of each stretch of constant velocity from the start, s, and the velocity."""
        timestep = self.duration_s / self.steps
        ends = accumulate(stage.steps for stage in self.stages)
        stages = [
            (end * timestep, stage.velocity_m_s)
            for end, stage in zip(ends, self.stages, strict=True)
        ]
        return stages or [(self.duration_s, self.velocity_m_s)]


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


def plunge_point(motion: Motion) -> Point:
    """Where the workpiece goes in, m."""
    return motion.path.plunge_point if motion.plunge_at_m is None else motion.plunge_at_m


def drag_leg(study: Study) -> TimedLeg:
    """The drag in whole steps, counted from its start.

    Its speed is as much higher or lower than asked as its steps take less or more time: it ends
    at the end of the path.
    """
    motion, timestep = study.motion, bed_timestep(study, "timestep_fraction")
    asked = motion.axis_speed_m_s * study.chosen_fidelity().speed_factor
    return _drag_in(max(1, round(motion.path_length_m / asked / timestep)), timestep, motion)


def _drag_in(steps: int, timestep_s: float, motion: Motion) -> TimedLeg:
    """The drag in so many steps; the places where it starts, turns and ends depend on neither."""
    leg = motion.path.drag(motion.path_length_m / (steps * timestep_s), motion.orientation)
    stages = _staged(leg, steps, timestep_s)
    return TimedLeg(leg, 0, steps, motion.path.direction_rad, stages)


def driven_speed(study: Study) -> float:
    """Speed of the workpiece's axis along its path, or of the bowl under it, m/s: the mean."""
    return float(study.motion.path_length_m / drag_leg(study).duration_s)


def driven_factor(study: Study) -> float:
    """Speed that is driven over the study's own: about the speed factor."""
    return driven_speed(study) / study.motion.axis_speed_m_s


def _corners(motion: Motion) -> list[Place]:
    """Where the drag begins, changes its velocity and ends; heights above the immersion depth."""
    path, duration = motion.path, motion.path_length_m / motion.axis_speed_m_s
    drag = _drag_in(_MANY_STEPS, duration / _MANY_STEPS, motion)
    return drag.corners((*path.start_point, path.start_height_m, 0.0))


def farthest_reach(motion: Motion) -> float:
    """Largest distance of the workpiece's axis from the bowl's, m."""
    aside = sum(one.horizontal_reach_m for one in motion.superposed().values())
    places = [plunge_point(motion), *((x, y) for x, y, _, _ in _corners(motion))]
    return max(math.hypot(x, y) for x, y in places) + aside


def surface_speed(motion: Motion, radius_m: float) -> float:
    """Highest speed of the workpiece's surface in the drag, m/s: of its axis, and what is added.

    The turn of a workpiece that follows a circle is not counted.

    Parameters
    ----------
    motion : Motion
    radius_m : float
        Of the workpiece.
    """
    added = (one.surface_speed_m_s(radius_m) for one in motion.superposed().values())
    return motion.axis_speed_m_s * motion.path.peak_speed_ratio + sum(added)


def driven_surface_speed(study: Study, radius_m: float) -> float:
    """The same of the motion that is driven."""
    moving = study.motion.superposed(driven_factor(study)).values()
    return drag_leg(study).fastest_m_s + sum(one.surface_speed_m_s(radius_m) for one in moving)


def path_heights(motion: Motion) -> tuple[float, float]:
    """Lowest and highest height of the path above the immersion depth, m; 0 is within."""
    heights = [0.0, *(z for _, _, z, _ in _corners(motion))]
    return min(heights), max(heights)


def vertical_range(motion: Motion) -> tuple[float, float]:
    """Lowest and highest height of the tip above the immersion depth, m; 0 is within."""
    reach = sum(one.vertical_reach_m for one in motion.superposed().values())
    low, high = path_heights(motion)
    return low - reach, high + reach


def deepest(motion: Motion) -> float:
    """Largest depth of the tip below the surface in the drag, m."""
    return motion.immersion_depth_m - vertical_range(motion)[0]


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
    found, begun = list[TimedLeg](), 0
    for leg in _entry(motion, dive, study.chosen_fidelity().speed_factor):
        timed, steps = _in_periods(leg, timestep, output_periods(study).network)
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


def _staged(leg: Leg, steps: int, timestep_s: float) -> Stages:
    """The stages of a leg in whole steps; each ends where it should."""
    if not leg.stages:
        return ()
    rates = [[(end, velocity[axis]) for end, velocity in leg.stages] for axis in range(3)]
    found = []
    for count, begin, end in in_steps((end for end, _ in leg.stages), steps, timestep_s):
        moved = (integral(rate, end) - integral(rate, begin) for rate in rates)
        x, y, z = (shift / (count * timestep_s) for shift in moved)
        found.append(StageOfRun(steps=count, velocity_m_s=(x, y, z)))
    return found


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

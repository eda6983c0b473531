"""Legs of the motion in whole steps, and the places that a motion reaches.

The workpiece's position is that of its reference point, the centre of its tip.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from dragdeck.study.model import Motion
from dragdeck.study.paths.kind import Leg, Point, StageOfRun, Stages
from dragdeck.study.stages import in_steps, integral

Place = tuple[float, float, float, float]
"""Position of the reference point, m, and turn of the workpiece about +z, rad."""

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
class Stop:
    """A step of the drag up to which the engine runs, and what is done before and after.

    Attributes
    ----------
    step : int
    youngs_moduli_pa : sequence of float
        Of each type from here on; empty if they stay.
    first : bool
        Whether the run of a lead begins here.
    writes : bool
        Whether the outputs of the drag begin here.
    mark : str
        File into which the state is written then; empty for none.
    """

    step: int
    youngs_moduli_pa: Sequence[float] = ()
    first: bool = False
    writes: bool = False
    mark: str = ""


def plunge_point(motion: Motion) -> Point:
    """Where the workpiece goes in, m."""
    return motion.path.plunge_point if motion.plunge_at_m is None else motion.plunge_at_m


def drag_in(steps: int, timestep_s: float, motion: Motion) -> TimedLeg:
    """The drag in so many steps; the places where it starts, turns and ends depend on neither."""
    leg = motion.path.drag(motion.path_length_m / (steps * timestep_s), motion.orientation)
    stages = _staged(leg, steps, timestep_s)
    return TimedLeg(leg, 0, steps, motion.path.direction_rad, stages)


def _corners(motion: Motion) -> list[Place]:
    """Where the drag begins, changes its velocity and ends; heights above the immersion depth."""
    path, duration = motion.path, motion.path_length_m / motion.axis_speed_m_s
    drag = drag_in(_MANY_STEPS, duration / _MANY_STEPS, motion)
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

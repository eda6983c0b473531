"""Where the workpiece goes: plunge, approach, drag.

The workpiece's position is that of its reference point, the centre of its tip. What is superposed
on the path (`dragdeck.study.superposed`) moves the workpiece during the drag only.
"""

import math
from collections.abc import Iterator, Sequence

from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.study.model import Motion, Study
from dragdeck.study.paths.kind import Leg, Point, StageOfRun, Stages
from dragdeck.study.stages import chain, integral
from dragdeck.study.superposed.kind import DragSteps, EngineMotion

Place = tuple[float, float, float, float]
"""Position of the reference point, m, and turn of the workpiece about +z, rad."""

_STAGES_PER_FORMULA = 10
"""Formulas of one stage each take three times as long."""


def plunge_point(motion: Motion) -> Point:
    """Where the workpiece goes in, m."""
    return motion.path.plunge_point if motion.plunge_at_m is None else motion.plunge_at_m


def farthest_reach(motion: Motion) -> float:
    """Largest distance of the workpiece's axis from the bowl's, m."""
    aside = sum(one.horizontal_reach_m for one in motion.superposed().values())
    return max(math.hypot(*plunge_point(motion)), motion.path.reach_m) + aside


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


def vertical_range(motion: Motion) -> tuple[float, float]:
    """Lowest and highest height of the tip above the immersion depth, m; 0 is within."""
    reach = sum(one.vertical_reach_m for one in motion.superposed().values())
    heights = 0.0, *motion.path.heights_m
    return min(heights) - reach, max(heights) + reach


def deepest(motion: Motion) -> float:
    """Largest depth of the tip below the surface in the drag, m."""
    return motion.immersion_depth_m - vertical_range(motion)[0]


def legs(motion: Motion, dive_m: float, speed_factor: float) -> list[Leg]:
    """The legs of a process run.

    Parameters
    ----------
    motion : Motion
    dive_m : float
        Height that the tip goes down during the plunge.
    speed_factor : float
        On every speed.
    """
    plunge_speed = motion.plunge_speed_m_s * speed_factor
    found = [Leg("plunge", "linear", dive_m / plunge_speed, (0.0, 0.0, -plunge_speed))]
    approach = _approach(motion, speed_factor)
    if approach is not None:
        found.append(approach)
    found.append(motion.path.drag(motion.axis_speed_m_s * speed_factor, motion.orientation))
    return found


def course(
    study: Study, bed: Bed, speed_factor: float
) -> tuple[tuple[float, float, float], list[Leg]]:
    """Where the workpiece's reference point is before the plunge, m, and its legs from there."""
    motion = study.motion
    clear = round_to(bed.top_m + study.media.radius_mean_m, 6)
    dive = clear - (bed.surface_m - motion.immersion_depth_m + motion.path.heights_m[0])
    return (*plunge_point(motion), clear), legs(motion, dive, speed_factor)


def pose(leg: Leg, start: Place, time_s: float) -> Place:
    """Where the path has the workpiece so long after the start of a leg; nothing is superposed."""
    x, y, z, turn = start
    if leg.kind in ("linear", "stages"):
        stages = leg.stages or [(leg.duration_s, leg.velocity_m_s)]
        rates = ([(end, velocity[axis]) for end, velocity in stages] for axis in range(3))
        dx, dy, dz = (integral(rate, time_s) for rate in rates)
        return (x + dx, y + dy, z + dz, turn)
    angle = leg.angular_speed_rad_s * time_s
    c, s = math.cos(angle), math.sin(angle)
    return (c * x - s * y, s * x + c * y, z, turn + angle * (leg.kind == "rotate"))


def axis_course(start: Place, plan: Sequence[Leg], per_leg: int) -> Iterator[Place]:
    """Where the path has the workpiece at equal intervals of time within each leg."""
    for leg in plan:
        for number in range(per_leg + 1):
            yield pose(leg, start, leg.duration_s * number / per_leg)
        start = pose(leg, start, leg.duration_s)


def in_steps(leg: Leg, drag: DragSteps) -> Stages:
    """The stages of a leg that begin before the drag ends; the last of all lasts until then.

    Velocities are such that a stage ends where it should: its rounded length adds no error.
    """
    found: list[StageOfRun] = []
    begun, begun_s, whole = 0, 0.0, drag.end - drag.start
    for number, (end_s, velocity) in enumerate(leg.stages, 1):
        end = max(begun + 1, round(end_s / drag.timestep_s))
        pace = (end_s - begun_s) / ((end - begun) * drag.timestep_s)
        x, y, z = (pace * component for component in velocity)
        until = whole if number == len(leg.stages) else min(end, whole)
        if until > begun:
            found.append(StageOfRun(steps=until - begun, velocity_m_s=(x, y, z)))
        begun, begun_s = end, end_s
    return found


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


def _approach(motion: Motion, speed_factor: float) -> Leg | None:
    begin, end = plunge_point(motion), motion.path.start_point
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    distance = math.hypot(dx, dy)
    if distance == 0:
        return None
    speed = motion.approach_speed_m_s * speed_factor
    velocity = (speed * dx / distance, speed * dy / distance, 0.0)
    return Leg("approach", "linear", distance / speed, velocity)

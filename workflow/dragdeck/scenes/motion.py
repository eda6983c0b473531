"""Where the workpiece goes: plunge, approach, drag.

The workpiece's position is that of its reference point, the centre of its tip.
"""

import math
from dataclasses import dataclass

from dragdeck.study.model import CirclePath, LinePath, Motion

Point = tuple[float, float]


@dataclass(frozen=True)
class Leg:
    """A stretch of motion at one speed.

    Attributes
    ----------
    name : str
        ``plunge``, ``approach`` or ``drag``.
    kind : str
        ``linear`` (along `velocity_m_s`), ``rotate`` (about the bowl's axis, the
        workpiece turning with it) or ``circle`` (about the bowl's axis, the workpiece
        keeping its orientation).
    duration_s : float
    velocity_m_s : tuple of 3 floats
        At the beginning of the leg.
    angular_speed_rad_s : float
        About +z; zero for a linear leg.
    """

    name: str
    kind: str
    duration_s: float
    velocity_m_s: tuple[float, float, float]
    angular_speed_rad_s: float = 0.0


def start_point(motion: Motion) -> Point:
    """Where the drag begins, m."""
    path = motion.path
    return (path.radius_m, 0.0) if isinstance(path, CirclePath) else path.start_m


def plunge_point(motion: Motion) -> Point:
    """Where the workpiece goes in, m."""
    if motion.plunge_at_m is not None:
        return motion.plunge_at_m
    return (0.0, 0.0) if isinstance(motion.path, CirclePath) else motion.path.start_m


def start_direction(motion: Motion) -> float:
    """Direction of motion from +x when the drag begins, rad."""
    path = motion.path
    if isinstance(path, CirclePath):
        return path.sign * math.pi / 2
    return math.radians(path.direction_deg)


def farthest_reach(motion: Motion) -> float:
    """Largest distance of the workpiece's axis from the bowl's, m."""
    points = [plunge_point(motion), start_point(motion)]
    if isinstance(motion.path, LinePath):
        heading = start_direction(motion)
        x, y = motion.path.start_m
        length = motion.path.length_m
        points.append((x + length * math.cos(heading), y + length * math.sin(heading)))
    return max(math.hypot(*point) for point in points)


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
    found.append(_drag(motion, motion.speed_m_s * speed_factor))
    return found


def _approach(motion: Motion, speed_factor: float) -> Leg | None:
    begin, end = plunge_point(motion), start_point(motion)
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    distance = math.hypot(dx, dy)
    if distance == 0:
        return None
    speed = motion.approach_speed_m_s * speed_factor
    velocity = (speed * dx / distance, speed * dy / distance, 0.0)
    return Leg("approach", "linear", distance / speed, velocity)


def _drag(motion: Motion, speed: float) -> Leg:
    heading = start_direction(motion)
    velocity = (speed * math.cos(heading), speed * math.sin(heading), 0.0)
    duration = motion.path_length_m / speed
    if isinstance(motion.path, LinePath):
        return Leg("drag", "linear", duration, velocity)
    angular = motion.path.sign * speed / motion.path.radius_m
    kind = "rotate" if motion.orientation == "follow_path" else "circle"
    return Leg("drag", kind, duration, velocity, angular)

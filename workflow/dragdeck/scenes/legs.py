"""Legs of the motion in whole steps, and the places that a motion reaches.

The workpiece's position is that of its reference point, the centre of its tip.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dragdeck.study.drive import EngineMotion
from dragdeck.study.model import Motion
from dragdeck.study.paths.path import Point, Vector
from dragdeck.study.rotation import Floats


@dataclass(frozen=True)
class Leg:
    """A stretch of the motion in whole steps; it ends where it should after them.

    Attributes
    ----------
    name : str
        ``plunge``, ``approach`` or ``drag``.
    start_step, end_step : int
    duration_s : float
    velocity_m_s : tuple of 3 floats
        At its beginning.
    motion : EngineMotion
        How the engine makes it.
    """

    name: str
    start_step: int
    end_step: int
    duration_s: float
    velocity_m_s: Vector
    motion: EngineMotion

    @property
    def steps(self) -> int:
        """How many it takes."""
        return self.end_step - self.start_step

    @property
    def speed_m_s(self) -> float:
        """Speed of the workpiece's axis at its beginning, m/s."""
        return math.hypot(*self.velocity_m_s)

    def straight_on(self, begun: Floats, steps: Floats) -> Floats:
        """Places, (N, 3), after (N,) steps from where it begins, at that velocity."""
        time = steps * self.duration_s / self.steps
        return np.asarray(begun + time[:, None] * np.array(self.velocity_m_s))


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


def farthest_reach(motion: Motion) -> float:
    """Largest distance of the workpiece's axis from the bowl's, m."""
    aside = sum(one.horizontal_reach_m for one in motion.superposed().values())
    places = [plunge_point(motion), *motion.path.corners[:, :2].tolist()]
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
    axis = motion.axis_speed_m_s * motion.path.peak_speed_ratio
    return axis + added_speed(motion, radius_m, 1.0)


def added_speed(motion: Motion, radius_m: float, factor: float) -> float:
    """What turning and superposed motions add to the speed of the axis at most, m/s.

    Parameters
    ----------
    motion : Motion
    radius_m : float
        Of the workpiece.
    factor : float
        On the study's own speeds.
    """
    turning = motion.path.turning_rad_s if motion.leans else 0.0
    arm = math.hypot(radius_m, deepest(motion))
    moving = motion.superposed(factor).values()
    return turning * factor * arm + sum(one.surface_speed_m_s(radius_m) for one in moving)


def path_heights(motion: Motion) -> tuple[float, float]:
    """Lowest and highest height of the path above the immersion depth, m; 0 is within."""
    heights = [0.0, *motion.path.corners[:, 2].tolist()]
    return min(heights), max(heights)


def vertical_range(motion: Motion) -> tuple[float, float]:
    """Lowest and highest height of the tip above the immersion depth, m; 0 is within."""
    reach = sum(one.vertical_reach_m for one in motion.superposed().values())
    low, high = path_heights(motion)
    return low - reach, high + reach


def deepest(motion: Motion) -> float:
    """Largest depth of the tip below the surface in the drag, m."""
    return motion.immersion_depth_m - vertical_range(motion)[0]

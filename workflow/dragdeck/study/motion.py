"""The motion of a workpiece: immersion, path, and what is superposed on it."""

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from dragdeck.parts import omitted
from dragdeck.study.base import Model, NonNegative, Number, Positive, Whole
from dragdeck.study.bowl_motions.acceleration import Acceleration
from dragdeck.study.bowl_motions.rotation import Rotation
from dragdeck.study.bowl_motions.vibration import Vibration
from dragdeck.study.paths.circle import CirclePath
from dragdeck.study.paths.figure_eight import FigureEightPath
from dragdeck.study.paths.line import LinePath
from dragdeck.study.paths.path import Point, as_rows, turned
from dragdeck.study.paths.rest import RestPath
from dragdeck.study.paths.waypoints import WaypointsPath
from dragdeck.study.rotations import about_vertical
from dragdeck.study.superposed.motion import SuperposedMotion
from dragdeck.study.superposed.oscillation import Oscillation
from dragdeck.study.superposed.spin import Spin, SpinStage


class Superposed(Model):
    """The registry of superposed motions: the block of each kind, in the order of application.

    A motion carries the centres of those that follow it: what turns the workpiece comes last.
    """

    oscillation: Oscillation | None = None
    spin: Spin | None = None

    def superposed(self, speed_factor: float = 1.0) -> Mapping[str, SuperposedMotion]:
        """What is superposed on the path, by the name of its block, at this factor on speeds."""
        motions = {name: getattr(self, name) for name in Superposed.model_fields}
        return {
            name: motion.faster(speed_factor)
            for name, motion in motions.items()
            if motion is not None
        }


AnyPath = CirclePath | FigureEightPath | LinePath | RestPath | WaypointsPath
"""The registry of paths."""

AnyBowlMotion = Annotated[Acceleration | Rotation | Vibration, Field(discriminator="kind")]
"""The registry of motions of the bowl."""


_PLACES = 1001
"""Of a path, at which speeds are compared."""


BED_FRICTION_DEG = 26.0
"""Angle of friction of a bed of spheres, from the tilt of the surface in a turning bowl (friction
0.34 between particles)."""


_MOST_TURNED_DEG = 180
"""From one waypoint to the next: beyond, the shortest rotation is another one."""


class Motion(Superposed):
    """Immersion and path of the workpiece."""

    path: Annotated[AnyPath, Field(discriminator="kind")]
    speed_m_s: Positive | None = None
    """speed of the workpiece's axis along the path, m/s; required except for `rest` and
    `waypoints`"""
    ramp_s: NonNegative = omitted(0.0)
    """duration of the start from rest along the path, s, with `speed_factor` 1; excluded from all
    statistics; not for `rest` and `waypoints`"""
    immersion_depth_m: Positive
    """depth of the tip below the settled surface, m"""
    orientation: Literal["follow_path", "fixed"] = "follow_path"
    """follow_path: the workpiece turns with its path; fixed: it does not turn"""
    tilt_deg: Annotated[Number, Field(ge=-45, le=45)] | None = None
    """inclination of the workpiece, degrees; positive: its upper end leans in the direction of
    motion, with orientation fixed in the first one; `spin` is then about the inclined axis"""
    bowl: AnyBowlMotion | None = None
    """motion of the bowl during the whole process; none: it rests"""
    bed_friction_deg: Annotated[Number, Field(ge=0, lt=90)] = omitted(BED_FRICTION_DEG)
    """angle of friction of the bed, degrees, by which its surface in a rotating bowl is less
    inclined than that of a liquid"""
    plunge_at_m: tuple[Number, Number] | None = None
    """x and y of the immersion, m; none: the bowl's axis for a circle, otherwise the start of the
    path"""
    plunge_speed_m_s: Positive = 0.05
    """vertical speed during the plunge, m/s"""
    approach_speed_m_s: Positive = 0.02
    """speed from the place of immersion to the start of the path, m/s"""
    transient_m: NonNegative
    """initial path length excluded from all statistics, m"""
    counted_from_revolution: Annotated[Whole, Field(ge=1)] | None = None
    """first revolution of a circle that the statistics include; none: all after `transient_m`"""

    @model_validator(mode="after")
    def _path(self) -> "Motion":
        if self.counted_from_revolution is not None and self.path.revolution_m is None:
            raise ValueError(
                "counted_from_revolution applies to circles only: this path has no revolutions"
            )
        if (self.path.turning or self.path.inclined) and self.spin is not None:
            raise ValueError("spin and waypoints that turn cannot be combined: remove one of them")
        if self.inclined and self.path.most_turned_deg >= _MOST_TURNED_DEG:
            raise ValueError(
                f"an inclined workpiece turns by {self.path.most_turned_deg:g} degrees from one "
                f"waypoint to the next, not by less than {_MOST_TURNED_DEG}: add waypoints"
            )
        if self.bowl is not None and self.path.bowl_rad_s(1.0):
            raise ValueError(
                f"motion.bowl cannot be used: the path `{self.path.kind}` rotates the bowl itself"
            )
        if self.ramp_s and self.path.own_speed_m_s is not None:
            raise ValueError("ramp_s cannot be used: the path itself gives the speed")
        if self.speed_m_s is None and self.path.own_speed_m_s is None:
            raise ValueError("speed_m_s is missing: give the speed along the path, m/s")
        if self.speed_m_s is not None and self.path.own_speed_m_s is not None:
            raise ValueError(
                f"speed_m_s {self.speed_m_s:g} and the path's own speed, "
                f"{self.path.own_speed_m_s:.3g} m/s, are both given: remove speed_m_s"
            )
        return self

    def superposed(self, speed_factor: float = 1.0) -> Mapping[str, SuperposedMotion]:
        """What is superposed on the path, the rotation that it gives included."""
        motions = super().superposed(speed_factor)
        if not self.path.turning or self.inclined:
            return motions
        stages = [SpinStage(until_s=end, rpm=rpm) for end, rpm in self.path.turning]
        return {**motions, "spin": Spin(schedule=stages, ramp_s=0.0).faster(speed_factor)}

    @property
    def inclined(self) -> bool:
        """Whether the workpiece's axis is ever inclined."""
        return bool(self.tilt_deg) or self.path.inclined

    @property
    def turns(self) -> bool:
        """Whether the workpiece turns in the frame of its path."""
        by_path = self.path.inclined or bool(self.path.turning)
        return by_path or any(motion.turns for motion in self.superposed().values())

    @property
    def turns_about_inclined_axis(self) -> bool:
        """Whether the workpiece spins about an axis that is not upright."""
        return bool(self.tilt_deg) and self.spin is not None

    @property
    def nominal_speed_m_s(self) -> float:
        """Speed of the workpiece's axis along its path, m/s.

        It is that relative to the bowl unless `bowl` moves it.
        """
        return self.path.own_speed_m_s or self.speed_m_s or math.nan

    @property
    def speed_in_bowl_m_s(self) -> float:
        """Speed of the workpiece's axis relative to the bowl, m/s: the highest, if that rotates."""
        rate = self.bowl.rad_s if self.bowl else 0.0
        if not rate:
            return self.nominal_speed_m_s
        share = np.linspace(0.0, 1.0, _PLACES)
        place, along = (as_rows(part(share)) for part in (self.path.place, self.path.tangent))
        speed = along * self.nominal_speed_m_s / self.path_length_m
        return float(np.linalg.norm(speed - about_vertical(rate, place), axis=1).max())

    @property
    def bowl_rad_s(self) -> float:
        """Angular speed of the bowl about +z, rad/s."""
        by_path = self.path.bowl_rad_s(self.nominal_speed_m_s)
        return self.bowl.rad_s if self.bowl else by_path

    @property
    def path_length_m(self) -> float:
        """Length of the drag, m."""
        return self.path.path_length_m

    @property
    def against_bed(self) -> float:
        """Angular speed on a circle against a bed that turns, over that of the path."""
        if self.bowl is None:
            return 1.0
        x, y = self.path.start_point
        rate = self.nominal_speed_m_s / math.hypot(x, y)
        sense = math.sin(self.path.direction_rad - math.atan2(y, x))
        return 1.0 - self.bowl.rad_s / math.copysign(rate, sense)

    @property
    def plunge_point(self) -> Point:
        """Where the workpiece goes in, m."""
        return self.path.plunge_point if self.plunge_at_m is None else self.plunge_at_m

    @property
    def farthest_m(self) -> float:
        """Largest distance of the workpiece's axis from the bowl's."""
        places = [self.plunge_point, *self.path.corners[:, :2].tolist()]
        return max(math.hypot(x, y) for x, y in places)

    @property
    def path_heights_m(self) -> tuple[float, float]:
        """Lowest and highest height of the path above the immersion depth; 0 is within."""
        heights = [0.0, *self.path.corners[:, 2].tolist()]
        return min(heights), max(heights)

    @property
    def vertical_range_m(self) -> tuple[float, float]:
        """Lowest and highest height of the tip above the immersion depth; 0 is within."""
        reach = sum(superposed.vertical_reach_m for superposed in self.superposed().values())
        low, high = self.path_heights_m
        return low - reach, high + reach

    @property
    def deepest_m(self) -> float:
        """Largest depth of the tip below the surface in the drag."""
        return self.immersion_depth_m - self.vertical_range_m[0]

    def surface_speed_m_s(self, radius_m: float) -> float:
        """Highest speed of a workpiece's surface in the drag: of its axis, and what is added.

        The turn of a workpiece that follows a circle is not counted.
        """
        axis = self.nominal_speed_m_s * self.path.peak_speed_ratio
        return max(axis, self.speed_in_bowl_m_s) + self.added_speed_m_s(radius_m, 1.0)

    def added_speed_m_s(self, radius_m: float, factor: float) -> float:
        """What turning and superposed motions add to the speed of the axis at most.

        Parameters
        ----------
        radius_m : float
            Of the workpiece.
        factor : float
            On the study's own speeds.
        """
        turning = self.path.turning_rad_s if self.inclined else 0.0
        moving = self.superposed(factor).values()
        turned = turning * factor * math.hypot(radius_m, self.deepest_m)
        return turned + sum(superposed.surface_speed_m_s(radius_m) for superposed in moving)

    @property
    def uncounted_m(self) -> float:
        """Length of the drag before the statistics begin, m: what is superposed has started."""
        whole = (self.path.revolution_m or 0.0) * ((self.counted_from_revolution or 1) - 1)
        starts = (self.passed_m(motion.ramp_s) for motion in self.superposed().values())
        risen = self.passed_m(self.bowl_ramp_s)
        return max(self.transient_m, whole, self.passed_m(self.ramp_s), risen, *starts)

    @property
    def bowl_ramp_s(self) -> float:
        """Time of the drag in which the amplitudes of the bowl still rise, s; below 0: before."""
        entry = self.immersion_depth_m / self.plunge_speed_m_s
        entry += math.dist(self.plunge_point, self.path.start_point) / self.approach_speed_m_s
        return float(getattr(self.bowl, "ramp_s", 0.0)) - entry

    def passed_m(self, time_s: float) -> float:
        """Length of the path after a time, at the end of its start or later, m."""
        return (max(time_s, self.ramp_s) - self.ramp_s / 2) * self.nominal_speed_m_s

    def turned(self, angle_deg: float, depth_m: float | None = None) -> "Motion":
        """The same motion turned about the bowl's axis, immersed where the drag begins.

        Parameters
        ----------
        angle_deg : float
        depth_m : float, optional
            Another immersion depth.
        """
        path, place = self.path.turned(angle_deg), self.plunge_at_m
        at = path.start_point if place is None else turned(place, angle_deg)
        depth = depth_m or self.immersion_depth_m
        return self.model_copy(update={"path": path, "plunge_at_m": at, "immersion_depth_m": depth})

    def at(self, pace: float, length_m: float) -> "Motion":
        """The drag at another pace and with another length, all of it counted.

        Parameters
        ----------
        pace : float
            On every speed of the drag.
        length_m : float
        """
        speed = None if self.speed_m_s is None else pace * self.speed_m_s
        return self.model_copy(
            update={
                "path": self.path.with_length(length_m).faster(pace),
                "speed_m_s": speed,
                "transient_m": 0.0,
                "ramp_s": 0.0,
                "counted_from_revolution": None,
                **self.superposed(pace),
            }
        )

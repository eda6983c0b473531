"""A circle about the bowl's axis."""

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.parts import omitted
from dragdeck.study.base import Json, Number, Positive
from dragdeck.study.drive import Drive, EngineMotion, Orientation
from dragdeck.study.paths.path import AroundBowl, Point
from dragdeck.study.rotations import about_vertical, rotated, wrap_angle
from dragdeck.study.stages import StepCounts


class CirclePath(AroundBowl):
    """A circle about the bowl's axis."""

    kind: Literal["circle"]
    """circle about the bowl's axis"""
    radius_m: Positive
    """radius of the path of the workpiece's axis, m"""
    start_deg: Number = omitted(0.0)
    """polar angle of the start of the path about the bowl's axis, from +x, degrees"""
    revolutions: Positive = 1.0
    """length of the path in revolutions"""
    direction: Literal["ccw", "cw"] = "ccw"
    """direction of motion seen from above: counter-clockwise or clockwise"""

    @property
    def sign(self) -> int:
        """1 for a counter-clockwise path, -1 for a clockwise one."""
        return 1 if self.direction == "ccw" else -1

    @property
    def plunge_point(self) -> Point:
        """The bowl's axis."""
        return 0.0, 0.0

    @property
    def direction_rad(self) -> float:
        """Along the circle."""
        return self.start_rad + self.sign * math.pi / 2

    def words(self, number: Callable[[float], str]) -> str:
        """With its radius."""
        return f"circle of radius {number(1e3 * self.radius_m)} mm"

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """If it turns with the path."""
        return self.turns(orientation)

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """Round the circle."""
        angle = self.start_rad + self._whole_rad * share
        return self.radius_m * np.cos(angle), self.radius_m * np.sin(angle), 0.0

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """Across the radius."""
        x, y, _ = self.place(share)
        return -self._whole_rad * y, self._whole_rad * x, 0.0

    @property
    def _whole_rad(self) -> float:
        return self.sign * 2 * math.pi * self.revolutions

    def places(self, drive: Drive, since: StepCounts, begun: Floats) -> Floats:
        """About the bowl's axis, from wherever it begins."""
        return rotated(np.tile(begun, (len(since), 1)), self._angle(drive, since))

    def turn(self, drive: Drive, since: StepCounts) -> Floats:
        """As far as it has gone round."""
        angle = self._angle(drive, since)
        return angle if self.turns(drive.orientation) else np.zeros_like(angle)

    def _angle(self, drive: Drive, since: StepCounts) -> Floats:
        return np.asarray(self._engine_rad_s(drive) * drive.time_s(since))

    def _engine_rad_s(self, drive: Drive) -> float:
        return self.sign * drive.full_speed_m_s / self.radius_m

    def directions(self, drive: Drive, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """Across the radius to the reference point, where it is."""
        radial = np.arctan2(ref_xy_m[:, 1], ref_xy_m[:, 0])
        return wrap_angle(radial + self.sign * np.pi / 2.0)

    def velocity(self, drive: Drive, since: StepCounts, point_m: Floats, ref_m: Floats) -> Floats:
        """``w x r`` with ``w = sign speed / radius`` if the workpiece turns with its path."""
        if not self.turns(drive.orientation):
            return self.straight_on(drive, since, self.directions(drive, since, ref_m[:, :2]))
        rate = self.sign * drive.speed_m_s / self.radius_m * drive.begin.pace(since)
        return about_vertical(rate, point_m)

    def on_engine(self, drive: Drive) -> EngineMotion:
        """A rotation about the bowl's axis, or a circle without turning."""
        rate = self._engine_rad_s(drive)
        if drive.begin.steps:
            return super().on_engine(drive)
        if self.turns(drive.orientation):
            sense, period = math.copysign(1.0, rate), 2 * math.pi / abs(rate)
            return EngineMotion(
                {"": f"rotate origin 0. 0. 0. axis 0. 0. {sense!r} period {period!r}"},
                comment="rotation about the axis of the bowl: the orientation of the workpiece "
                "follows the path",
            )
        half = rate * drive.full_duration_s / drive.steps / 2
        chord = math.hypot(*self.first_velocity(drive)) * math.sin(half) / half
        return EngineMotion(
            {"": "linear/variable v_workpiece_vx v_workpiece_vy v_workpiece_vz"},
            {
                "turned": f"{self.direction_rad!r}+{rate!r}*(step-{drive.start}-0.5)*dt",
                "workpiece_vx": f"{chord!r}*cos(v_turned)",
                "workpiece_vy": f"{chord!r}*sin(v_turned)",
                "workpiece_vz": "0.0",
            },
            "circular path with fixed orientation: the velocity turns, the workpiece does not",
        )

    def heading_formula(self, drive: Drive) -> str | float:
        """The angle that it has gone round."""
        if not self.turns(drive.orientation):
            return self.direction_rad
        advance = drive.begin.formula(drive.start)
        return f"({self.direction_rad!r}+{self._engine_rad_s(drive)!r}*{advance}*dt)"

    def entry(self, drive: Drive) -> Json:
        """The circle."""
        return {"radius_m": self.radius_m, "direction": self.direction}

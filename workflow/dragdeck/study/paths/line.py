"""A straight line."""

import math
from collections.abc import Callable
from typing import Any, ClassVar, Literal, Self

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.study.base import Json, Number, Positive
from dragdeck.study.drive import Drive, EngineMotion
from dragdeck.study.paths.path import FromPlace, Point, as_rows
from dragdeck.study.rotations import wrap_angle
from dragdeck.study.stages import StepCounts


class LinePath(FromPlace):
    """A straight line."""

    length_field: ClassVar[str] = "length_m"
    place_field: ClassVar[str] = "start_m"
    one_direction: ClassVar[bool] = True

    kind: Literal["line"]
    """straight line"""
    start_m: tuple[Number, Number]
    """x and y of the workpiece's axis at the start of the drag, m"""
    direction_deg: Number = 0.0
    """direction of motion, from +x, degrees"""
    length_m: Positive
    """length of the drag, m"""

    def words(self, number: Callable[[float], str]) -> str:
        """A line."""
        return "straight line"

    @property
    def path_length_m(self) -> float:
        """The length."""
        return self.length_m

    @property
    def peak_speed_ratio(self) -> float:
        """It has one speed."""
        return 1.0

    @property
    def start_point(self) -> Point:
        """The start."""
        return self.start_m

    @property
    def direction_rad(self) -> float:
        """The direction."""
        return math.radians(self.direction_deg)

    @property
    def corners(self) -> Floats:
        """Its ends."""
        return as_rows(self.place(np.array([0.0, 1.0])))

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """Straight on."""
        x, y, _ = self.tangent(share)
        return self.start_m[0] + x * share, self.start_m[1] + y * share, 0.0

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """The same everywhere."""
        heading = self.direction_rad
        return self.length_m * math.cos(heading), self.length_m * math.sin(heading), 0.0

    def with_length(self, length_m: float) -> Self:
        """As long as that."""
        return self.model_copy(update={"length_m": length_m})

    def places(self, drive: Drive, since: StepCounts, begun: Floats) -> Floats:
        """As far as its velocity takes it."""
        moved = drive.time_s(since)[:, None] * np.array(self.first_velocity(drive))
        return np.asarray(begun + moved)

    def directions(self, drive: Drive, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """The line's direction everywhere."""
        return np.full(len(ref_xy_m), wrap_angle(self.direction_rad))

    def velocity(self, drive: Drive, since: StepCounts, point_m: Floats, ref_m: Floats) -> Floats:
        """The same everywhere."""
        return self.straight_on(drive, since, self.directions(drive, since, ref_m[:, :2]))

    def on_engine(self, drive: Drive) -> EngineMotion:
        """A constant velocity."""
        if drive.begin.steps:
            return super().on_engine(drive)
        x, y, z = self.first_velocity(drive)
        return EngineMotion({"": f"linear {x!r} {y!r} {z!r}"})

    def entry(self, drive: Drive) -> Json:
        """Start and direction."""
        return {"start_m": list(self.start_m), "direction_rad": self.direction_rad}

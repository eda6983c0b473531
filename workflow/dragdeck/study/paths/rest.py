"""A workpiece that stands still in a rotating bowl (stream finishing)."""

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import field_validator

from dragdeck.arrays import Floats
from dragdeck.parts import omitted
from dragdeck.study.base import Json, Number, Positive
from dragdeck.study.drive import Drive, EngineMotion, Orientation
from dragdeck.study.paths.path import AroundBowl
from dragdeck.study.stages import StepCounts


class RestPath(AroundBowl):
    """A place, and the bowl's rotation.

    Seen from the bowl, the workpiece goes round against the rotation.
    """

    one_direction: ClassVar[bool] = True

    kind: Literal["rest"]
    """the workpiece stands still, the bowl rotates"""
    radius_m: Positive
    """distance between the axes of workpiece and bowl, m"""
    bowl_rpm: Number
    """rotational speed of the bowl, 1/min; positive: counter-clockwise seen from above"""
    start_deg: Number = omitted(0.0)
    """polar angle of the start of the path about the bowl's axis, from +x, degrees"""
    revolutions: Positive = 1.0
    """length of the drag in revolutions of the bowl"""

    @field_validator("bowl_rpm")
    @classmethod
    def _turns(cls, value: float) -> float:
        if value == 0:
            raise ValueError("the bowl must rotate: without rotation nothing moves")
        return value

    @property
    def direction_rad(self) -> float:
        """Against the rotation of the bowl."""
        return self.start_rad - math.copysign(math.pi / 2, self.bowl_rpm)

    @property
    def own_speed_m_s(self) -> float:
        """Speed of the bowl where the workpiece stands."""
        return abs(self.bowl_rpm * 2 * math.pi / 60) * self.radius_m

    @property
    def implied(self) -> Mapping[str, float]:
        """Its speed."""
        return {"motion.path.speed_m_s": self.own_speed_m_s}

    def words(self, number: Callable[[float], str]) -> str:
        """With its radius."""
        return f"at rest at {number(1e3 * self.radius_m)} mm from the axis of a rotating bowl"

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """It stands still."""
        return True

    def bowl_rad_s(self, speed_m_s: float) -> float:
        """The speed over the radius, with the sign of the rotation."""
        return math.copysign(speed_m_s / self.radius_m, self.bowl_rpm)

    def faster(self, factor: float) -> Self:
        """With a bowl that rotates faster."""
        return self.model_copy(update={"bowl_rpm": factor * self.bowl_rpm})

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """Where it stands."""
        return (*self.start_point, 0.0)

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """None."""
        return 0.0, 0.0, 0.0

    def places(self, drive: Drive, since: StepCounts, begun: Floats) -> Floats:
        """Where it begins."""
        return np.tile(begun, (len(since), 1))

    def directions(self, drive: Drive, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """The same at all times."""
        return np.full(len(ref_xy_m), self.direction_rad)

    def on_engine(self, drive: Drive) -> EngineMotion:
        """No motion."""
        return EngineMotion({})

    def entry(self, drive: Drive) -> Json:
        """The place and the rotation."""
        return {"radius_m": self.radius_m, "bowl_rad_s": self.bowl_rad_s(drive.speed_m_s)}

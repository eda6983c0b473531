"""A workpiece that stands still in a rotating bowl (stream finishing)."""

import math
from collections.abc import Mapping
from typing import ClassVar, Literal, Self

from pydantic import Field, field_validator

from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.paths.kind import AroundBowl, Leg, Orientation, PathOfRun, Stages


class RestOfRun(PathOfRun):
    """A workpiece at rest in a rotating bowl: its distance from the axis, and the rotation."""

    kind: Literal["rest"] = "rest"
    radius_m: float
    bowl_rad_s: float


class RestPath(AroundBowl, Model):
    """A place, and the bowl's rotation.

    Seen from the bowl, the workpiece goes round against the rotation.
    """

    part: ClassVar[type[PathOfRun]] = RestOfRun

    kind: Literal["rest"] = Field(
        description="rest: the workpiece stands still and the bowl rotates"
    )
    radius_m: Positive = Field(description="distance between the axes of workpiece and bowl, m")
    bowl_rpm: Number = Field(
        description="rotational speed of the bowl, 1/min; positive: counter-clockwise seen from "
        "above"
    )
    start_deg: Number = Field(
        default=0.0,
        description="polar angle of the start of the path about the bowl's axis, from +x, degrees",
        exclude_if=lambda value: value == 0,
    )
    revolutions: Positive = Field(
        default=1.0, description="length of the drag in revolutions of the bowl"
    )

    @field_validator("bowl_rpm")
    @classmethod
    def _turns(cls, value: float) -> float:
        if value == 0:
            raise ValueError("the bowl must rotate: without rotation nothing moves")
        return value

    @property
    def _bowl_rad_s(self) -> float:
        return self.bowl_rpm * 2 * math.pi / 60

    @property
    def direction_rad(self) -> float:
        """Against the rotation of the bowl."""
        return self.start_rad - math.copysign(math.pi / 2, self.bowl_rpm)

    @property
    def own_speed_m_s(self) -> float:
        """Speed of the bowl where the workpiece stands."""
        return abs(self._bowl_rad_s) * self.radius_m

    @property
    def implied(self) -> Mapping[str, float]:
        """Its speed."""
        return {"motion.path.speed_m_s": self.own_speed_m_s}

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """It stands still."""
        return True

    def bowl_rad_s(self, speed_m_s: float) -> float:
        """The speed over the radius, with the sign of the rotation."""
        return math.copysign(speed_m_s / self.radius_m, self.bowl_rpm)

    def faster(self, factor: float) -> Self:
        """With a bowl that rotates faster."""
        return self.model_copy(update={"bowl_rpm": factor * self.bowl_rpm})

    def turned(self, angle_deg: float) -> Self:
        """Begun at another angle."""
        return self.model_copy(update={"start_deg": self.start_deg + angle_deg})

    def with_length(self, length_m: float) -> Self:
        """As many revolutions of the bowl as give the length."""
        return self.model_copy(update={"revolutions": length_m / self.revolution_m})

    def drag(self, speed_m_s: float, orientation: Orientation) -> Leg:
        """No motion, for as long as the revolutions of the bowl take."""
        return self.steady_leg("rest", speed_m_s)

    def of_run(self, speed_m_s: float, orientation: Orientation, stages: Stages) -> RestOfRun:
        """The place and the rotation."""
        return RestOfRun(
            axis_speed_m_s=speed_m_s,
            start_direction_rad=self.direction_rad,
            orientation=orientation,
            radius_m=self.radius_m,
            bowl_rad_s=self.bowl_rad_s(speed_m_s),
        )

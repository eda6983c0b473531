"""A circle about the bowl's axis."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field

from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.paths.kind import AroundBowl, Leg, Orientation, PathOfRun, Point, Stages


class CircleOfRun(PathOfRun):
    """A circle about the bowl's axis, its direction seen from above."""

    kind: Literal["circle"] = "circle"
    radius_m: float
    direction: Literal["ccw", "cw"]


class CirclePath(AroundBowl, Model):
    """A circle about the bowl's axis."""

    part: ClassVar[type[PathOfRun]] = CircleOfRun

    kind: Literal["circle"] = Field(
        description="circle: the path is a circle about the bowl's axis"
    )
    radius_m: Positive = Field(description="radius of the path of the workpiece's axis, m")
    start_deg: Number = Field(
        default=0.0,
        description="polar angle of the start of the path about the bowl's axis, from +x, degrees",
        exclude_if=lambda value: value == 0,
    )
    revolutions: Positive = Field(default=1.0, description="length of the path in revolutions")
    direction: Literal["ccw", "cw"] = Field(
        default="ccw",
        description="direction of motion seen from above: ccw (counter-clockwise) or cw",
    )

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

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """If it turns with the path."""
        return orientation == "follow_path"

    def turned(self, angle_deg: float) -> Self:
        """Begun at another angle."""
        return self.model_copy(update={"start_deg": self.start_deg + angle_deg})

    def with_length(self, length_m: float) -> Self:
        """As many revolutions as give the length."""
        return self.model_copy(update={"revolutions": length_m / self.revolution_m})

    def drag(self, speed_m_s: float, orientation: Orientation) -> Leg:
        """A rotation about the bowl's axis, or a circle without turning."""
        kind = "rotate" if orientation == "follow_path" else "circle"
        return self.steady_leg(kind, speed_m_s, self.sign * speed_m_s / self.radius_m)

    def of_run(self, speed_m_s: float, orientation: Orientation, stages: Stages) -> CircleOfRun:
        """The circle as it is driven."""
        return CircleOfRun(
            axis_speed_m_s=speed_m_s,
            start_direction_rad=self.direction_rad,
            orientation=orientation,
            radius_m=self.radius_m,
            direction=self.direction,
        )

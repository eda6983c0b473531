"""A straight line."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field

from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.paths.kind import (
    Leg,
    Orientation,
    PathOfRun,
    Point,
    Stages,
    WorkpiecePath,
    turned,
)


class LineOfRun(PathOfRun):
    """A straight line."""

    kind: Literal["line"] = "line"
    start_m: tuple[float, float]
    direction_rad: float


class LinePath(WorkpiecePath, Model):
    """A straight line."""

    part: ClassVar[type[PathOfRun]] = LineOfRun
    length_field: ClassVar[str] = "length_m"

    kind: Literal["line"] = Field(description="line: the path is a straight line")
    start_m: tuple[Number, Number] = Field(
        description="x and y of the workpiece's axis at the start of the drag, m"
    )
    direction_deg: Number = Field(
        default=0.0, description="angle of the direction of motion from +x, degrees"
    )
    length_m: Positive = Field(description="length of the drag, m")

    @property
    def path_length_m(self) -> float:
        """The length."""
        return self.length_m

    @property
    def start_point(self) -> Point:
        """The start."""
        return self.start_m

    @property
    def direction_rad(self) -> float:
        """The direction."""
        return math.radians(self.direction_deg)

    def turned(self, angle_deg: float) -> Self:
        """From another place in another direction."""
        return self.model_copy(
            update={
                "start_m": turned(self.start_m, angle_deg),
                "direction_deg": self.direction_deg + angle_deg,
            }
        )

    def with_length(self, length_m: float) -> Self:
        """As long as that."""
        return self.model_copy(update={"length_m": length_m})

    def drag(self, speed_m_s: float, orientation: Orientation) -> Leg:
        """Straight on."""
        return self.steady_leg("linear", speed_m_s)

    def of_run(self, speed_m_s: float, orientation: Orientation, stages: Stages) -> LineOfRun:
        """The line as it is driven."""
        return LineOfRun(
            axis_speed_m_s=speed_m_s,
            start_direction_rad=self.direction_rad,
            orientation=orientation,
            start_m=self.start_m,
            direction_rad=self.direction_rad,
        )

"""A recorded path: straight stretches from waypoint to waypoint, each at its own speed."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from dragdeck.study.base import Line, Model, Number
from dragdeck.study.paths.kind import (
    Leg,
    Orientation,
    PathOfRun,
    Point,
    Stages,
    WorkpiecePath,
    turned,
)

MOST_POINTS = 100


class Waypoint(NamedTuple):
    """Time, place of the workpiece's axis, height of the tip above the immersion depth, turn."""

    time_s: Number
    x_m: Number
    y_m: Number
    z_m: Number = 0.0
    turn_deg: Number = 0.0


class WaypointsOfRun(PathOfRun):
    """Waypoints as simulated: consecutive stages from the start of the drag."""

    kind: Literal["waypoints"] = "waypoints"
    stages: Stages


class WaypointsPath(WorkpiecePath, Model):
    """A recorded path; lengths are those at its mean speed, pauses included."""

    part: ClassVar[type[PathOfRun]] = WaypointsOfRun
    length_field: ClassVar[str] = "fraction"

    kind: Literal["waypoints"] = Field(
        description="waypoints: a recorded path, straight between waypoints, at its own speed. "
        "Lengths along the path refer to its mean speed. The waypoints also define the rotation of "
        "the workpiece; `orientation` has no effect"
    )
    file: Line | None = Field(
        default=None,
        description="CSV file with the columns time_s, x_m, y_m and optionally z_m and turn_deg; "
        "relative to the study; either this or `points`",
    )
    points: Annotated[list[Waypoint], Field(min_length=2, max_length=MOST_POINTS)] = Field(
        default_factory=list,
        description="2 to 100 waypoints [time, x, y, z, turn]: time, s; position of the "
        "workpiece's "
        "axis, m; height of the tip above the immersion depth, m (default 0); angle about the "
        "vertical, degrees, positive: counter-clockwise (default 0; only differences matter). "
        "Equal positions are a pause",
    )
    fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=1.0, description="fraction of the recorded time that is simulated, from its start"
    )

    @field_validator("points")
    @classmethod
    def _in_time(cls, points: list[Waypoint]) -> list[Waypoint]:
        problem = PydanticCustomError("order", "the time does not increase")
        late = [n for n, (one, other) in enumerate(pairwise(points), 1) if other[0] <= one[0]]
        if late:
            wrong = [InitErrorDetails(type=problem, loc=(n, 0), input=points[n][0]) for n in late]
            raise ValidationError.from_exception_data("points", wrong)
        return points

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if self.file is not None or not self.points:
            raise ValueError("give either file or points, and not both")
        if not any(x or y for _, x, y, _ in self._stretches()):
            raise ValueError("the workpiece does not move horizontally")
        return self

    def _stretches(self) -> Sequence[Sequence[float]]:
        """Differences between each waypoint and the next: duration, s, and x, y and z, m."""
        return [[b - a for a, b in zip(*both, strict=True)][:4] for both in pairwise(self.points)]

    @property
    def turning(self) -> Sequence[tuple[float, float]]:
        """From the start to each waypoint, s, and the speed of rotation until then, 1/min."""
        start = self.points[0].time_s
        found = [
            (b.time_s - start, (b.turn_deg - a.turn_deg) / 6 / (b.time_s - a.time_s))
            for a, b in pairwise(self.points)
        ]
        return found if any(rpm for _, rpm in found) else ()

    @property
    def path_length_m(self) -> float:
        """The fraction of the sum over the stretches, heights included."""
        return self.fraction * sum(math.hypot(*shift) for _, *shift in self._stretches())

    @property
    def start_point(self) -> Point:
        """The first waypoint."""
        return self.points[0][1:3]

    @property
    def direction_rad(self) -> float:
        """That of the first stretch that is not vertical or a pause."""
        return next(math.atan2(y, x) for _, x, y, _ in self._stretches() if x or y)

    @property
    def start_height_m(self) -> float:
        """That of the first waypoint."""
        return self.points[0].z_m

    @property
    def own_speed_m_s(self) -> float:
        """Mean speed along the path, pauses included."""
        duration = self.points[-1].time_s - self.points[0].time_s
        return self.path_length_m / (self.fraction * duration)

    @property
    def peak_speed_ratio(self) -> float:
        """The fastest stretch."""
        return max(self.implied.values()) / self.own_speed_m_s

    @property
    def implied(self) -> Mapping[str, float]:
        """The mean speed, and that of each stretch at the waypoint where it ends."""
        speeds = [math.hypot(*shift) / duration for duration, *shift in self._stretches()]
        ends = {f"motion.path.points.{n}.speed_m_s": speed for n, speed in enumerate(speeds, 1)}
        return {"motion.path.speed_m_s": self.own_speed_m_s, **ends}

    def turned(self, angle_deg: float) -> Self:
        """Every waypoint at another place."""
        places = [turned((point.x_m, point.y_m), angle_deg) for point in self.points]
        points = [
            point._replace(x_m=x, y_m=y) for point, (x, y) in zip(self.points, places, strict=True)
        ]
        return self.model_copy(update={"points": points})

    def faster(self, factor: float) -> Self:
        """The same places after shorter times."""
        points = [point._replace(time_s=point.time_s / factor) for point in self.points]
        return self.model_copy(update={"points": points})

    def with_length(self, length_m: float) -> Self:
        """The fraction that has this length at the mean speed."""
        return self.model_copy(update={"fraction": self.fraction * length_m / self.path_length_m})

    def drag(self, speed_m_s: float, orientation: Orientation) -> Leg:
        """One stage per stretch."""
        pace = speed_m_s / self.own_speed_m_s
        ends = [(point.time_s - self.points[0].time_s) / pace for point in self.points[1:]]
        rates = [(pace * x / s, pace * y / s, pace * z / s) for s, x, y, z in self._stretches()]
        stages = list(zip(ends, rates, strict=True))
        return Leg("drag", "stages", self.path_length_m / speed_m_s, rates[0], stages=stages)

    def of_run(self, speed_m_s: float, orientation: Orientation, stages: Stages) -> PathOfRun:
        """The stages, and a workpiece that keeps its orientation."""
        return WaypointsOfRun(
            axis_speed_m_s=speed_m_s,
            start_direction_rad=self.direction_rad,
            orientation="fixed",
            stages=stages,
        )

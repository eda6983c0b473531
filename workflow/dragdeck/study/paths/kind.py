"""What every kind of path knows of itself."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict

Orientation = Literal["follow_path", "fixed"]
Point = tuple[float, float]
Vector = tuple[float, float, float]


class StageOfRun(BaseModel):
    """A stage of constant velocity: its number of steps, and the velocity."""

    steps: int
    velocity_m_s: Vector


Stages = Sequence[StageOfRun]


class PathOfRun(BaseModel):
    """The simulated drag: speed of the workpiece's axis, and its initial direction."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    kind: str
    axis_speed_m_s: float
    start_direction_rad: float
    orientation: Orientation


def turned(place: Point, angle_deg: float) -> Point:
    """A place turned about the bowl's axis, to 1e-12 m."""
    angle, (x, y) = math.radians(angle_deg), place
    c, s = math.cos(angle), math.sin(angle)
    return round(c * x - s * y, 12) + 0.0, round(s * x + c * y, 12) + 0.0


@dataclass(frozen=True)
class Leg:
    """A stretch of motion at one speed, or in stages.

    Attributes
    ----------
    name : str
        ``plunge``, ``approach`` or ``drag``.
    kind : str
        ``linear`` (along `velocity_m_s`), ``rotate`` (about the bowl's axis, the
        workpiece turning with it), ``circle`` (about the bowl's axis, the workpiece
        keeping its orientation), ``stages`` (one velocity after another) or ``rest``.
    duration_s : float
    velocity_m_s : tuple of 3 floats
        At the beginning of the leg, relative to the bowl.
    angular_speed_rad_s : float
        About +z; zero for a linear leg.
    stages : sequence
        End of each stage from the beginning of the leg, s, and its velocity, m/s; the last
        velocity stays. Empty unless `kind` is ``stages``.
    """

    name: str
    kind: str
    duration_s: float
    velocity_m_s: Vector
    angular_speed_rad_s: float = 0.0
    stages: Sequence[tuple[float, Vector]] = ()


class WorkpiecePath(ABC):
    """Block of a study: where the workpiece's axis goes in the drag.

    Speeds and lengths are relative to the bowl.

    Attributes
    ----------
    part : type
        Its model in ``case.json``.
    length_field : str
        The field below ``motion.path`` that its length is proportional to.
    """

    part: ClassVar[type[PathOfRun]]
    length_field: ClassVar[str]

    @property
    @abstractmethod
    def path_length_m(self) -> float:
        """Length of the drag."""

    @property
    def revolution_m(self) -> float | None:
        """Length of a revolution; None if there is none."""
        return None

    @property
    @abstractmethod
    def start_point(self) -> Point:
        """Where the drag begins, m."""

    @property
    def plunge_point(self) -> Point:
        """Where the workpiece goes in unless the study says other, m."""
        return self.start_point

    @property
    @abstractmethod
    def direction_rad(self) -> float:
        """Direction of motion from +x when the drag begins."""

    @property
    def ahead_deg(self) -> float | None:
        """Angle of its start about the bowl's axis, in the sense of motion; None if no circle."""
        return None

    @property
    def own_speed_m_s(self) -> float | None:
        """Speed that the path itself gives; None if ``motion.speed_m_s`` does."""
        return None

    @property
    def peak_speed_ratio(self) -> float:
        """Highest speed of the drag divided by its mean."""
        return 1.0

    @property
    def start_height_m(self) -> float:
        """Height of the tip above the immersion depth at the start."""
        return 0.0

    @property
    def turning(self) -> Sequence[tuple[float, float]]:
        """Rotation that the path itself gives: end of each stage, s, and its speed, 1/min."""
        return ()

    @property
    def implied(self) -> Mapping[str, float]:
        """What follows from its fields and has to be plausible too, by dotted name."""
        return {}

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """Whether the workpiece shows the bowl's axis the same side all the time."""
        return False

    def bowl_rad_s(self, speed_m_s: float) -> float:
        """Angular speed of the bowl about +z at a speed of the workpiece relative to it."""
        return 0.0

    def faster(self, factor: float) -> Self:
        """The same path with the speed that it gives, if any, multiplied."""
        return self

    @abstractmethod
    def turned(self, angle_deg: float) -> Self:
        """The same path turned about the bowl's axis."""

    @abstractmethod
    def with_length(self, length_m: float) -> Self:
        """The same path with another length."""

    @abstractmethod
    def drag(self, speed_m_s: float, orientation: Orientation) -> Leg:
        """The leg of the drag."""

    @abstractmethod
    def of_run(self, speed_m_s: float, orientation: Orientation, stages: Stages) -> PathOfRun:
        """Its entry in ``case.json``; `stages` are those of its leg as it is driven."""

    def steady_leg(self, kind: str, speed_m_s: float, angular_speed_rad_s: float = 0.0) -> Leg:
        """A drag of one kind at one speed, begun in the first direction."""
        heading = self.direction_rad
        velocity = (speed_m_s * math.cos(heading), speed_m_s * math.sin(heading), 0.0)
        return Leg("drag", kind, self.path_length_m / speed_m_s, velocity, angular_speed_rad_s)


class AroundBowl(WorkpiecePath):
    """Block of a study: a path on a circle about the bowl's axis."""

    length_field: ClassVar[str] = "revolutions"

    if TYPE_CHECKING:
        start_deg: float
        radius_m: float
        revolutions: float

    @property
    def start_rad(self) -> float:
        """Angle of its start from +x."""
        return math.radians(self.start_deg)

    @property
    def path_length_m(self) -> float:
        """The circumference, as often as it is gone round."""
        return self.revolution_m * self.revolutions

    @property
    def revolution_m(self) -> float:
        """The circumference."""
        return 2 * math.pi * self.radius_m

    @property
    def start_point(self) -> Point:
        """At the radius and the angle."""
        return turned((self.radius_m, 0.0), self.start_deg)

    @property
    def ahead_deg(self) -> float:
        """The angle, or its negative for a clockwise motion."""
        return math.copysign(1.0, math.sin(self.direction_rad - self.start_rad)) * self.start_deg

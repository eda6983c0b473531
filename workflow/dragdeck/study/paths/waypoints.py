"""A recorded path: straight stretches from waypoint to waypoint, each at its own speed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, JsonValue, ValidationError, field_validator, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from dragdeck.arrays import Floats
from dragdeck.study.base import Json, Line, Number
from dragdeck.study.drive import Drive, EngineMotion, Orientation, rates_about_axes, rotating_by
from dragdeck.study.paths.path import Vector, WorkpiecePath, as_rows, turned
from dragdeck.study.rotations import by_vector, rotated, rotation_vector, wrap_angle
from dragdeck.study.stages import StepCounts, chain, in_steps, integral, stage_at

MOST_POINTS = 100

_STAGES_PER_FORMULA = 10
"""Formulas of one stage each take three times as long."""


class Waypoint(NamedTuple):
    """Time, place of the tip, its height above the immersion depth, and orientation."""

    time_s: Number
    x_m: Number
    y_m: Number
    z_m: Number = 0.0
    turn_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0


@dataclass(frozen=True)
class DrivenStage:
    """A stage of constant velocity.

    Attributes
    ----------
    steps : int
    velocity_m_s : tuple of 3 floats
    rotation_rad : tuple of 3 floats
        Rotation vector of the whole stage, in the frame of the front at the start.
    """

    steps: int
    velocity_m_s: Vector
    rotation_rad: Vector


class WaypointsPath(WorkpiecePath):
    """A recorded path; lengths are those at its mean speed, pauses included."""

    length_field: ClassVar[str] = "fraction"

    kind: Literal["waypoints"]
    """recorded path with its own speed and rotation; lengths along it refer to its mean speed;
    `orientation` has no effect"""
    file: Line | None = None
    """CSV file with the columns time_s, x_m, y_m and optionally z_m, turn_deg, pitch_deg and
    roll_deg; relative to the study; either this or `points`"""
    points: Annotated[list[Waypoint], Field(min_length=2, max_length=MOST_POINTS)] = Field(
        default_factory=list
    )
    """rows of the same columns, in s, m and degrees; the last four may be left out (0)"""
    fraction: Annotated[Number, Field(gt=0, le=1)] = 1.0
    """fraction of the recorded time that is simulated, from its start"""

    @field_validator("points")
    @classmethod
    def _in_time(cls, points: list[Waypoint]) -> list[Waypoint]:
        problem = PydanticCustomError("order", "the time does not increase")
        late = [n for n, (before, other) in enumerate(pairwise(points), 1) if other[0] <= before[0]]
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
        if any(self.points[0][5:]):
            raise ValueError(
                "the first waypoint has a pitch or a roll: a workpiece goes in upright, or "
                "as motion.tilt_deg says"
            )
        return self

    def plain(self) -> dict[str, JsonValue]:
        """Waypoints have their inclination only if there is any: no run is named anew."""
        count = 7 if self.inclined else 5
        shown: list[JsonValue] = [list[JsonValue](point[:count]) for point in self.points]
        return super().plain() | {"points": shown}

    @property
    def inclined(self) -> bool:
        """Whether a waypoint has a pitch or a roll."""
        return any(any(point[5:]) for point in self.points)

    @property
    def most_turned_deg(self) -> float:
        """Between two waypoints, of each of the three angles."""
        return float(np.abs(np.diff([point[4:] for point in self.points], axis=0)).max())

    def _stretches(self) -> Sequence[Sequence[float]]:
        """Differences between each waypoint and the next: duration, s, and x, y and z, m."""
        return [[b - a for a, b in zip(*both, strict=True)][:4] for both in pairwise(self.points)]

    @property
    def turning(self) -> Sequence[tuple[float, float]]:
        """From the start to each waypoint, s, and the speed of rotation until then, 1/min."""
        start = self.points[0].time_s
        stretches = [
            (b.time_s - start, (b.turn_deg - a.turn_deg) / 6 / (b.time_s - a.time_s))
            for a, b in pairwise(self.points)
        ]
        return stretches if any(rpm for _, rpm in stretches) else ()

    @property
    def turning_rad_s(self) -> float:
        """Of the fastest stretch."""
        angles = [_by_angles(point, self.points[0]) for point in self.points]
        turned = [rotation_vector(b @ a.T) for a, b in pairwise(angles)]
        return max(
            float(np.linalg.norm(turn)) / time
            for turn, (time, *_) in zip(turned, self._stretches(), strict=True)
        )

    @property
    def path_length_m(self) -> float:
        """The fraction of the sum over the stretches, heights included."""
        return self.fraction * sum(math.hypot(*shift) for _, *shift in self._stretches())

    @property
    def direction_rad(self) -> float:
        """That of the first stretch that is not vertical or a pause."""
        return next(math.atan2(y, x) for _, x, y, _ in self._stretches() if x or y)

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

    # --- as a run drives it --------------------------------------------------------------------

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """Straight from waypoint to waypoint."""
        at, points = self._passed()
        x, y, z = (np.interp(share, at, points[:, axis]) for axis in (1, 2, 3))
        return x, y, z

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """That of the stretch."""
        at, points = self._passed()
        stretch = np.clip(np.searchsorted(at, share, side="left") - 1, 0, len(at) - 2)
        x, y, z = (np.diff(points[:, 1:4], axis=0) / np.diff(at)[:, None])[stretch].T
        return x, y, z

    def _passed(self) -> tuple[Floats, Floats]:
        """Part of the simulated time at each waypoint, (N,), and the waypoints, (N, 5)."""
        points = np.array(self.points)
        time = points[:, 0] - points[0, 0]
        return time / time[-1] / self.fraction, points

    @property
    def corners(self) -> Floats:
        """The waypoints that it reaches, and its end."""
        at, points = self._passed()
        return np.concatenate([points[at < 1.0, 1:4], as_rows(self.place(np.ones(1)))])

    def stages(self, drive: Drive) -> Sequence[DrivenStage]:
        """The stretches in whole steps; each ends where it should."""
        pace = drive.full_speed_m_s / self.own_speed_m_s
        ends = [(point.time_s - self.points[0].time_s) / pace for point in self.points[1:]]
        stretches = zip(ends, self._stretches(), strict=True)
        rates = [(end, pace * np.array(shift) / time) for end, (time, *shift) in stretches]
        driven = []
        for count, begin, end in in_steps(ends, drive.steps, drive.timestep_s):
            moved = integral(rates, end) - integral(rates, begin)
            x, y, z = (moved / (count * drive.timestep_s)).tolist()
            driven.append(
                DrivenStage(count, (x, y, z), self._turned(begin * pace, end * pace, drive))
            )
        return driven

    def _turned(self, begin_s: float, end_s: float, drive: Drive) -> Vector:
        """Rotation vector between two recorded times."""
        if not self._inclined(drive):
            return 0.0, 0.0, 0.0
        x, y, z = rotation_vector(self._orientation(end_s) @ self._orientation(begin_s).T).tolist()
        return x, y, z

    def _inclined(self, drive: Drive) -> bool:
        """Whether its rotations are more than turns about the vertical of an upright workpiece."""
        return self.inclined or bool(self.turning and drive.tilt_deg)

    def _orientation(self, time_s: float) -> Floats:
        """Orientation relative to the first waypoint after a recorded time, (3, 3).

        From one waypoint to the next, the workpiece turns about one axis at one speed.
        """
        time = time_s + self.points[0].time_s
        before, other = next(
            (both for both in pairwise(self.points) if time <= both[1].time_s), self.points[-2:]
        )
        first, second = (_by_angles(point, self.points[0]) for point in (before, other))
        part = (time - before.time_s) / (other.time_s - before.time_s)
        return np.asarray(by_vector(part * rotation_vector(second @ first.T)) @ first)

    def turns(self, orientation: Orientation) -> bool:
        """Never with its direction: the waypoints say how."""
        return False

    def fastest_m_s(self, drive: Drive) -> float:
        """The fastest stage."""
        return max(math.hypot(*stage.velocity_m_s) for stage in self.stages(drive))

    def places(self, drive: Drive, since: StepCounts, begun: Floats) -> Floats:
        """As far as its stages take it."""
        timestep, stages = drive.full_duration_s / drive.steps, self.stages(drive)
        ends = (end * timestep for end in accumulate(stage.steps for stage in stages))
        velocities = (np.array(stage.velocity_m_s) for stage in stages)
        rates = list(zip(ends, velocities, strict=True))
        moved = [integral(rates, time) for time in drive.time_s(since)]
        return np.asarray(begun + np.reshape(moved, (-1, 3)))

    def in_frame(self, drive: Drive, since: StepCounts) -> Floats | None:
        """The rotations of its stages, one after another."""
        if not self._inclined(drive):
            return None
        stages = self.stages(drive)
        number, lengths = _at(stages, since), np.array([stage.steps for stage in stages])
        vectors = np.array([stage.rotation_rad for stage in stages])
        turns = map(by_vector, vectors)
        begun = accumulate(turns, lambda before, turn: turn @ before, initial=np.eye(3))
        starts = np.cumsum(lengths) - lengths
        done = np.clip((since - starts[number]) / lengths[number], 0.0, 1.0)
        return np.asarray(by_vector(done[:, None] * vectors[number]) @ np.array([*begun])[number])

    def directions(self, drive: Drive, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """That of the stage; in a vertical one or a pause, the last direction before."""
        headings, last, stages = [], self.direction_rad, self.stages(drive)
        for x, y, _ in (stage.velocity_m_s for stage in stages):
            last = float(np.arctan2(y, x)) if x or y else last
            headings.append(last)
        return wrap_angle(np.array(headings)[_at(stages, since)])

    def velocity(self, drive: Drive, since: StepCounts, point_m: Floats, ref_m: Floats) -> Floats:
        """That of the stage."""
        stages = self.stages(drive)
        number = _at(stages, since)
        moved = np.array([stage.velocity_m_s for stage in stages])[number]
        if not self._inclined(drive):
            return moved
        rates = [
            np.array(stage.rotation_rad) / (stage.steps * drive.timestep_s) for stage in stages
        ]
        rate = rotated(np.array(rates), self.direction_rad)[number]
        return np.asarray(moved + np.cross(rate, point_m - ref_m))

    def on_engine(self, drive: Drive) -> EngineMotion:
        """Velocities that depend on the step only, so that a resumed run goes on."""
        stages = self.stages(drive)
        velocity, variables = _chains("stage_v", drive, [(s.steps, s.velocity_m_s) for s in stages])
        movers: dict[str, str] = {"": f"linear/variable {' '.join(f'v_{v}' for v in velocity)}"}
        if self._inclined(drive):
            rates = [(s.steps, rates_about_axes(self._per_step(s), drive)) for s in stages]
            names, turning = _chains("stage_w", drive, rates)
            variables, movers = variables | turning, movers | rotating_by(names)
        comment = "velocity along the path, as nested conditions on the step"
        return EngineMotion(movers, variables, comment)

    def _per_step(self, stage: DrivenStage) -> Floats:
        """Rotation of a step in the frame of the bowl, (3, 3)."""
        vector = np.array(stage.rotation_rad) / stage.steps
        return by_vector(rotated(vector, self.direction_rad))

    def entry(self, drive: Drive) -> Json:
        """Its stages from the start of the drag; its direction never turns the workpiece."""
        stages: list[JsonValue] = [self._entry_of(stage, drive) for stage in self.stages(drive)]
        return {"orientation": "fixed", "stages": stages}

    def _entry_of(self, stage: DrivenStage, drive: Drive) -> dict[str, JsonValue]:
        rotation = list[JsonValue](stage.rotation_rad)
        return {
            "steps": stage.steps,
            "velocity_m_s": list[JsonValue](stage.velocity_m_s),
            **({"rotation_rad": rotation} if self._inclined(drive) else {}),
        }


def _at(stages: Sequence[DrivenStage], since: StepCounts) -> NDArray[np.int64]:
    return stage_at(since, [stage.steps for stage in stages])


def _chains(
    name: str, drive: Drive, stages: Sequence[tuple[int, Vector]]
) -> tuple[list[str], dict[str, str]]:
    """Names of the three components of a vector in stages, and the formulas of all variables."""
    names, variables = [], dict[str, str]()
    for axis, letter in enumerate("xyz"):
        values = [(steps, vector[axis]) for steps, vector in stages]
        formulas = chain(f"{name}{letter}", drive.start, values, _STAGES_PER_FORMULA)
        names.append([*formulas][-1])
        variables |= formulas
    return names, variables


def _by_angles(point: Waypoint, first: Waypoint) -> Floats:
    """Orientation at a waypoint relative to the first one: roll, then pitch, then turn, (3, 3)."""
    from scipy.spatial.transform import Rotation

    angles = [point.turn_deg - first.turn_deg, point.pitch_deg, point.roll_deg]
    return np.asarray(Rotation.from_euler("ZYX", angles, degrees=True).as_matrix())

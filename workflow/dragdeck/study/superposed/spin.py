"""Spin of the workpiece about its own axis, through its reference point."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, JsonValue, model_validator

from dragdeck.arrays import Floats
from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.drive import Drive, EngineMotion, rotating, rotating_by
from dragdeck.study.rotations import Orientations, about_vertical, by_vector
from dragdeck.study.stages import StepCounts, chain, in_steps, integral, stage_at
from dragdeck.study.superposed.motion import SuperposedMotion


class SpinStage(Model):
    """A stretch of constant spin."""

    until_s: Positive
    """end of the stage, s from the start of the drag, with `speed_factor` 1; the last stage lasts
    to the end of the drag"""
    rpm: Number
    """rotational speed, 1/min; positive: counter-clockwise"""


class Spin(SuperposedMotion):
    """A constant spin, or a schedule of them."""

    kind: ClassVar[str] = "spin"
    turns: ClassVar[bool] = True

    rpm: Number | None = None
    """rotational speed during the drag, relative to `orientation`, 1/min; positive:
    counter-clockwise seen from above; either this or `schedule`"""
    schedule: list[SpinStage] | None = Field(default=None, min_length=1, max_length=100)

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.rpm is None) == (self.schedule is None):
            raise ValueError("give either rpm or schedule, and not both")
        for number, (before, after) in enumerate(pairwise(self._stages()), 1):
            if after.until_s <= before.until_s:
                raise ValueError(
                    f"schedule.{number}.until_s is {after.until_s:g}, not above the "
                    f"{before.until_s:g} of the previous entry: sort the entries by time"
                )
        return self

    def _stages(self) -> Sequence[SpinStage]:
        if self.schedule is not None:
            return self.schedule
        return [SpinStage.model_construct(until_s=math.inf, rpm=self.rpm or 0.0)]

    def faster(self, factor: float) -> Self:
        """The spin at that factor, its stages as much shorter."""
        stages = [
            stage.model_copy(update={"until_s": stage.until_s / factor, "rpm": factor * stage.rpm})
            for stage in self._stages()
        ]
        spin = {"rpm": stages[0].rpm} if self.schedule is None else {"schedule": stages}
        return self.model_copy(update={**spin, "ramp_s": self.ramp_s / factor})

    def surface_speed_m_s(self, radius_m: float) -> float:
        """Circumferential speed."""
        return radius_m * max(abs(_rate(stage.rpm)) for stage in self._stages())

    # --- as a run drives it --------------------------------------------------------------------

    def stages(self, drive: Drive) -> Sequence[tuple[int, float]]:
        """Steps and rate about the axis, rad/s, of those that begin before the drag ends.

        Each is as far as it should turn the workpiece. The ramp is not counted here: while it
        lasts, the workpiece turns less.
        """
        rates = [(stage.until_s, _rate(stage.rpm)) for stage in self._stages()]
        ends = (end for end, _ in rates)
        stages = []
        for steps, begin, end in in_steps(ends, drive.steps, drive.timestep_s):
            turned = integral(rates, end) - integral(rates, begin)
            stages.append((steps, turned / (steps * drive.timestep_s)))
        return stages

    def turn(self, drive: Drive, since: StepCounts) -> Floats:
        """The angle about the axis after (N,) steps, rad."""
        stages, begin = self.stages(drive), self.begin(drive)
        ends = np.cumsum([steps for steps, _ in stages])
        begun = np.r_[0, ends[:-1]]
        done = np.maximum(np.asarray(since)[:, None], 0)
        within = begin.advance(np.clip(done, begun, ends)) - begin.advance(begun)
        return np.asarray(within @ np.array([rate for _, rate in stages]) * drive.timestep_s)

    def rotated(self, drive: Drive, since: StepCounts, before: Orientations) -> Orientations:
        """About the vertical, or the axis of a tilted workpiece."""
        angle = self.turn(drive, since)
        if not drive.tilt_deg:
            return Orientations(before.turn_rad + angle, before.in_frame)
        return Orientations(before.turn_rad, by_vector(angle[:, None] * drive.own_axis))

    def velocity(
        self, drive: Drive, since: StepCounts, arm_m: Floats, before: Orientations
    ) -> Floats:
        """The rate of the stage that a step belongs to, cross the arm."""
        stages = self.stages(drive)
        rates = np.array([rate for _, rate in stages])
        rate = rates[stage_at(since, [steps for steps, _ in stages])]
        rate = rate * self.begin(drive).pace(since)
        if not drive.tilt_deg:
            return about_vertical(rate, arm_m)
        axis = before.out_of(np.tile(drive.own_axis, (len(since), 1)))
        return np.cross(rate[:, None] * axis, arm_m)

    def on_engine(self, drive: Drive, heading: str | float) -> EngineMotion:
        """A rotation about the live reference point: a restart does not keep the moved centre."""
        begin = self.begin(drive)
        rates = chain("spin_rate", drive.start, self.stages(drive))
        if begin.steps:
            now, before = (begin.formula(drive.start + late) for late in (0, 1))
            rates["spin_started"] = f"v_{[*rates][-1]}*({now}-{before})"
        return _about_own_axis(drive, heading, rates)

    def entry(self, drive: Drive) -> dict[str, JsonValue]:
        """Its stages; ``tilt_deg`` is absent where it is about the vertical."""
        stages: list[JsonValue] = [
            {"steps": steps, "rate_rad_s": rate} for steps, rate in self.stages(drive)
        ]
        tilt = {"tilt_deg": drive.tilt_deg} if drive.tilt_deg else {}
        return super().entry(drive) | {"stages": stages} | tilt


def _about_own_axis(drive: Drive, heading: str | float, rates: dict[str, str]) -> EngineMotion:
    """A rotation with the last of some rates about the axis of the workpiece.

    The engine never carries an axis along. While the path does not turn the workpiece, the axis
    stays; otherwise three rotations about the axes of the bowl make one about the axis as it is
    after the step (docs/development/liggghts.md).
    """
    omega = [*rates][-1]
    if not drive.tilt_deg:
        return EngineMotion({"": rotating(omega)}, rates)
    sine, _, cosine = drive.own_axis.tolist()
    if isinstance(heading, float):
        x, y = sine * math.cos(heading), sine * math.sin(heading)
        axis = f"{x!r} {y!r} {cosine!r}"
        return EngineMotion({"": rotating(omega, axis)}, rates)
    parts = {
        "spin_x": f"{sine!r}*cos({heading})",
        "spin_y": f"{sine!r}*sin({heading})",
        "spin_angle": f"v_{omega}*dt",
        "spin_k": "1.0-cos(v_spin_angle)",
        "spin_s": "sin(v_spin_angle)",
        "spin_m13": f"v_spin_x*{cosine!r}*v_spin_k+v_spin_y*v_spin_s",
        "spin_m23": f"v_spin_y*{cosine!r}*v_spin_k-v_spin_x*v_spin_s",
        "spin_m33": f"1.0-v_spin_k+{cosine * cosine!r}*v_spin_k",
        "spin_m11": "1.0-v_spin_k+v_spin_x*v_spin_x*v_spin_k",
        "spin_m12": f"v_spin_x*v_spin_y*v_spin_k-{cosine!r}*v_spin_s",
        "spin_wx": "atan(-v_spin_m23/v_spin_m33)/dt",
        "spin_wy": "asin(v_spin_m13)/dt",
        "spin_wz": "atan(-v_spin_m12/v_spin_m11)/dt",
    }
    return EngineMotion(rotating_by([f"spin_w{axis}" for axis in "xyz"]), rates | parts)


def _rate(rpm: float) -> float:
    """Angular speed, rad/s."""
    return rpm * 2 * math.pi / 60

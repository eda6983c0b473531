"""Spin of the workpiece about its own vertical axis, through its reference point."""

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import ClassVar, Literal, Self

from markupsafe import Markup
from pydantic import Field, model_validator

from dragdeck.study.base import Model, NonNegative, Number, Positive
from dragdeck.study.stages import chain, in_steps, integral
from dragdeck.study.superposed.kind import (
    LIVE_REFERENCE,
    RAMP,
    DragSteps,
    EngineMotion,
    SuperposedMotion,
    SuperposedOfRun,
)


class SpinStageOfRun(Model):
    """A stage of constant spin: its number of steps, and the rate about +z."""

    steps: int
    rate_rad_s: float


class SpinOfRun(SuperposedOfRun):
    """A spin as simulated: consecutive stages from the start of the drag.

    Attributes
    ----------
    stages : sequence of SpinStageOfRun
    ramp_steps : int
        Steps in which it starts from rest; absent if it starts at full speed.
    """

    kind: Literal["spin"] = "spin"
    stages: Sequence[SpinStageOfRun]

    def turn_rad(self, steps: float, timestep_s: float) -> float:
        """The sum over its stages."""
        ends = accumulate(stage.steps for stage in self.stages)
        rates = [
            (self.advance(end), timestep_s * stage.rate_rad_s)
            for end, stage in zip(ends, self.stages, strict=True)
        ]
        return integral(rates, self.advance(steps))

    def on_engine(self, start_step: int) -> EngineMotion:
        """A rotation about the live reference point: a restart does not keep the moved centre."""
        stages = [(stage.steps, stage.rate_rad_s) for stage in self.stages]
        rates = chain("spin_rate", start_step, stages)
        if self.ramp_steps:
            now, before = (self.advance_formula(start_step + late) for late in (0, 1))
            rates["spin_started"] = f"v_{[*rates][-1]}*({now}-{before})"
        mover = Markup("rotate/variable origin {} axis 0. 0. 1. omega v_{}")
        return EngineMotion(rates, mover.format(LIVE_REFERENCE, [*rates][-1]))


class SpinStage(Model):
    """A stretch of constant spin."""

    until_s: Positive = Field(
        description="end of the stage, in seconds from the start of the drag at the study's own "
        "speed; the last stage lasts to the end of the drag"
    )
    rpm: Number = Field(description="rotational speed, 1/min; positive: counter-clockwise")


class Spin(Model, SuperposedMotion):
    """A constant spin, or a schedule of them."""

    part: ClassVar[type[SuperposedOfRun]] = SpinOfRun

    ramp_s: NonNegative = RAMP
    rpm: Number | None = Field(
        default=None,
        description="rotational speed during the drag, relative to `orientation`, 1/min; positive: "
        "counter-clockwise seen from above; either this or `schedule`",
    )
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
        ramp = self.ramp_s / factor
        if self.schedule is None:
            rpm = factor * self._stages()[0].rpm
            return self.model_copy(update={"rpm": rpm, "ramp_s": ramp})
        stages = [
            SpinStage(until_s=stage.until_s / factor, rpm=factor * stage.rpm)
            for stage in self.schedule
        ]
        return self.model_copy(update={"schedule": stages, "ramp_s": ramp})

    def surface_speed_m_s(self, radius_m: float) -> float:
        """Circumferential speed."""
        return radius_m * max(abs(_rate(stage.rpm)) for stage in self._stages())

    def of_run(self, drag: DragSteps) -> SpinOfRun:
        """The stages that begin before the drag ends, each as far as it should turn the workpiece.

        The ramp is not counted here: while it lasts, the workpiece turns less.
        """
        rates = [(stage.until_s, _rate(stage.rpm)) for stage in self._stages()]
        ends = (end for end, _ in rates)
        stages = []
        for steps, begin, end in in_steps(ends, drag.end - drag.start, drag.timestep_s):
            turned = integral(rates, end) - integral(rates, begin)
            rate = turned / (steps * drag.timestep_s)
            stages.append(SpinStageOfRun(steps=steps, rate_rad_s=rate))
        return SpinOfRun(stages=stages, ramp_steps=self.ramp_steps(drag))


def _rate(rpm: float) -> float:
    """Angular speed, rad/s."""
    return rpm * 2 * math.pi / 60

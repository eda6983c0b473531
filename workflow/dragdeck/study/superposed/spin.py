"""Spin of the workpiece about its own vertical axis, through its reference point."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import ClassVar, Literal, Self

from markupsafe import Markup
from pydantic import Field, model_validator

from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.stages import chain, integral
from dragdeck.study.superposed.kind import (
    LIVE_REFERENCE,
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
    """A spin as simulated: consecutive stages from the start of the drag."""

    kind: Literal["spin"] = "spin"
    stages: Sequence[SpinStageOfRun]


class SpinStage(Model):
    """A stretch of constant spin."""

    until_s: Positive = Field(
        description="end of the stage, in seconds from the start of the drag at the study's own "
        "speed; the last stage lasts to the end of the drag"
    )
    rpm: Number = Field(description="rotational speed, 1/min; positive: counter-clockwise")


class Spin(SuperposedMotion, Model):
    """A constant spin, or a schedule of them."""

    part: ClassVar[type[SuperposedOfRun]] = SpinOfRun

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
        if self.schedule is None:
            return self.model_copy(update={"rpm": factor * self._stages()[0].rpm})
        stages = [
            SpinStage(until_s=stage.until_s / factor, rpm=factor * stage.rpm)
            for stage in self.schedule
        ]
        return self.model_copy(update={"schedule": stages})

    def surface_speed_m_s(self, radius_m: float) -> float:
        """Circumferential speed."""
        return radius_m * max(abs(_rate(stage.rpm)) for stage in self._stages())

    def turn_rad(self, time_s: float) -> float:
        """The sum over its stages."""
        return integral([(stage.until_s, _rate(stage.rpm)) for stage in self._stages()], time_s)

    def of_run(self, drag: DragSteps) -> SpinOfRun:
        """The stages that begin before the drag ends."""
        return SpinOfRun(stages=list(self._in_steps(drag)))

    def _in_steps(self, drag: DragSteps) -> Iterator[SpinStageOfRun]:
        *others, last = self._stages()
        begun, whole = 0, drag.end - drag.start
        ends = [round(min(whole, stage.until_s / drag.timestep_s)) for stage in others]
        for stage, end in zip([*others, last], [*ends, whole], strict=True):
            if end > begun:
                yield SpinStageOfRun(steps=end - begun, rate_rad_s=_rate(stage.rpm))
                begun = end

    def on_engine(self, drag: DragSteps) -> EngineMotion:
        """A rotation about the live reference point: a restart does not keep the moved centre."""
        stages = ((stage.steps, stage.rate_rad_s) for stage in self._in_steps(drag))
        rates = chain("spin_rate", drag.start, stages)
        mover = Markup("rotate/variable origin {} axis 0. 0. 1. omega v_{}")
        return EngineMotion(rates, mover.format(LIVE_REFERENCE, [*rates][-1]))


def _rate(rpm: float) -> float:
    """Angular speed, rad/s."""
    return rpm * 2 * math.pi / 60

"""Spin of the workpiece about its own vertical axis, through its reference point."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BaseModel, Field

from dragchain.arrays import about_vertical
from dragchain.run.stages import stage_at
from dragchain.run.superposed.kind import Floats, Ints, SuperposedMotion


class SpinStage(BaseModel):
    """A stretch of constant spin: `steps` of them, and the rate about +z."""

    steps: Annotated[int, Field(gt=0)]
    rate_rad_s: float


class Spin(SuperposedMotion):
    """A spin, one stage after another from the start of the drag."""

    turns: ClassVar[bool] = True
    kind: Literal["spin"]
    stages: Annotated[tuple[SpinStage, ...], Field(min_length=1)]

    def turn(self, steps: Ints, timestep_s: float) -> Floats:
        """The angle since the drag began."""
        rates = np.array([stage.rate_rad_s for stage in self.stages])
        ends = np.cumsum(self._lengths())
        begun = np.r_[0, ends[:-1]]
        done = np.maximum(steps[:, None], 0)
        within = self.advance(np.clip(done, begun, ends)) - self.advance(begun)
        return np.asarray(within @ rates * timestep_s)

    def velocity(self, steps: Ints, timestep_s: float, arm_m: Floats) -> Floats:
        """The rate of the stage that a step belongs to, cross the arm."""
        rates = np.array([stage.rate_rad_s for stage in self.stages])
        rate = rates[stage_at(steps, self._lengths())] * self.pace(steps)
        return about_vertical(rate, arm_m)

    def _lengths(self) -> list[int]:
        return [stage.steps for stage in self.stages]

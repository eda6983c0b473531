"""A recorded path, straight between waypoints."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field

from dragchain.arrays import Floats, wrap_angle
from dragchain.run.paths.kind import Ints, WorkpiecePath
from dragchain.run.stages import stage_at


class WaypointStage(BaseModel):
    """A stretch of constant velocity: `steps` of them, and the velocity."""

    steps: Annotated[int, Field(gt=0)]
    velocity_m_s: tuple[float, float, float]


class Waypoints(WorkpiecePath):
    """A path of a workpiece that does not turn, one stage after another.

    ``axis_speed_m_s`` is the mean speed along it.
    """

    kind: Literal["waypoints"]
    stages: Annotated[tuple[WaypointStage, ...], Field(min_length=1)]

    @property
    def keeps_direction(self) -> bool:
        """No: it bends."""
        return False

    def directions(self, steps: Ints, timestep_s: float, ref_xy_m: Floats) -> Floats:
        """That of the stage; in a vertical one or a pause, the last direction before."""
        found, last = [], self.start_direction_rad
        for x, y, _ in self._velocities():
            last = float(np.arctan2(y, x)) if x or y else last
            found.append(last)
        return wrap_angle(np.array(found)[self._stage_at(steps)])

    def velocity(
        self, steps: Ints, timestep_s: float, point_m: Floats, direction_rad: Floats
    ) -> Floats:
        """That of the stage."""
        return self._velocities()[self._stage_at(steps)]

    def _velocities(self) -> Floats:
        return np.array([stage.velocity_m_s for stage in self.stages])

    def _stage_at(self, steps: Ints) -> Ints:
        return stage_at(steps, [stage.steps for stage in self.stages])

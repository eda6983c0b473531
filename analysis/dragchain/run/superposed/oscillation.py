"""A vertical oscillation of the workpiece about its immersion depth."""

from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from dragchain.run.superposed.kind import Floats, Ints, SuperposedMotion


class Oscillation(SuperposedMotion):
    """``z = amplitude sin(rate t)``, t the time at full speed since the start of the drag."""

    kind: Literal["oscillation"]
    amplitude_m: PositiveFloat
    rate_rad_s: PositiveFloat

    def velocity(self, steps: Ints, timestep_s: float, arm_m: Floats) -> Floats:
        """Of the whole workpiece, up and down."""
        velocity = np.zeros_like(arm_m)
        angle = self.rate_rad_s * timestep_s * self.advance(steps)
        velocity[:, 2] = self.amplitude_m * self.rate_rad_s * np.cos(angle) * self.pace(steps)
        return velocity

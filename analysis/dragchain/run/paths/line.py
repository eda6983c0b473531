"""A straight line."""

from typing import Literal

import numpy as np

from dragchain.arrays import Floats, wrap_angle
from dragchain.run.paths.kind import Ints, WorkpiecePath


class Line(WorkpiecePath):
    """A drag along a straight line that leaves ``start_m`` along ``direction_rad``."""

    kind: Literal["line"]
    start_m: tuple[float, float]
    direction_rad: float

    def directions(self, steps: Ints, timestep_s: float, ref_xy_m: Floats) -> Floats:
        """The line's direction everywhere."""
        return np.full(len(ref_xy_m), wrap_angle(self.start_direction_rad))

    def velocity(
        self, steps: Ints, timestep_s: float, point_m: Floats, direction_rad: Floats
    ) -> Floats:
        """The same everywhere."""
        return self.straight_on(direction_rad)

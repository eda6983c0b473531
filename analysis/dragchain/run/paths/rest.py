"""A workpiece at rest in a rotating bowl."""

from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from dragchain.arrays import Floats, about_vertical
from dragchain.run.paths.kind import Ints, WorkpiecePath


class Rest(WorkpiecePath):
    """A workpiece that stands at a radius while the bowl rotates at ``bowl_rad_s`` about +z."""

    kind: Literal["rest"]
    radius_m: PositiveFloat
    bowl_rad_s: float

    def velocity(
        self, steps: Ints, timestep_s: float, point_m: Floats, direction_rad: Floats
    ) -> Floats:
        """None."""
        return np.zeros_like(point_m)

    def bowl_velocity(self, point_m: Floats) -> Floats:
        """The rotation about the bowl's axis."""
        return about_vertical(self.bowl_rad_s, point_m)

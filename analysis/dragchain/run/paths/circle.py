"""A circle about the bowl's axis."""

from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from dragchain.arrays import Floats, about_vertical, wrap_angle
from dragchain.run.paths.kind import Ints, WorkpiecePath


class Circle(WorkpiecePath):
    """A drag on a circle about the bowl's axis, ``direction`` seen from above."""

    kind: Literal["circle"]
    radius_m: PositiveFloat
    direction: Literal["ccw", "cw"]

    @property
    def sign(self) -> int:
        """1 for a counter-clockwise path, -1 for a clockwise one."""
        return 1 if self.direction == "ccw" else -1

    @property
    def turns_with_path(self) -> bool:
        """Unless the orientation is fixed."""
        return self.orientation == "follow_path"

    @property
    def keeps_direction(self) -> bool:
        """If it turns with its path."""
        return self.turns_with_path

    def directions(self, steps: Ints, timestep_s: float, ref_xy_m: Floats) -> Floats:
        """``sign * z x r`` with r the unit vector from the bowl's axis to the reference point."""
        radial = np.arctan2(ref_xy_m[:, 1], ref_xy_m[:, 0])
        return wrap_angle(radial + self.sign * np.pi / 2.0)

    def velocity(
        self, steps: Ints, timestep_s: float, point_m: Floats, direction_rad: Floats
    ) -> Floats:
        """``w x r`` with ``w = sign speed / radius`` if the workpiece turns with its path."""
        if not self.turns_with_path:
            return self.straight_on(direction_rad)
        return about_vertical(self.sign * self.axis_speed_m_s / self.radius_m, point_m)

    def turn(self, direction_rad: Floats) -> Floats:
        """The direction of motion, or the first one, which a workpiece that does not turn keeps."""
        return direction_rad if self.turns_with_path else super().turn(direction_rad)

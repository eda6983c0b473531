"""What every kind of path says of a workpiece."""

from abc import ABC, abstractmethod
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveFloat

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class WorkpiecePath(BaseModel, ABC):
    """How the workpiece is driven in the drag.

    Steps are counted from the start of the drag.

    Attributes
    ----------
    axis_speed_m_s : float
        Speed of the workpiece's axis relative to the bowl, the mean along the path.
    start_direction_rad : float
        Direction of that motion when the drag begins, from x towards y.
    orientation : str
        With ``follow_path`` the workpiece turns with its path.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    axis_speed_m_s: PositiveFloat
    start_direction_rad: float
    orientation: Literal["follow_path", "fixed"] = "fixed"

    @property
    def turns_with_path(self) -> bool:
        """Whether the path turns the workpiece."""
        return False

    @property
    def keeps_direction(self) -> bool:
        """Whether the direction of motion is always the same in the workpiece's own frame."""
        return True

    def directions(self, steps: Ints, timestep_s: float, ref_xy_m: Floats) -> Floats:
        """Direction of motion, (N,) in rad, at (N,) steps and (N, 2) places of the axis, m."""
        return np.full(len(ref_xy_m), self.start_direction_rad)

    @abstractmethod
    def velocity(
        self, steps: Ints, timestep_s: float, point_m: Floats, direction_rad: Floats
    ) -> Floats:
        """Velocity of points that are fixed to the workpiece.

        Parameters
        ----------
        steps : (N,) ndarray of int
        timestep_s : float
        point_m : (N, 3) ndarray
            The points at these steps, m.
        direction_rad : (N,) ndarray
            Direction of motion at these steps, rad.

        Returns
        -------
        (N, 3) ndarray
            Velocities, m/s.
        """

    def turn(self, direction_rad: Floats) -> Floats:
        """Angle of the workpiece's own frame about the vertical at (N,) directions of motion."""
        return np.full_like(direction_rad, self.start_direction_rad)

    def bowl_velocity(self, point_m: Floats) -> Floats:
        """Velocity of (N, 3) points that are fixed to the bowl, (N, 3) in m/s."""
        return np.zeros_like(point_m)

    def straight_on(self, direction_rad: Floats) -> Floats:
        """Velocity, (N, 3), at the mean speed of a workpiece that does not turn."""
        ahead = np.cos(direction_rad), np.sin(direction_rad), np.zeros_like(direction_rad)
        return self.axis_speed_m_s * np.column_stack(ahead)

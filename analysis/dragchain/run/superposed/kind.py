"""What every kind of superposed motion says of a workpiece."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class SuperposedMotion(BaseModel):
    """A motion that is superposed on the path during the drag.

    Steps are counted from the start of the drag.

    Attributes
    ----------
    turns : bool
        Whether it turns the workpiece about the vertical.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    turns: ClassVar[bool] = False
    kind: str

    def turn(self, steps: Ints, timestep_s: float) -> Floats:
        """What it adds to the workpiece's angle about the vertical, (N,), rad."""
        return np.zeros(len(steps))

    def velocity(self, steps: Ints, timestep_s: float, arm_m: Floats) -> Floats:
        """What it adds to the velocity of points that are fixed to the workpiece.

        Parameters
        ----------
        steps : (N,) ndarray of int
        timestep_s : float
        arm_m : (N, 3) ndarray
            From the reference point to the points, m.

        Returns
        -------
        (N, 3) ndarray
            Velocities, m/s.
        """
        return np.zeros_like(arm_m)

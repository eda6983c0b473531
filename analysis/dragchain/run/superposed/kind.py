"""What every kind of superposed motion says of a workpiece."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, NonNegativeInt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class SuperposedMotion(BaseModel):
    """A motion that is superposed on the path during the drag.

    Steps are counted from the start of the drag.

    Attributes
    ----------
    turns : bool
        Whether it turns the workpiece about the vertical.
    ramp_steps : int
        Steps in which it starts from rest.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    turns: ClassVar[bool] = False
    kind: str
    ramp_steps: NonNegativeInt = 0

    def advance(self, steps: Ints) -> Floats:
        """Steps at full speed, (N,), that get the motion as far as so many from its start.

        Their number per step is `pace`.
        """
        begun, ramp = np.minimum(steps, self.ramp_steps), max(self.ramp_steps, 1)
        return begun**3 / ramp**2 * (1.0 - begun / (2.0 * ramp)) + (steps - begun)

    def pace(self, steps: Ints) -> Floats:
        """Speed over the full one, (N,): ``3 x^2 - 2 x^3`` at the fraction x of the ramp."""
        x = np.minimum(steps / max(self.ramp_steps, 1), 1.0) if self.ramp_steps else np.ones(1)
        return np.broadcast_to(x**2 * (3.0 - 2.0 * x), np.shape(steps))

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

"""A bowl that rotates about its axis."""

import math
from typing import Literal, Self

from pydantic import field_validator

from dragdeck.study.base import Number
from dragdeck.study.bowl_motions.bowl_motion import BowlMotion


class Rotation(BowlMotion):
    """A bowl that rotates about its axis."""

    kind: Literal["rotation"]
    """rotation about the axis of the bowl"""
    rpm: Number
    """rotational speed, 1/min; positive: counter-clockwise seen from above"""

    @field_validator("rpm")
    @classmethod
    def _turns(cls, value: float) -> float:
        if value == 0:
            raise ValueError("the bowl must rotate: leave motion.bowl out if it stands still")
        return value

    @property
    def rad_s(self) -> float:
        """The same in rad/s."""
        return self.rpm * math.tau / 60

    def faster(self, factor: float) -> Self:
        """At a higher speed."""
        return self.model_copy(update={"rpm": factor * self.rpm})

    def words(self) -> str:
        """Speed and sense."""
        sense = "counter-clockwise" if self.rpm > 0 else "clockwise"
        return f"{abs(self.rpm):.4g} 1/min, {sense} seen from above"

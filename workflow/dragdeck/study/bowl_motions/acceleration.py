"""A part of a bowl that rotates, seen from within: particles are accelerated to one side."""

import math
from typing import Literal, Self

from dragdeck.study.base import Number, Positive
from dragdeck.study.bowl_motions.bowl_motion import BowlMotion


class Acceleration(BowlMotion):
    """A constant horizontal acceleration of all particles relative to a bowl that stands still.

    It turns gravity, as the centrifugal acceleration does in a small part of a rotating bowl.
    """

    kind: Literal["acceleration"]
    """constant horizontal acceleration of the particles, as in a small part of a rotating bowl"""
    acceleration_m_s2: Positive
    """acceleration, m/s2"""
    direction_deg: Number = -90.0
    """its direction, from +x, degrees; outwards in a rotating bowl"""

    @property
    def sideways_m_s2(self) -> tuple[float, float]:
        """Along x and y."""
        angle, size = math.radians(self.direction_deg), self.acceleration_m_s2
        return size * math.cos(angle), size * math.sin(angle)

    def faster(self, factor: float) -> Self:
        """That of a bowl that rotates faster."""
        return self.model_copy(update={"acceleration_m_s2": factor**2 * self.acceleration_m_s2})

    def words(self) -> str:
        """Size and direction."""
        size, angle = self.acceleration_m_s2, self.direction_deg
        return f"particles are accelerated by {size:.4g} m/s2 at {angle:g} degrees from +x"

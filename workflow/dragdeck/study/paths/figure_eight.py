"""A figure eight: two circles that touch, gone round in turn."""

import math
from collections.abc import Callable
from typing import Any, ClassVar, Literal

import numpy as np

from dragdeck.study.base import Number, Positive
from dragdeck.study.paths.path import FromPlace


class FigureEightPath(FromPlace):
    """Two circles of one radius that touch: one counter-clockwise, the other clockwise."""

    length_field: ClassVar[str] = "loops"
    place_field: ClassVar[str] = "middle_m"

    kind: Literal["figure_eight"]
    """two touching circles in turn, one counter-clockwise, the other clockwise"""
    radius_m: Positive
    """radius of both circles, m"""
    middle_m: tuple[Number, Number] = (0.0, 0.0)
    """x and y where the circles touch and the drag starts, m"""
    direction_deg: Number = 0.0
    """direction of motion there, from +x, degrees; the first circle is to the left"""
    loops: Positive = 1.0
    """length of the path in figures eight"""

    def words(self, number: Callable[[float], str]) -> str:
        """With its radius."""
        return f"figure eight of two circles of radius {number(1e3 * self.radius_m)} mm"

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """Round one circle and the other."""
        angle, side = self._angle_and_side(share)
        ahead, left = self.radius_m * np.sin(angle), side * self.radius_m * (1.0 - np.cos(angle))
        x, y = self._in_bowl(ahead, left)
        return self.middle_m[0] + x, self.middle_m[1] + y, 0.0

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """Along the circle."""
        angle, side = self._angle_and_side(share)
        length = self.radius_m * self._whole_rad
        x, y = self._in_bowl(length * np.cos(angle), side * length * np.sin(angle))
        return x, y, 0.0

    @property
    def _whole_rad(self) -> float:
        return 4 * math.pi * self.loops

    def _angle_and_side(self, share: Any) -> tuple[Any, Any]:
        """The angle that it has gone round, and 1 on the circle to the left, -1 on the other."""
        angle = self._whole_rad * share
        return angle, 2.0 * (np.sin(0.5 * angle) >= 0.0) - 1.0

    def _in_bowl(self, ahead: Any, left: Any) -> tuple[Any, Any]:
        heading = math.radians(self.direction_deg)
        c, s = math.cos(heading), math.sin(heading)
        return c * ahead - s * left, s * ahead + c * left

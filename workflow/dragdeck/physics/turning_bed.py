"""The surface of a bed that turns with its bowl.

The surface of a liquid would be inclined by ``atan(w^2 r / g)``, that of a bed of particles is by
this angle minus its angle of friction, and level where the latter is larger.
"""

import math

import numpy as np

from dragdeck.arrays import Floats

_RADII = 400
"""At which the height of the surface is computed."""


def surface_tilt(
    rad_s: float, gravity_m_s2: float, friction_rad: float, radius_m: Floats
) -> Floats:
    """Inclination of the surface at (N,) distances from the axis, (N,), rad."""
    liquid = np.arctan(rad_s**2 * radius_m / gravity_m_s2)
    return np.asarray(np.maximum(liquid - friction_rad, 0.0))


def surface_rise(
    rad_s: float, gravity_m_s2: float, friction_rad: float, inner_m: float, outer_m: float
) -> tuple[Floats, Floats]:
    """Distances from the axis, from the inner to the outer wall, and height above the mean, m.

    The mean is over the area, because the volume of the bed stays.
    """
    radius = np.linspace(inner_m, outer_m, _RADII)
    slope = np.tan(surface_tilt(rad_s, gravity_m_s2, friction_rad, radius))
    steps = np.diff(radius) * (slope[1:] + slope[:-1]) / 2
    height = np.concatenate([[0.0], np.cumsum(steps)])
    mean = math.tau * np.trapezoid(height * radius, radius) / (math.pi * (outer_m**2 - inner_m**2))
    return radius, height - mean

"""Which side of the workpiece a contact is on, and in which part of its circumference.

A workpiece of facets touches most of its particles with the edges between them, and the edges lie
at the very angles that divide a circumference: straight ahead, abeam, at 45 degrees. The last
digit of a written number would decide the side of such a contact; instead half of it
counts on either.
"""

import numpy as np

from dragchain.arrays import Floats, Ints

_ON_LIMIT_RAD = 1e-6
"""A contact nearer to a limit than this is on it; points are written with nine digits."""


def beyond(angle_rad: Floats) -> Floats:
    """Share of each contact that is on the positive side of a limit: 1, 0, or 1/2 on it.

    Parameters
    ----------
    angle_rad : (c,) ndarray
        Angle from the limit.
    """
    return np.heaviside(np.where(np.abs(angle_rad) < _ON_LIMIT_RAD, 0.0, angle_rad), 0.5)


def within(azimuth_rad: Floats, limit_rad: float) -> Floats:
    """Share of each contact that lies within an angle of the direction of motion.

    Parameters
    ----------
    azimuth_rad : (c,) ndarray
        Azimuth from the direction of motion.
    limit_rad : float
        The largest angle to either side.
    """
    return beyond(limit_rad - np.abs(azimuth_rad))


def to_the_left(azimuth_rad: Floats) -> Floats:
    """Share of each contact that lies to the left of the motion."""
    return beyond(np.sin(azimuth_rad))


def circumference(bins: int) -> Floats:
    """Limits of equal parts of the circumference, (bins + 1,), from -pi to pi."""
    return np.linspace(-np.pi, np.pi, bins + 1)


def parts(azimuth_rad: Floats, bins: int) -> tuple[Ints, Ints]:
    """The part of the circumference that each half of a contact belongs to.

    Returns
    -------
    tuple of (c,) ndarray
        Two numbers of parts, 0 to `bins` - 1, the same unless the contact is on a limit.
    """
    width = 2.0 * np.pi / bins

    def part(angle: Floats) -> Ints:
        found: Ints = np.floor((angle + np.pi) / width).astype(np.int64) % bins
        return found

    return part(azimuth_rad - _ON_LIMIT_RAD), part(azimuth_rad + _ON_LIMIT_RAD)

"""Array types and operations that every package uses."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
"""Columns of a table by their names, (n,) each."""


def places(ids: Ints, known: Ints) -> Ints:
    """The place of each id in `known`, whose ids are unlike; -1 where it is not there.

    By hashing: in a time linear in both.
    """
    return np.asarray(pd.Index(known).get_indexer(pd.Index(ids)), dtype=np.int64)


def about_vertical(rate_rad_s: Floats | float, arm_m: Floats) -> Floats:
    """Velocity of a rotation about +z, ``w x r``, (N, 3) in m/s, at arms from its axis, (N, 3)."""
    x, y, _ = arm_m.T
    return np.column_stack([-rate_rad_s * y, rate_rad_s * x, np.zeros(len(arm_m))])


def wrap_angle(angle_rad: ArrayLike) -> Floats:
    """Wrap angles into (-pi, pi]."""
    turned = np.pi - np.asarray(angle_rad, dtype=np.float64)
    return np.asarray(np.pi - np.mod(turned, 2.0 * np.pi))

"""Array types of every package, and numbers of classes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def class_numbers(particle_id: Ints, first_ids: Sequence[int]) -> Ints:
    """Number of the class, from 0, of (N,) particles, whose ids rise from class to class."""
    return np.searchsorted(first_ids or [1], particle_id, side="right") - 1

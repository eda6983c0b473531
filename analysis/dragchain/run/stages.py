"""Motions in stages: to which stage a step belongs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def stage_at(steps: Ints, lengths: Sequence[int]) -> Ints:
    """Index of the stage of each step, (N,); a stage owns its last step.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Counted from the start of the drag. Those before it belong to the first stage, those
        after it to the last one.
    lengths : sequence of int
        Steps of each stage.
    """
    stage = np.searchsorted(np.cumsum(lengths), steps, side="left")
    return np.minimum(stage, len(lengths) - 1)

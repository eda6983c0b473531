"""How long the dominant chain stays the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints

SAME_CHAIN = 0.5
"""Chains of frames in a row are one if they share at least this fraction of their particles."""


@dataclass(frozen=True)
class Lives:
    """The life of the dominant chain of each of N frames.

    Attributes
    ----------
    life : (N,) ndarray of int
        Number of the life, from 0; -1 in a frame without a chain.
    life_s : (N,) ndarray
        How long the frame's chain is the dominant one in all: number of frames times their
        interval; NaN without a chain.
    age_s, left_s : (N,) ndarray
        Time since its first frame and until its last one.
    truncated : (N,) ndarray of bool
        Whether the life touches the first or the last frame, so that it is longer than seen.
    """

    life: Ints
    life_s: Floats
    age_s: Floats
    left_s: Floats
    truncated: NDArray[np.bool_]


def overlap(first: Sequence[int], second: Sequence[int]) -> float:
    """The Jaccard index of two sets of particles: shared over all; 0 if either is empty."""
    both = set(first) & set(second)
    return len(both) / len(set(first) | set(second)) if both else 0.0


def lives(particle_ids: Sequence[Sequence[int]], time_s: Floats) -> Lives:
    """Follow the dominant chain from frame to frame.

    A life goes on as long as the chains of frames in a row overlap by `SAME_CHAIN` at least.

    Parameters
    ----------
    particle_ids : sequence of sequence of int
        Particles of each frame's chain, none where there is no chain.
    time_s : (N,) ndarray
        Times of the frames, at equal intervals.
    """
    count = len(particle_ids)
    there = np.array([len(particles) > 0 for particles in particle_ids], dtype=bool)
    kept = np.array([overlap(a, b) >= SAME_CHAIN for a, b in pairwise(particle_ids)], dtype=bool)
    begins = there & ~np.concatenate([[False], kept])
    life = np.where(there, np.cumsum(begins) - 1, -1)
    interval = float(np.median(np.diff(time_s))) if count > 1 else 0.0
    place = pd.Series(np.arange(count, dtype=np.float64)).where(there)
    of_life = place.groupby(life)
    first, last = of_life.transform("min"), of_life.transform("max")
    return Lives(
        life=life,
        life_s=(interval * (last - first + 1.0)).to_numpy(),
        age_s=(interval * (place - first)).to_numpy(),
        left_s=(interval * (last - place)).to_numpy(),
        truncated=((first == 0.0) | (last == count - 1.0)).to_numpy(),
    )

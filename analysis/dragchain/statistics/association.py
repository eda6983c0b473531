"""Rank correlation of two series that are correlated in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.correlated import MIN_SAMPLES

# --- chains against the drag -----------------------------------------------------------------


@dataclass(frozen=True)
class Association:
    """Rank correlation of two series in time.

    Attributes
    ----------
    correlation
        Spearman's rank correlation, NaN if one series is constant or too short to tell.
    p_value
        Share of circular shifts of one series against the other, the true position included, with
        a rank correlation at least as far from zero; NaN with the correlation.
    samples
        Number of samples, which is also the number of shifts.
    """

    correlation: float
    p_value: float
    samples: int


def association(first: Floats, second: Floats) -> Association:
    """How far two evenly sampled series rise and fall together.

    Spearman's rank correlation against all circular shifts of one series, which keep the
    autocorrelation of both (Politis and Romano 1992 for the circular arrangement; the smallest
    possible p-value is one over the number of samples).

    Raises
    ------
    SeriesError
        If the series differ in length.
    """
    if len(first) != len(second):
        raise SeriesError(
            f"an association needs two series of one length, not {len(first)} and {len(second)}"
        )
    if len(first) < MIN_SAMPLES:
        return Association(float("nan"), float("nan"), len(first))
    ranks = [rankdata(series) - (len(series) + 1) / 2 for series in (first, second)]
    scale = float(np.sqrt((ranks[0] @ ranks[0]) * (ranks[1] @ ranks[1])))
    if scale == 0.0:
        return Association(float("nan"), float("nan"), len(first))
    spectra = [np.fft.rfft(series) for series in ranks]
    shifted = np.fft.irfft(spectra[0] * np.conj(spectra[1]), len(first)) / scale
    reached = np.abs(shifted) >= abs(shifted[0]) - 1e-12
    return Association(float(shifted[0]), float(reached.mean()), len(first))


def near_any(time_s: Floats, events_s: Floats, reach_s: float) -> NDArray[np.bool_]:
    """Which times lie within `reach_s` of an event."""
    if not len(events_s):
        return np.zeros(time_s.shape, dtype=bool)
    gaps = np.abs(time_s[:, None] - events_s[None, :]).min(axis=1)
    return np.asarray(gaps <= reach_s)

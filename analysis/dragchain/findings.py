"""The numbers that figures and report show, each computed in one place.

Everything that follows a counted stretch of the drag in time is autocorrelated, so intervals come
from a circular block bootstrap over frames (Politis and Romano 1992) and associations from
circular shifts; neither takes neighbouring frames for independent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from dragchain.bearing import circumference, parts, within
from dragchain.errors import SeriesError
from dragchain.frames import Floats, Ints
from dragchain.stats import MIN_SAMPLES, autocorrelation_time

CONFIDENCE = 0.95
RESAMPLES = 2000
SEED = 20150101
BEARING_BINS = 24
DEPTH_BINS = 10


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float

    def as_json(self) -> dict[str, float | None]:
        """Return the numbers by name, None where one is not finite."""
        return {name: finite(number) for name, number in vars(self).items()}


def finite(number: float) -> float | None:
    """Return the number, or None where JSON has no way to write it."""
    return float(number) if np.isfinite(number) else None


def estimate_columns(estimates: Sequence[Estimate]) -> dict[str, list[float | None]]:
    """Return estimates as columns ``value``, ``low`` and ``high``."""
    rows = [estimate.as_json() for estimate in estimates]
    return {name: [row[name] for row in rows] for name in ("value", "low", "high")}


# --- block bootstrap -------------------------------------------------------------------------


def block_length(sums: Floats) -> int:
    """Return a block length that outlasts the memory of every column, (n, k) frames in a row.

    Four times the largest integrated autocorrelation time (1/2 for independent frames), but no
    less than the cube root of n and no more than a quarter of it.
    """
    count = len(sums)
    longest = max(autocorrelation_time(column) for column in sums.T)
    return int(np.clip(np.ceil(4.0 * longest), np.ceil(count ** (1 / 3)), count // 4))


def bootstrap_means(sums: Floats, length: int, resamples: int = RESAMPLES) -> Floats:
    """Return resampled column means by circular blocks (Politis and Romano 1992).

    Parameters
    ----------
    sums : (n, k) array
        One row a frame, in the order of time.
    length
        Frames in a block, 1 to n.

    Returns
    -------
    (resamples, k) array
        The same for the same input: the generator's seed is fixed.
    """
    count = len(sums)
    total = np.vstack([np.zeros(sums.shape[1]), np.cumsum(np.vstack([sums, sums]), axis=0)])
    block_means = (total[length : length + count] - total[:count]) / length
    blocks = -(-count // length)
    starts = np.random.default_rng(SEED).integers(0, count, (resamples, blocks))
    return np.asarray(np.stack([block_means[row].mean(axis=0) for row in starts]))


def estimates(sums: Floats, statistic: Callable[[Floats], Floats]) -> list[Estimate]:
    """Return statistics of mean frame sums with their percentile intervals.

    Parameters
    ----------
    sums : (n, k) array
        Sums of each frame, in the order of time.
    statistic
        Function of (..., k) mean sums that returns (..., m) numbers.

    Raises
    ------
    SeriesError
        If there are too few frames to resample in blocks.
    """
    if len(sums) < MIN_SAMPLES:
        raise SeriesError(f"an interval needs at least {MIN_SAMPLES} frames, not {len(sums)}")
    with np.errstate(divide="ignore", invalid="ignore"):
        value = statistic(sums.mean(axis=0))
        resampled = statistic(bootstrap_means(sums, block_length(sums)))
    return [
        Estimate(number, *_interval(column))
        for number, column in zip(value.tolist(), resampled.T, strict=True)
    ]


def _interval(resampled: Floats) -> tuple[float, float]:
    """Return the percentile interval of the resamples that have a value, NaN if none has."""
    known = resampled[~np.isnan(resampled)]
    if not known.size:
        return float("nan"), float("nan")
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(known, [tail, 1.0 - tail], method="nearest")
    return float(low), float(high)


def frame_sums(frame: Ints, frames: int, weights: Floats) -> Floats:
    """Add rows of `weights`, (c, k), up to the frames they belong to, (frames, k)."""
    return np.stack([np.bincount(frame, column, frames) for column in weights.T], axis=1)


# --- the force around the tool ---------------------------------------------------------------


def ahead_behind(
    frame: Ints, frames: int, bearing_rad: Floats, normal_force_n: Floats
) -> dict[str, Estimate]:
    """Compare the normal force ahead of the tool with the one behind it.

    Parameters
    ----------
    frame : (c,) array
        Frame of each contact, 0 to `frames` - 1.
    frames
        Number of frames, those without a contact included.
    bearing_rad, normal_force_n : (c,) array
        Bearing from the direction of motion and normal force of each contact.

    Returns
    -------
    dict
        ``ahead_n`` and ``behind_n``: sum of the normal forces within 90 degrees of the direction
        of motion and beyond, mean over the frames; ``ratio`` of the two; ``share_ahead`` of all.
        A contact abeam counts half on either side.
    """
    ahead = within(bearing_rad, np.pi / 2)
    weights = np.stack([normal_force_n * ahead, normal_force_n * (1.0 - ahead)], axis=1)

    def statistic(sums: Floats) -> Floats:
        front, back = sums[..., 0], sums[..., 1]
        return np.stack([front, back, front / back, front / (front + back)], axis=-1)

    found = estimates(frame_sums(frame, frames, weights), statistic)
    return dict(zip(("ahead_n", "behind_n", "ratio", "share_ahead"), found, strict=True))


def bearing_profile(
    frame: Ints,
    frames: int,
    bearing_rad: Floats,
    normal_force_n: Floats,
    bins: int = BEARING_BINS,
) -> tuple[Floats, list[Estimate]]:
    """Return the edges of equal bins over the circumference and the mean force a frame in each, N.

    A contact on an edge counts half on either side.
    """
    sums = np.zeros((frames, bins))
    for row in parts(bearing_rad, bins):
        np.add.at(sums, (frame, row), 0.5 * normal_force_n)
    return circumference(bins), estimates(sums, lambda means: means)


# --- the force against depth -----------------------------------------------------------------


def depth_profile(
    frame: Ints, frames: int, depth_m: Floats, normal_force_n: Floats, bins: int = DEPTH_BINS
) -> tuple[Floats, list[Estimate], list[Estimate]]:
    """Return how the normal force changes with depth.

    Returns
    -------
    edges : (bins + 1,) array
        Edges of equal bins in m, from the shallowest contact to the deepest.
    contact_n : list of Estimate
        Mean normal force of a contact in each bin in N, NaN for a bin without contacts.
    line_n_m : list of Estimate
        Sum of the normal forces of a frame by depth, in N per metre of depth.
    """
    edges = np.linspace(depth_m.min(), depth_m.max(), bins + 1)
    row = np.clip(np.searchsorted(edges, depth_m, side="right") - 1, 0, bins - 1)
    force = np.zeros((frames, bins))
    count = np.zeros((frames, bins))
    np.add.at(force, (frame, row), normal_force_n)
    np.add.at(count, (frame, row), 1.0)
    thickness = edges[1] - edges[0]
    contact = estimates(np.hstack([force, count]), lambda s: s[..., :bins] / s[..., bins:])
    return edges, contact, estimates(force, lambda s: s / thickness)


def depth_slope(frame: Ints, frames: int, depth_m: Floats, normal_force_n: Floats) -> Estimate:
    """Return the least-squares slope of a contact's normal force against its depth, in N/m."""
    one = np.ones_like(depth_m)
    products = [one, depth_m, normal_force_n, depth_m**2, depth_m * normal_force_n]

    def statistic(sums: Floats) -> Floats:
        n, x, y, xx, xy = np.moveaxis(sums, -1, 0)
        return np.asarray((n * xy - x * y) / (n * xx - x**2))[..., None]

    return estimates(frame_sums(frame, frames, np.stack(products, axis=1)), statistic)[0]


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
    """Return how far two evenly sampled series rise and fall together.

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
    """Tell which times lie within `reach_s` of an event."""
    if not len(events_s):
        return np.zeros(time_s.shape, dtype=bool)
    gaps = np.abs(time_s[:, None] - events_s[None, :]).min(axis=1)
    return np.asarray(gaps <= reach_s)

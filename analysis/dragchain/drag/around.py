"""Normal force around the workpiece and over its depth."""

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.drag.azimuth import circumference, parts, within
from dragchain.statistics.frame_means import estimates, frame_sums
from dragchain.statistics.estimate import Estimate

AZIMUTH_BINS = 24
DEPTH_BINS = 10


# --- the force around the workpiece ---------------------------------------------------------------


def ahead_behind(
    frame: Ints, frames: int, azimuth_rad: Floats, normal_force_n: Floats
) -> dict[str, Estimate]:
    """Compare the normal force ahead of the workpiece with the one behind it.

    Parameters
    ----------
    frame : (c,) array
        Frame of each contact, 0 to `frames` - 1.
    frames
        Number of frames, those without a contact included.
    azimuth_rad, normal_force_n : (c,) array
        Azimuth from the direction of motion and normal force of each contact.

    Returns
    -------
    dict
        ``ahead_n`` and ``behind_n``: sum of the normal forces within 90 degrees of the direction
        of motion and beyond, mean over the frames; ``ratio`` of the two; ``fraction_ahead`` of all.
        A contact abeam counts half on either side.
    """
    ahead = within(azimuth_rad, np.pi / 2)
    weights = np.stack([normal_force_n * ahead, normal_force_n * (1.0 - ahead)], axis=1)

    def statistic(sums: Floats) -> Floats:
        front, back = sums[..., 0], sums[..., 1]
        return np.stack([front, back, front / back, front / (front + back)], axis=-1)

    found = estimates(frame_sums(frame, frames, weights), statistic)
    return dict(zip(("ahead_n", "behind_n", "ratio", "fraction_ahead"), found, strict=True))


def azimuth_profile(
    frame: Ints,
    frames: int,
    azimuth_rad: Floats,
    normal_force_n: Floats,
    bins: int = AZIMUTH_BINS,
) -> tuple[Floats, list[Estimate]]:
    """The edges of equal bins over the circumference and the mean force a frame in each, N.

    A contact on an edge counts half on either side.
    """
    sums = np.zeros((frames, bins))
    for row in parts(azimuth_rad, bins):
        np.add.at(sums, (frame, row), 0.5 * normal_force_n)
    return circumference(bins), estimates(sums, lambda means: means)


# --- the force against depth -----------------------------------------------------------------


def depth_profile(
    frame: Ints, frames: int, depth_m: Floats, normal_force_n: Floats, bins: int = DEPTH_BINS
) -> tuple[Floats, list[Estimate], list[Estimate]]:
    """How the normal force changes with depth.

    Returns
    -------
    edges : (bins + 1,) array
        Edges of equal bins in m, from the shallowest contact to the deepest.
    contact_n : list of Estimate
        Mean normal force of a contact in each bin in N, NaN for a bin without contacts.
    line_load_n_per_m : list of Estimate
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
    """The least-squares slope of a contact's normal force against its depth, in N/m."""
    one = np.ones_like(depth_m)
    products = [one, depth_m, normal_force_n, depth_m**2, depth_m * normal_force_n]

    def statistic(sums: Floats) -> Floats:
        n, x, y, xx, xy = np.moveaxis(sums, -1, 0)
        return np.asarray((n * xy - x * y) / (n * xx - x**2))[..., None]

    return estimates(frame_sums(frame, frames, np.stack(products, axis=1)), statistic)[0]

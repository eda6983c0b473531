"""Sliding along the sharp edges of a workpiece."""

import numpy as np

from dragchain.arrays import Floats
from dragchain.loading.contact_events import POINT
from dragchain.loading.samples import Sampled
from dragchain.run.workpiece import Surface
from dragchain.statistics.correlated import estimates
from dragchain.statistics.estimate import EstimateColumns
from dragdeck.documents import Part

FEATURE_DEG = 30.0
"""Facets that meet at a convex edge with a larger angle between their normals make a sharp edge."""

_BANDS = (0.0, 0.0625, 0.125, 0.25, 0.5, 1.0)
"""Edges of the bands along sharp edges, in mean radii of a particle."""

_SPREAD = 400_000
"""Points that are spread over a surface to tell the area of bands."""


class EdgeBands(Part):
    """Action of sliding in bands along the sharp edges of the immersed workpiece.

    Attributes
    ----------
    length_m : float
        Length of all of them.
    angle_rad : float
        Mean interior angle.
    distance_m : tuple of float
        Edges of the bands.
    area_m2 : tuple of float
        Of the surface in each band.
    action_w, within_w : EstimateColumns
        Per process time in each band, and in all up to its far side, W.
    """

    length_m: float
    angle_rad: float
    distance_m: tuple[float, ...]
    area_m2: tuple[float, ...]
    action_w: EstimateColumns
    within_w: EstimateColumns


def sharp_edges(surface: Surface, highest_m: float) -> tuple[Floats, Floats]:
    """The convex edges at which facets meet at more than `FEATURE_DEG`, below a height.

    Their ends, (E, 2, 3) in m, and interior angles, (E,) in rad.
    """
    points, at = np.unique(surface.corners.reshape(-1, 3), axis=0, return_inverse=True)
    facets = at.reshape(-1, 3)
    pairs = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, edge, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    order = order[count[edge.ravel()[order]] == 2].reshape(-1, 2)
    one, other = (order // 3).T
    normals, centres, ends = surface.normals, surface.centres, points[pairs[order[:, 0]]]
    turn = np.arccos(np.einsum("ij,ij->i", normals[one], normals[other]).clip(-1.0, 1.0))
    convex = np.einsum("ij,ij->i", centres[other] - centres[one], normals[one]) < 0.0
    sharp = convex & (ends[:, :, 2].max(axis=1) <= highest_m) & (turn > np.radians(FEATURE_DEG))
    return ends[sharp], np.pi - turn[sharp]


def edge_distance(ends_m: Floats, points_m: Floats, spacing_m: float) -> Floats:
    """Distance of (N, 3) points from the nearest of (E, 2, 3) edges, cut into such pieces, (N,)."""
    from scipy.spatial import KDTree

    lengths = np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1)
    number = np.maximum(2, np.ceil(lengths / spacing_m).astype(np.int64))
    parts = [np.linspace(a, b, count) for (a, b), count in zip(ends_m, number, strict=True)]
    return np.asarray(KDTree(np.concatenate(parts)).query(points_m)[0])


def strewn(surface: Surface, count: int = _SPREAD) -> Floats:
    """Points spread evenly over a surface, (count, 3): a Halton sequence, always the same."""
    from scipy.stats.qmc import Halton

    place, far, side = Halton(3, scramble=False).random(count).T
    until = surface.areas.cumsum()
    facet = np.searchsorted(until, place * until[-1])
    root = np.sqrt(far)
    weights = np.column_stack([1 - root, root * (1 - side), root * side])
    return np.asarray(np.einsum("ij,ijk->ik", weights, surface.corners[facet]))


def edge_bands(
    sampled: Sampled, surface: Surface, highest_m: float, radius_m: float, seconds: float
) -> EdgeBands | None:
    """The action of sliding along the sharp edges below a height, None if there are none.

    Parameters
    ----------
    sampled : Sampled
    surface : Surface
    highest_m : float
        Height of the settled surface above the tip.
    radius_m : float
        Mean radius of a particle, of which the bands are parts.
    seconds : float
        Process time between two samples.
    """
    ends, angles = sharp_edges(surface, highest_m)
    if not len(ends):
        return None
    limits = radius_m * np.array(_BANDS)
    points, places = strewn(surface), sampled.rows[POINT].to_numpy(np.float64)
    spread, away = (edge_distance(ends, each, limits[1] / 5) for each in (points, places))
    sums = np.zeros((sampled.frames, len(limits)))
    band = np.searchsorted(limits, away, side="right") - 1
    np.add.at(sums, (sampled.rows["frame"], band), sampled.rows["force_slide_n_m"])
    sums = sums[:, :-1]
    found = estimates(np.hstack([sums, sums.cumsum(axis=1)]), lambda means: means / seconds)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    area = np.histogram(spread, limits)[0] * surface.areas.sum() / len(points)
    return EdgeBands(
        length_m=float(lengths.sum()),
        angle_rad=float(np.average(angles, weights=lengths)),
        distance_m=tuple(limits.tolist()),
        area_m2=tuple(area.tolist()),
        action_w=EstimateColumns.of(found[: sums.shape[1]]),
        within_w=EstimateColumns.of(found[sums.shape[1] :]),
    )

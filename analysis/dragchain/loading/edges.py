"""Sliding along the sharp edges of a workpiece."""

from dataclasses import replace

import numpy as np

from dragchain.arrays import Floats
from dragchain.loading.contact_events import POINT
from dragchain.loading.samples import Sampled
from dragchain.run.workpiece import Surface
from dragchain.statistics.correlated import estimates
from dragchain.statistics.estimate import Estimate, EstimateColumns
from dragdeck.parts import Part

FEATURE_DEG = 30.0
"""Facets that meet at a convex edge with a larger angle between their normals make a sharp edge."""

_BANDS = (0.0, 0.0625, 0.125, 0.25, 0.5, 1.0, 2.0)
"""Edges of the bands along sharp edges, in mean radii of a particle.

Each is as wide as all before it, which it is compared with; the last one serves for that only.
"""

_SPREAD = 400_000
"""Points that are spread over a surface to tell the area of bands."""

_AREA_ERROR = 0.005
"""Largest relative error of the ratio of two areas by these points: 0.003 on cubes and rods."""


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
    action_w : EstimateColumns
        Per process time in each band, W.
    excess_w : EstimateColumns
        Per process time in all up to the far side of each band but the last, beyond what the same
        area has in the next band, W; NaN where the workpiece ends before that.
    """

    length_m: float
    angle_rad: float
    distance_m: tuple[float, ...]
    area_m2: tuple[float, ...]
    action_w: EstimateColumns
    excess_w: EstimateColumns


def sharp_edges(surface: Surface, highest_m: float) -> tuple[Floats, Floats]:
    """The convex edges at which facets meet at more than `FEATURE_DEG`, below a height.

    Their ends, (E, 2, 3) in m, and interior angles, (E,) in rad.
    """
    from trimesh import Trimesh

    points, facets = np.unique(surface.corners.reshape(-1, 3), axis=0, return_inverse=True)
    mesh = Trimesh(points, facets.reshape(-1, 3), process=False)
    ends, turn = points[mesh.face_adjacency_edges], mesh.face_adjacency_angles
    sharp = mesh.face_adjacency_convex & (turn > np.radians(FEATURE_DEG))
    sharp &= ends[:, :, 2].max(axis=1) <= highest_m
    return ends[sharp], np.pi - turn[sharp]


def edge_distance(
    ends_m: Floats, points_m: Floats, spacing_m: float, most_m: float = np.inf
) -> Floats:
    """Distance of (N, 3) points from the nearest of (E, 2, 3) edges, cut into such pieces, (N,).

    It is infinite where it exceeds `most_m`.
    """
    from scipy.spatial import KDTree

    lengths = np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1)
    number = np.maximum(2, np.ceil(lengths / spacing_m).astype(np.int64))
    parts = [np.linspace(a, b, count) for (a, b), count in zip(ends_m, number, strict=True)]
    tree = KDTree(np.concatenate(parts))
    return np.asarray(tree.query(points_m, distance_upper_bound=most_m)[0])


def strewn(surface: Surface) -> Floats:
    """Points spread evenly over a surface, (c, 3): a Halton sequence, always the same."""
    from scipy.stats.qmc import Halton

    place, far, side = Halton(3, scramble=False).random(_SPREAD).T
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
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    limits = radius_m * np.array(_BANDS)
    spread, away = (
        edge_distance(ends, points, limits[1] / 5, limits[-1])
        for points in (strewn(surface), sampled.rows[POINT].to_numpy(np.float64))
    )
    sums = np.zeros((sampled.frames, len(limits)))
    band = np.searchsorted(limits, away, side="right") - 1
    np.add.at(sums, (sampled.rows["frame"], band), sampled.rows["force_slide_n_m"])
    sums, area = sums[:, :-1], np.histogram(spread, limits)[0] * surface.areas.sum() / _SPREAD
    action, excess = band_actions(sums, area, seconds)
    return EdgeBands(
        length_m=float(lengths.sum()),
        angle_rad=float(np.average(angles, weights=lengths)),
        distance_m=tuple(limits.tolist()),
        area_m2=tuple(area.tolist()),
        action_w=EstimateColumns.of(action),
        excess_w=EstimateColumns.of(excess),
    )


def band_actions(
    sums: Floats, area_m2: Floats, seconds: float
) -> tuple[list[Estimate], list[Estimate]]:
    """Action in each of B bands, and excess up to each but the last, W; see `EdgeBands`.

    Parameters
    ----------
    sums : (frames, B) array
        Action in each frame, J.
    area_m2 : (B,) array
    seconds : float
        Process time between two frames.
    """
    ratio = area_m2.cumsum()[:-1] / np.where(area_m2[1:] > 0.0, area_m2[1:], np.nan)

    def statistic(means: Floats) -> Floats:
        """Action in the bands, excess up to each, and what it exceeds."""
        even = ratio * means[..., 1:]
        excess = means.cumsum(axis=-1)[..., :-1] - even
        return np.concatenate([means, excess, even], axis=-1) / seconds

    sums_and_means, count = estimates(sums, statistic), len(area_m2)
    return sums_and_means[:count], [
        replace(estimate, ci95_low=estimate.ci95_low - error, ci95_high=estimate.ci95_high + error)
        for estimate, of in zip(
            sums_and_means[count:], sums_and_means[2 * count - 1 :], strict=False
        )
        for error in [_AREA_ERROR * of.value]
    ]

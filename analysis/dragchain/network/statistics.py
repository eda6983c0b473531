"""Statistics and clusters of the contact network, frame by frame.

Only frames inside the counted stretch of the drag are used: those between the first and the last
sample that ``workpiece_force.parquet`` marks as ``counted``.

A cluster is two particles or more that contacts above a threshold of normal force join (Ostojic,
Somfai and Nienhuis 2006, Nature 439, 828-830). Contacts join by falling force and the clusters are
counted on the way (Newman and Ziff 2001, Phys. Rev. E 64, 016706): all thresholds cost one pass,
and the force at which a cluster spans for the first time is known exactly. Equal forces need no
rule: a threshold is below all of them or below none.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.network import graph_kernels as kernels
from dragchain.network.frame import BODY_NAMES, FLOOR, SIDE, WORKPIECE, NetworkFrame

FORCE_FACTORS = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)
"""Thresholds as multiples of the mean normal force of all the frame's contacts."""

_WORKPIECE, _FLOOR, _EAST, _NORTH, _WEST, _SOUTH = (1 << bit for bit in range(6))
_QUARTERS = np.array([_EAST, _NORTH, _WEST, _SOUTH])

SPANS = {
    "workpiece_to_bowl": ((_WORKPIECE, _FLOOR | _EAST | _NORTH | _WEST | _SOUTH),),
    "side_to_side": ((_EAST, _WEST), (_NORTH, _SOUTH)),
}
"""Ways to percolate: a cluster touches both of the places of one of the pairs."""


@dataclass(frozen=True)
class Clusters:
    """The clusters of a frame at each of T thresholds.

    Attributes
    ----------
    force_n : (T,) ndarray
        The thresholds: contacts of a larger normal force count.
    strong_contacts : (T,) ndarray of int64
        How many those are, contacts with workpiece and bowl included.
    clusters, clustered_particles, largest_cluster : (T,) ndarray of int64
        Number of clusters, of the particles in them, and of those in the largest.
    squares : (T,) ndarray of int64
        Sum of the squares of the numbers of particles of all clusters.
    particles : int
        Number of particles of the frame.
    percolation_n : dict of str to float
        For each of `SPANS` the largest normal force, N, such that the contacts of that force and
        larger ones make a cluster that spans; 0 if none does.
    """

    force_n: Floats
    strong_contacts: Ints
    clusters: Ints
    clustered_particles: Ints
    largest_cluster: Ints
    squares: Ints
    particles: int
    percolation_n: dict[str, float]

    def mean_cluster_size(self) -> Floats:
        """The mean size of the cluster that a particle belongs to, particles; NaN without any.

        The sum of s^2 over that of s (Stauffer and Aharony 1994, Introduction to Percolation
        Theory), over all clusters but the largest, which takes the place of the infinite one.
        """
        others = self.clustered_particles - self.largest_cluster
        squares = (self.squares - self.largest_cluster**2).astype(np.float64)
        return squares / np.where(others > 0, others, np.nan)

    def second_moment(self) -> Floats:
        """The sum of s^2 over all clusters but the largest, over the particles of the frame.

        Ostojic et al. (2006) find the scaling of force networks in the moments of cluster sizes.
        """
        squares = (self.squares - self.largest_cluster**2).astype(np.float64)
        return squares / self.particles if self.particles else np.full(squares.shape, np.nan)

    def spans(self, name: str) -> NDArray[np.bool_]:
        """Tell at which thresholds a cluster spans, (T,), in one of the ways of `SPANS`."""
        return np.less(self.force_n, self.percolation_n[name])


def find_clusters(frame: NetworkFrame, force_n: Floats) -> Clusters:
    """Find the clusters of a frame.

    A contact with workpiece or bowl joins no particles, but tells what a cluster touches.
    `workpiece_to_bowl` is a cluster, or a single particle, on both; `side_to_side` one that
    touches the bowl's side in two opposite quarters about its axis z, those around +x and -x or
    those around +y and -y.

    Parameters
    ----------
    frame : NetworkFrame
    force_n : (T,) ndarray
        Rising thresholds in N, not below 0.
    """
    thresholds = np.asarray(force_n, dtype=np.float64)
    pressed = np.flatnonzero(frame.normal_force > 0.0)
    order = pressed[np.argsort(-frame.normal_force[pressed])]
    force = frame.normal_force[order]
    stops = np.searchsorted(-force, -thresholds)
    pairs = [pair for ways in SPANS.values() for pair in ways]
    counts, joined = kernels.grow_clusters(
        frame.a.astype(np.int32)[order],
        np.where(frame.between_particles(), frame.b, -1).astype(np.int32)[order],
        _touched(frame)[order],
        np.array(pairs, dtype=np.uint8),
        stops[::-1],
        frame.particle_id.size,
    )
    reached = iter(
        np.where(joined >= 0, force[joined], 0.0) if force.size else np.zeros(joined.shape)
    )
    percolation = {name: float(max(next(reached) for _ in ways)) for name, ways in SPANS.items()}
    clusters, members, largest, squares = counts[::-1].T
    size = frame.particle_id.size
    return Clusters(thresholds, stops, clusters, members, largest, squares, size, percolation)


def _touched(frame: NetworkFrame) -> NDArray[np.uint8]:
    """A bit for what each contact's particle touches with it, (M,), 0 for another particle."""
    bits = np.zeros(frame.other.shape, dtype=np.uint8)
    bits[frame.other == WORKPIECE], bits[frame.other == FLOOR] = _WORKPIECE, _FLOOR
    side = np.flatnonzero(frame.other == SIDE)
    azimuth = np.arctan2(frame.point[side, 1], frame.point[side, 0])
    bits[side] = _QUARTERS[np.round(azimuth / (0.5 * np.pi)).astype(np.int64) % 4]
    return bits


def frame_clusters(frame: NetworkFrame) -> Clusters:
    """The clusters of a frame at `FORCE_FACTORS` times its mean normal force."""
    return find_clusters(frame, np.array(FORCE_FACTORS) * max(frame.mean_force_n(), 0.0))


def cluster_rows(frame: NetworkFrame, clusters: Clusters) -> dict[str, NDArray[Any]]:
    """The frame's rows of ``clusters.parquet``, one a threshold of `FORCE_FACTORS`."""
    count = len(FORCE_FACTORS)
    return {
        "step": np.full(count, frame.step),
        "time_s": np.full(count, frame.time_s),
        "force_factor": np.array(FORCE_FACTORS),
        "strong_contacts": clusters.strong_contacts,
        "clusters": clusters.clusters,
        "clustered_particles": clusters.clustered_particles,
        "largest_cluster": clusters.largest_cluster,
        "mean_cluster_size": clusters.mean_cluster_size(),
        "second_moment": clusters.second_moment(),
        **{name: clusters.spans(name) for name in SPANS},
    }


# --- statistics ----------------------------------------------------------------------------------


_LEAST_CONTACTS = 4
"""A particle with fewer contacts is a rattler. Four is the mean number with which frictional
spheres are isostatic; Thornton (2000) leaves out only particles with fewer than two."""


def contact_counts(frame: NetworkFrame) -> Ints:
    """The number of contacts of each particle, those with workpiece and bowl included, (N,)."""
    size = frame.particle_id.size
    return np.bincount(frame.a, minlength=size) + np.bincount(
        frame.b[frame.between_particles()], minlength=size
    )


def mechanical_coordination_number(counts: NDArray[np.integer[Any]]) -> float:
    """The mean number of contacts of the particles that carry load.

    Particles with fewer than `_LEAST_CONTACTS` contacts are left out as carriers, while their
    contacts still count for the carriers that they touch, as in the (2 M - N1) / (N - N0 - N1) of
    Thornton (2000, Geotechnique 50, 43-53), who leaves out those with fewer than two. NaN where no
    particle is left.
    """
    return _mean(counts[counts >= _LEAST_CONTACTS])


def frame_statistics(frame: NetworkFrame, clusters: Clusters | None = None) -> dict[str, float]:
    """Return one row of ``network.parquet``; forces in N, NaN where a frame has no contact.

    The coordination number is the mean number of contacts per particle. Without walls that is
    2 M / N for M contacts (Thornton 2000, Geotechnique 50, 43-53); a contact with workpiece or
    bowl counts once, for the particle.

    `clusters` is what `frame_clusters` returns for the frame, if it is known already.
    """
    clusters = clusters or frame_clusters(frame)
    counts = contact_counts(frame)
    normal = frame.normal_force
    mean = _mean(normal)
    of_kind = {
        f"n_particle_{name}_contacts": int((frame.other == kind).sum())
        for kind, name in BODY_NAMES.items()
    }
    return {
        "step": frame.step,
        "time_s": frame.time_s,
        "n_particles": frame.particle_id.size,
        "n_contacts": normal.size,
        **of_kind,
        "coordination_number": _mean(counts),
        "mechanical_coordination_number": mechanical_coordination_number(counts),
        "rattler_fraction": _mean(counts < _LEAST_CONTACTS),
        "normal_force_mean_n": mean,
        "normal_force_max_n": float(normal.max()) if normal.size else mean,
        "above_mean_fraction": _mean(normal > mean),
        **{f"{name}_n": force for name, force in clusters.percolation_n.items()},
    }


def _mean(values: NDArray[Any]) -> float:
    return float(values.mean()) if values.size else float("nan")

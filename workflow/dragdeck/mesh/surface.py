"""A triangle surface in space, and what can be measured on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

NODE_PRECISION_M = 1e-8
"""Nodes closer than this are one node to the engine (its `precision`)."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface made of triangles.

    Parameters
    ----------
    points : (N, 3) float array
        The nodes, in metres.
    triangles : (M, 3) integer array
        Three rows of `points` a facet, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        If the shapes are wrong or a facet names a node that is not there.
    """

    points: Floats
    triangles: Integers

    def __post_init__(self) -> None:
        """Check the shapes and lock the arrays."""
        points = np.array(self.points, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(self.triangles, dtype=np.int64).reshape(-1, 3)
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(points):
            raise ValueError(f"a facet names a node outside 0 ... {len(points) - 1}")
        points.flags.writeable = triangles.flags.writeable = False
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "triangles", triangles)

    @property
    def bounds(self) -> Floats:
        """(2, 3) array: the lowest and the highest coordinates of the facets, in metres."""
        used = self.points[np.unique(self.triangles)]
        return np.array([used.min(axis=0), used.max(axis=0)])

    @property
    def extent(self) -> Floats:
        """(3,) array: the size of the bounding box, in metres."""
        low, high = self.bounds
        return np.asarray(high - low, dtype=np.float64)

    @cached_property
    def corners(self) -> Floats:
        """(M, 3, 3) array: facet, corner, coordinate, in metres."""
        return self.points[self.triangles]

    @cached_property
    def edge_vectors(self) -> Floats:
        """(M, 3, 3) array: from corner k of a facet to the next one, in metres."""
        return np.asarray(np.roll(self.corners, -1, axis=1) - self.corners)

    @cached_property
    def facet_areas(self) -> Floats:
        """(M,) array, in square metres."""
        return np.asarray(np.linalg.norm(self._area_vectors, axis=1))

    @cached_property
    def normals(self) -> Floats:
        """(M, 3) array of unit vectors; zero for a facet without area."""
        return unit_vectors(self._area_vectors)

    @cached_property
    def angles_deg(self) -> Floats:
        """(M, 3) array: the inner angle at every corner; zero beside an edge without length."""
        edges = unit_vectors(self.edge_vectors)
        backwards = -np.roll(edges, 1, axis=1)
        sine = np.linalg.norm(np.cross(edges, backwards), axis=2)
        cosine = np.einsum("mkc,mkc->mk", edges, backwards)
        return np.asarray(np.degrees(np.arctan2(sine, cosine)))

    @cached_property
    def volume(self) -> float:
        """Enclosed volume in cubic metres; positive if the normals of a closed mesh point out."""
        first, second, third = np.moveaxis(self.corners - self.bounds[0], 1, 0)
        return float(np.einsum("mc,mc->", first, np.cross(second, third)) / 6.0)

    @property
    def closed(self) -> bool:
        """Whether every edge belongs to exactly two facets."""
        return len(self.triangles) > 0 and bool(np.all(self.edge_use == 2))

    @property
    def oriented(self) -> bool:
        """Whether facets that share an edge run along it in opposite directions."""
        directed = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        return len(np.unique(directed, axis=0)) == len(directed)

    @property
    def neighbours(self) -> Integers:
        """(M,) array: how many facets share an edge with a facet."""
        return np.asarray((self.edge_use[self.edge_numbers] - 1).sum(axis=1))

    @cached_property
    def _area_vectors(self) -> Floats:
        edges = self.edge_vectors
        return np.asarray(np.cross(edges[:, 0], edges[:, 1]) / 2.0)

    @cached_property
    def _edges(self) -> tuple[Integers, Integers]:
        pairs = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        _, index, use = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
        return index.reshape(-1, 3), use

    @property
    def edge_numbers(self) -> Integers:
        """(M, 3) array: the number of the edge after every corner."""
        return self._edges[0]

    @property
    def edge_use(self) -> Integers:
        """How many facets have an edge."""
        return self._edges[1]


def unit_vectors(vectors: Floats) -> Floats:
    """Scale the vectors along the last axis to length one; those without length stay zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def weld(mesh: Mesh, precision_m: float = NODE_PRECISION_M) -> Mesh:
    """Make one node of all that lie within the engine's precision of each other.

    Nodes that no facet uses are dropped; facets stay as many as they were.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    if not len(mesh.triangles) or not np.isfinite(mesh.points).all():
        return mesh
    used, corner = np.unique(mesh.triangles, return_inverse=True)
    points = mesh.points[used]
    first, second = KDTree(points).query_pairs(precision_m, output_type="ndarray").T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(len(points),) * 2)
    _, label = connected_components(links, directed=False)
    _, kept = np.unique(label, return_index=True)
    triangles = np.asarray(label[corner], dtype=np.int64).reshape(-1, 3)
    return Mesh(points[kept], triangles)


def place(mesh: Mesh) -> Mesh:
    """Move a mesh to the workpiece's coordinates.

    The origin becomes the middle of the bounding box in x and y, at its lowest
    z. The axes keep their directions: a workpiece is drawn upright, +z away from
    the floor.
    """
    if not len(mesh.triangles):
        return mesh
    low, high = mesh.bounds
    origin = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    return replace(mesh, points=mesh.points - origin)


@dataclass(frozen=True)
class Envelope:
    """The upright cylinder around the z axis that just holds a workpiece.

    Parameters
    ----------
    radius_m : float
        Distance of the outermost node from the axis, in metres: how near to a
        wall the workpiece's reference point may come, whichever way the workpiece turns.
    bottom_m, top_m : float
        Lowest and highest z, in metres.
    """

    radius_m: float
    bottom_m: float
    top_m: float

    @property
    def length_m(self) -> float:
        """Height of the cylinder, in metres."""
        return self.top_m - self.bottom_m


def envelope(mesh: Mesh) -> Envelope:
    """Measure the cylinder around the z axis that holds the mesh where it stands."""
    used = mesh.points[np.unique(mesh.triangles)]
    return Envelope(
        radius_m=float(np.hypot(used[:, 0], used[:, 1]).max()),
        bottom_m=float(used[:, 2].min()),
        top_m=float(used[:, 2].max()),
    )

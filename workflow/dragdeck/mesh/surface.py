"""Triangle surfaces in space: trimesh's, made, welded, placed and measured as the engine needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from trimesh import Trimesh
from trimesh.graph import connected_component_labels

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

NODE_PRECISION_M = 1e-8
"""Nodes closer than this are one node to the engine (its `precision`)."""


def surface(points: ArrayLike, triangles: ArrayLike) -> Trimesh:
    """Make a surface of triangles, just as given and not to be changed.

    Parameters
    ----------
    points : (N, 3) array_like
        The nodes, in metres.
    triangles : (M, 3) array_like
        Three rows of `points` a facet, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        If a facet names a node that is not there.
    """
    nodes = np.array(points, dtype=np.float64).reshape(-1, 3)
    facets = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    if facets.size and not 0 <= facets.min() <= facets.max() < len(nodes):
        raise ValueError(f"a facet names a node outside 0 ... {len(nodes) - 1}")
    mesh = Trimesh(nodes, facets, process=False)
    mesh.mutable = False
    return mesh


def weld(mesh: Trimesh, precision_m: float = NODE_PRECISION_M) -> Trimesh:
    """Make one node of all that lie within the engine's precision of each other.

    Nodes that no facet uses are dropped; facets stay as many as they were.
    Unlike trimesh's own `merge_vertices`, which rounds coordinates, this joins
    close nodes on whichever side of a rounding limit they lie.
    """
    if mesh.is_empty or not np.isfinite(mesh.vertices).all():
        return mesh
    used = surface(mesh.vertices[mesh.referenced_vertices], _renumbered(mesh))
    close = used.kdtree.query_pairs(precision_m, output_type="ndarray")
    label = connected_component_labels(close, node_count=len(used.vertices))
    _, kept = np.unique(label, return_index=True)
    return surface(used.vertices[kept], label[used.faces])


def _renumbered(mesh: Trimesh) -> Integers:
    """(M, 3) array: the facets' nodes counted without those that no facet uses."""
    return np.asarray((np.cumsum(mesh.referenced_vertices) - 1)[mesh.faces])


def place(mesh: Trimesh) -> Trimesh:
    """Move a mesh to the workpiece's coordinates.

    The origin becomes the middle of the bounding box in x and y, at its lowest
    z. The axes keep their directions: a workpiece is drawn upright, +z away from
    the floor.
    """
    if mesh.is_empty:
        return mesh
    low, high = mesh.bounds
    origin = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    return surface(mesh.vertices - origin, mesh.faces)


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


def envelope(mesh: Trimesh) -> Envelope:
    """Measure the cylinder around the z axis that holds the mesh where it stands."""
    used = mesh.vertices[mesh.referenced_vertices]
    bottom, top = mesh.bounds[:, 2]
    return Envelope(float(np.hypot(used[:, 0], used[:, 1]).max()), float(bottom), float(top))

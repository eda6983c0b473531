"""Triangle surfaces in space: trimesh's, made, welded, placed and measured as the engine needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from trimesh import Trimesh

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

NODE_PRECISION_M = 1e-8
"""Nodes closer than this are one node to the engine (its `precision`)."""

MERGED, CAD_VOLUME, REMESHED = "merged_nodes", "cad_volume_m3", "remeshed"
"""Keys of a mesh's metadata: what it was read from, for `findings`."""

_FARTHEST_M = 1e100
"""Lengths up to here can be squared and multiplied."""

_TURNED = {
    "+x": ((2, 1, 0), (-1, 1, 1)),
    "-x": ((2, 1, 0), (1, 1, -1)),
    "+y": ((0, 2, 1), (1, -1, 1)),
    "-y": ((0, 2, 1), (1, 1, -1)),
    "+z": ((0, 1, 2), (1, 1, 1)),
    "-z": ((0, 1, 2), (1, -1, -1)),
}
"""Rotations of an axis to +z, those of x about y, the others about x: old axes and their signs."""


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
    from trimesh import Trimesh

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
    from scipy.spatial import KDTree
    from trimesh.graph import connected_component_labels

    if mesh.is_empty:
        return mesh
    used = surface(mesh.vertices[mesh.referenced_vertices], _renumbered(mesh))
    places, same = _unique_rows(used.vertices)
    tree = KDTree(places, compact_nodes=False, balanced_tree=False)  # made in half the time
    close = tree.query_pairs(precision_m, output_type="ndarray")
    label = connected_component_labels(close, node_count=len(places))[same]
    _, kept = np.unique(label, return_index=True)
    return surface(used.vertices[kept], label[used.faces])


def _unique_rows(rows: Floats) -> tuple[Floats, Integers]:
    """As `numpy.unique` of rows, (N, 3), in a fifth of the time: by one number of each."""
    bits = (rows + 0.0).view(np.uint64)
    mixed = (bits ^ bits >> 32) @ np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 1], np.uint64)
    _, first, same = np.unique(mixed, return_index=True, return_inverse=True)
    if (rows[first][same] != rows).any():  # two rows have one number
        return np.unique(rows, axis=0, return_inverse=True)
    order = np.lexsort(rows[first].T[::-1])
    return rows[first[order]], np.argsort(order)[same]


def are_lengths(coordinates: Floats) -> NDArray[np.bool_]:
    """Which coordinates are numbers with which a surface can be measured."""
    return np.abs(coordinates) <= _FARTHEST_M


def _renumbered(mesh: Trimesh) -> Integers:
    """(M, 3) array: the facets' nodes counted without those that no facet uses."""
    return np.asarray((np.cumsum(mesh.referenced_vertices) - 1)[mesh.faces])


def facing_out(mesh: Trimesh) -> Trimesh | None:
    """The same body with the corners of every facet counter-clockwise seen from outside.

    Parameters
    ----------
    mesh : Trimesh
        One closed body; if its corners run as they should, it is returned as it is.

    Returns
    -------
    Trimesh or None
        None if the surface has one side only, as Klein's bottle.
    """
    if not mesh.is_winding_consistent:
        one_side = _one_side(mesh)
        return None if one_side is None else facing_out(one_side)
    centre = mesh.bounds.mean(axis=0)
    if np.einsum("fc,fc->", mesh.triangles[:, 0] - centre, mesh.triangles_cross) > 0.0:
        return mesh
    return surface(mesh.vertices, mesh.faces[:, ::-1])


def facing_up(mesh: Trimesh) -> Trimesh | None:
    """The same open surface with its facets facing the side of its opening; None with one side."""
    if not mesh.is_winding_consistent:
        one_side = _one_side(mesh)
        return None if one_side is None else facing_up(one_side)
    upwards = float(mesh.triangles_cross[:, 2].sum()) > 0.0
    return mesh if upwards else surface(mesh.vertices, mesh.faces[:, ::-1])


def _one_side(mesh: Trimesh) -> Trimesh | None:
    """The same body with all facets facing out, or all in.

    Every facet stands here twice, as it is and turned. Two of them belong together if they run
    through their common edge in opposite directions; what belongs together with the first facet
    is one side of the body.
    """
    from trimesh.graph import connected_component_labels
    from trimesh.grouping import group_rows

    edges = group_rows(mesh.edges_sorted, require_count=2)
    first, other = mesh.edges_face[edges].T
    count = len(mesh.faces)
    turned = count * (mesh.edges[edges[:, 0], 0] == mesh.edges[edges[:, 1], 0])
    pairs = np.column_stack([first, other + turned, first + count, other + count - turned])
    label = connected_component_labels(pairs.reshape(-1, 2), node_count=2 * count)
    as_is, other_way = label.reshape(2, -1)
    if as_is[0] == other_way[0]:
        return None
    flipped = (as_is != as_is[0])[:, None]
    return surface(mesh.vertices, np.where(flipped, mesh.faces[:, ::-1], mesh.faces))


def upright(mesh: Trimesh, axis: str) -> Trimesh:
    """Turn a mesh so that a direction of its file, such as "+x", points up, away from the floor."""
    axes, signs = _TURNED[axis]
    turned = surface(mesh.vertices[:, axes] * signs, mesh.faces)
    turned.metadata.update(mesh.metadata)
    return turned


def tilted(mesh: Trimesh, angle_deg: float, *, about_tip: bool = False) -> Trimesh:
    """Lean a placed mesh towards +x; its lowest point stays at z = 0, or its tip in the origin."""
    angle = np.radians(angle_deg)
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    corners = mesh.vertices @ turn.T
    lowest = 0.0 if about_tip else corners[mesh.referenced_vertices, 2].min()
    return surface(corners - [0.0, 0.0, lowest], mesh.faces)


def obtuse_third(nodes: Floats, facets: Integers) -> Integers:
    """(M, 3) array: the facets, turned cyclically so that an obtuse corner is the third."""
    corners = nodes[facets]
    before, after = (np.roll(corners, shift, axis=1) - corners for shift in (1, -1))
    cosines = (before * after).sum(axis=2)  # times lengths; not einsum, whose rounding varies
    first = np.where(cosines.min(axis=1) < 0.0, cosines.argmin(axis=1) + 1, 0)
    return np.take_along_axis(facets, (first[:, None] + np.arange(3)) % 3, axis=1)


def points_below(mesh: Trimesh, height_m: float) -> Floats:
    """Corners, (N, 3), of what a mesh has below a height, m."""
    begin, end = mesh.vertices[mesh.edges_unique].transpose(1, 0, 2)
    first, second = begin[:, 2] <= height_m, end[:, 2] <= height_m
    crossing = first != second
    rise = np.where(crossing, end[:, 2] - begin[:, 2], 1.0)
    cut = begin + ((height_m - begin[:, 2]) / rise)[:, None] * (end - begin)
    return np.concatenate([begin[first], end[second], cut[crossing]])


def volume_below(mesh: Trimesh, height_m: float) -> float:
    """Volume of what a closed body has below a height, m3.

    By the divergence theorem it is the integral of n_z (z - height) over the surface below: the
    plane that closes it adds nothing. On a facet whose lowest corner a alone is below,
    the mean of min(z - height, 0) is ``a^3 / (3 (a - b) (a - c))`` of the corners' heights.
    """
    low, middle, high = np.sort(mesh.triangles[:, :, 2] - height_m, axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        lower = low**3 / (3 * (low - middle) * (low - high))
        upper = high**3 / (3 * (high - low) * (high - middle))
    mean = (low + middle + high) / 3
    below = np.select([low >= 0, middle > 0, high > 0], [0.0, lower, mean - upper], mean)
    return float((below * mesh.triangles_cross[:, 2]).sum() / 2)


def place(mesh: Trimesh, axis_m: tuple[float, float] | None = None) -> Trimesh:
    """Move an upright mesh to the workpiece's coordinates.

    Parameters
    ----------
    mesh : Trimesh
    axis_m : (float, float), optional
        x and y of the clamping axis in metres, which becomes the z axis; by default the middle
        of the bounding box. The lowest z becomes 0.
    """
    if mesh.is_empty:
        return mesh
    low, high = mesh.bounds
    x, y = axis_m or ((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0)
    return surface(mesh.vertices - np.array([x, y, low[2]]), mesh.faces)


def open_edges(faces: Integers) -> Integers:
    """Edges of one facet alone, (E, 2), in the sense of this facet."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, place, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray(edges[count[place.ravel()] == 1])


def raised(bowl: Trimesh, height_m: float) -> Trimesh:
    """A bowl with upright walls above its rim, up to a height."""
    low = open_edges(bowl.faces)
    nodes, place = np.unique(low, return_inverse=True)
    begin, end = (len(bowl.vertices) + place.reshape(-1, 2)).T
    first, second = low.T
    top = bowl.vertices[nodes] * [1, 1, 0] + [0, 0, height_m]
    sides = [[second, first, begin], [second, begin, end]]
    walls = np.hstack([np.array(side) for side in sides]).T
    return surface(np.vstack([bowl.vertices, top]), np.vstack([bowl.faces, walls]))

"""Contacts of spheres that LIGGGHTS overlooks on a mesh: its rules, and what a mesh loses by them.

Source of the rules: ``tri_mesh_I.h`` and ``surface_mesh_I.h`` of LIGGGHTS 3.8.0, one MPI rank.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError
from dragdeck.files import write_text
from dragdeck.mesh.checks import check
from dragdeck.mesh.files import STEP, UNITS, read, stl_text
from dragdeck.mesh.surface import NODE_PRECISION_M, Floats, Integers, obtuse_third, surface

if TYPE_CHECKING:
    from trimesh import Trimesh

COPLANAR = 1 - 1e-5
"""Cosine from which facets are coplanar, and edges in line, to LIGGGHTS (its `curvature`)."""

_AT_ONCE = 50
"""Positions that are compared with the facets round them at the same time, to limit the memory."""

_OVERLAP = 0.01
"""Of a position at an edge, as a fraction of the sphere's radius: it begins to touch."""

_POSITIONS = 4000
"""At edges: two standard errors of a fraction are at most 1.6 %."""


@dataclass(frozen=True)
class EngineMesh:
    """A mesh as LIGGGHTS resolves contacts of spheres with it.

    A sphere touches a facet at its face, an edge or a corner, which follows from the signs of the
    barycentric coordinates of the centre. Beside an obtuse corner, the nearest point is on an
    edge although the signs say corner. LIGGGHTS looks there only if the corner is the third of
    its facet. Of two facets, one owns the common edge; nobody owns an edge within a plane, or
    a corner between two edges that are in line.

    Attributes
    ----------
    corners : (M, 3, 3) array
        Of the facets, in their order in the file, m.
    edge_active, corner_active : (M, 3) bool array
        Whether a facet owns its edge from corner k to corner k + 1, and its corner k.
    """

    corners: Floats
    edge_active: NDArray[np.bool_]
    corner_active: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: Trimesh) -> EngineMesh:
        """What LIGGGHTS makes of a welded mesh."""
        edges = _edge_owners(mesh)
        return cls(np.asarray(mesh.triangles), edges, _corner_owners(mesh, edges))

    @cached_property
    def _spheres(self) -> tuple[Floats, Floats]:
        """Centres, (M, 3), and radii, (M,), of spheres around the facets."""
        centres = self.corners.mean(axis=1)
        return centres, np.linalg.norm(self.corners - centres[:, None], axis=2).max(axis=1)

    @cached_property
    def _edges(self) -> tuple[Floats, Floats]:
        """Directions, (M, 3, 3), and lengths, (M, 3), of the edges."""
        edges = np.roll(self.corners, -1, axis=1) - self.corners
        lengths = np.linalg.norm(edges, axis=2)
        return edges / lengths[..., None], lengths

    def nearest(self, points: Floats, reach: float) -> Floats:
        """Distances of points, (N, 3), from what LIGGGHTS sees of the mesh; inf beyond `reach`."""
        from scipy.spatial import KDTree

        centres, bounds = self._spheres
        sizes = np.ceil(np.log2(bounds)).astype(np.int64)
        distance = np.full(len(points), np.inf)
        for size in np.unique(sizes):
            facets = np.flatnonzero(sizes == size)
            tree, within = KDTree(centres[facets]), reach + 2.0**size
            for begin in range(0, len(points), _AT_ONCE):
                some = KDTree(points[begin : begin + _AT_ONCE])
                pairs = some.sparse_distance_matrix(tree, within, output_type="ndarray")
                rows = begin + pairs["i"]
                np.minimum.at(distance, rows, self._distances(points[rows], facets[pairs["j"]]))
        return np.where(distance < reach, distance, np.inf)

    def _distances(self, points: Floats, facets: Integers) -> Floats:
        """(K,): the distance of each point from its facet; inf if it is at an inactive part."""
        corners, rows = self.corners[facets], np.arange(len(facets))
        edges, lengths = (part[facets] for part in self._edges)
        to = points[:, None] - corners
        along = np.einsum("kec,kec->ke", to, edges)
        cosine = np.einsum("kc,kc->k", edges[:, 0], edges[:, 2])
        last = np.einsum("kc,kc->k", to[:, 0], edges[:, 2])
        second = (along[:, 0] - last * cosine) / (lengths[:, 0] * (1 - cosine**2))
        third = (along[:, 0] * cosine - last) / (lengths[:, 2] * (1 - cosine**2))
        weights = np.column_stack([1 - second - third, second, third])
        positive = weights > -NODE_PRECISION_M / (2 * self._spheres[1][facets, None])
        count = positive.sum(axis=1)
        corner, edge = positive.argmax(axis=1), (positive.argmin(axis=1) + 1) % 3

        third_is_obtuse = np.einsum("kc,kc->k", edges[:, 2], edges[:, 1]) > 0
        beside = (count == 1) & (corner == 2) & third_is_obtuse
        beside &= (along[:, 1] < lengths[:, 1]) | (along[:, 2] > 0)
        edge = np.where(beside, np.where(along[:, 1] < lengths[:, 1], 1, 2), edge)
        at_edge = beside | (count == 2)
        past, before = along[rows, edge] > lengths[rows, edge], along[rows, edge] < 0
        corner = np.where(at_edge, np.where(past, (edge + 1) % 3, edge), corner)
        at_corner = ~at_edge | past | before

        normals = np.cross(edges[:, 0], edges[:, 1])
        height = np.einsum("kc,kc->k", to[:, 0], normals) / np.linalg.norm(normals, axis=1)
        beside_edge = to[rows, edge] - along[rows, edge, None] * edges[rows, edge]
        seen_at_edge = np.where(
            self.edge_active[facets, edge], np.linalg.norm(beside_edge, axis=1), np.inf
        )
        seen_at_corner = np.where(
            self.corner_active[facets, corner], np.linalg.norm(to[rows, corner], axis=1), np.inf
        )
        return np.select([count == 3, at_corner], [np.abs(height), seen_at_corner], seen_at_edge)


def _edge_owners(mesh: Trimesh) -> NDArray[np.bool_]:
    pairs, places = mesh.face_adjacency, mesh.face_adjacency_unshared
    edges = (mesh.faces[pairs] == places[..., None]).argmax(axis=2) + 1  # after the other corner
    active = np.ones((len(mesh.faces), 3), dtype=np.bool_)
    first_owns = pairs[:, 0] > pairs[:, 1]
    within_plane = _within_plane(mesh)
    active[pairs[:, 0], edges[:, 0] % 3] = first_owns & ~within_plane
    active[pairs[:, 1], edges[:, 1] % 3] = ~first_owns & ~within_plane
    return active


def _within_plane(mesh: Trimesh) -> NDArray[np.bool_]:
    """Which pairs of adjacent facets LIGGGHTS takes for parts of a plane, without a fold."""
    nodes, (first, second) = mesh.vertices, mesh.face_normals[mesh.face_adjacency].swapaxes(0, 1)
    start, end = nodes[mesh.face_adjacency_edges].swapaxes(0, 1)
    outwards = np.cross(end - start, first)
    sides = [
        np.einsum("kc,kc->k", nodes[corner] - start, outwards)
        for corner in mesh.face_adjacency_unshared.T
    ]
    parallel = np.abs(np.einsum("kc,kc->k", first, second)) >= COPLANAR
    return np.asarray(parallel & (sides[0] * sides[1] <= 0))


def _corner_owners(mesh: Trimesh, edge_active: NDArray[np.bool_]) -> NDArray[np.bool_]:
    from scipy.spatial import KDTree

    ends = np.vstack([mesh.edges_unique, mesh.edges_unique[:, ::-1]])
    ways = mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    # directions of edges at one node are near each other only with the same fourth coordinate
    at_node = np.column_stack([np.vstack([ways, -ways]), 10.0 * np.tile(ends[:, 0], 2)])
    in_line = KDTree(at_node).query_pairs(np.sqrt(2 - 2 * COPLANAR), output_type="ndarray")
    straight = np.zeros(len(mesh.vertices), dtype=np.bool_)
    straight[ends[in_line[:, 0] % len(ends), 0]] = True

    facets = np.repeat(np.arange(len(mesh.faces)), 3)
    owner = np.zeros(len(mesh.vertices), dtype=np.int64)
    np.maximum.at(owner, mesh.faces.ravel(), facets)  # the last one in the file
    touched = np.zeros(len(mesh.vertices), dtype=np.bool_)
    for corner in (0, 1):
        touched[np.roll(mesh.faces, -corner, axis=1)[edge_active]] = True
    owned = owner[mesh.faces] == np.arange(len(mesh.faces))[:, None]
    return np.asarray(owned & (touched & ~straight)[mesh.faces])


@dataclass(frozen=True)
class ConvexEdges:
    """The convex edges of a mesh, between two facets each.

    Attributes
    ----------
    start, vector : (E, 3) array
        From one end to the other, m.
    normals : (E, 2, 3) array
        Of the two facets.
    angle : (E,) array
        Between the normals, rad.
    within_plane : (E,) bool array
        Whether LIGGGHTS takes the facets for parts of a plane, so that nobody owns the edge.
    """

    start: Floats
    vector: Floats
    normals: Floats
    angle: Floats
    within_plane: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: Trimesh) -> ConvexEdges:
        """Those of a mesh whose normals point out."""
        convex = mesh.face_adjacency_projections < 0
        start, end = mesh.vertices[mesh.face_adjacency_edges[convex]].swapaxes(0, 1)
        normals = mesh.face_normals[mesh.face_adjacency[convex]]
        angle = mesh.face_adjacency_angles[convex]
        return cls(start, end - start, normals, angle, _within_plane(mesh)[convex])

    @property
    def areas_per_radius(self) -> Floats:
        """(E,): area on which centres touch an edge, over their distance from it, m."""
        return np.asarray(np.linalg.norm(self.vector, axis=1) * self.angle)

    def places(self, count: int, distance: float, random: np.random.Generator) -> Floats:
        """Random places, (count, 3), with equal chance on the area round edges out of plane."""
        weight = self.areas_per_radius * ~self.within_plane
        edge = random.choice(len(weight), count, p=weight / weight.sum())
        along, turned = random.random((2, count, 1))
        angle, (first, second) = self.angle[edge, None], self.normals[edge].swapaxes(0, 1)
        normal = np.sin((1 - turned) * angle) * first + np.sin(turned * angle) * second
        outwards = normal / np.sin(angle)
        return np.asarray(self.start[edge] + along * self.vector[edge] + distance * outwards)


def gap_fraction(mesh: Trimesh, radius_m: float) -> float:
    """Fraction of the positions of a touching sphere that LIGGGHTS overlooks within a plane.

    Nobody owns the edge between two facets that LIGGGHTS takes for parts of a plane, and between
    their normals, over an arc of the radius times their angle, no face is below the sphere. Edges
    alone are counted, not corners.

    Parameters
    ----------
    mesh : Trimesh
        Its normals point out.
    radius_m : float
        Of the sphere.
    """
    edges = ConvexEdges.of(mesh)
    areas = radius_m * edges.areas_per_radius
    return float(areas[edges.within_plane].sum() / (mesh.area + areas.sum()))


class Overlooked(NamedTuple):
    """Positions at convex edges, and those of them without contact as a file is, and turned."""

    positions: int
    as_written: int
    turned: int


def overlooked(mesh: Trimesh, radius_m: float, seed: int = 1) -> Overlooked:
    """Count random positions of a sphere that begins to touch a convex edge.

    Positions at which it touches anything else more deeply do not count.
    """
    edges, random = ConvexEdges.of(mesh), np.random.default_rng(seed)
    if edges.within_plane.all():
        return Overlooked(0, 0, 0)
    distance = (1 - _OVERLAP) * radius_m
    points = edges.places(_POSITIONS, distance, random)
    turned = EngineMesh.of(turned_mesh(mesh))
    all_active = np.ones_like(turned.edge_active)
    whole = replace(turned, edge_active=all_active, corner_active=all_active)
    at_edge = points[whole.nearest(points, radius_m) > (1 - 1e-6) * distance]
    lost = [
        int(np.isinf(engine_mesh.nearest(at_edge, radius_m)).sum())
        for engine_mesh in (EngineMesh.of(mesh), turned)
    ]
    return Overlooked(len(at_edge), *lost)


def turned_mesh(mesh: Trimesh) -> Trimesh:
    """The same facets in the same order, an obtuse corner third."""
    return surface(mesh.vertices, obtuse_third(mesh.vertices, mesh.faces))


def report(
    file: Path, unit: str, radius_m: float, facet_size_m: float | None, out: Path | None
) -> str:
    """What LIGGGHTS overlooks on the mesh of a file; the turned mesh is written to another one.

    Raises
    ------
    InputError
        The mesh cannot be read or LIGGGHTS would refuse it, a length is not positive, or the
        file would be replaced.
    """
    for field, length in (("--radius", radius_m), ("--facet-size", facet_size_m)):
        if length is not None and not 0 < length < math.inf:
            raise InputError("not a length", field=field, value=length, limit="above 0 m")
    if file.suffix.lower() in STEP and facet_size_m is None:
        remedy = "add the facet_size_m of the study, for example --facet-size 0.001"
        raise InputError("a STEP file is meshed here", file=file, remedy=remedy)
    if out is not None and out.resolve() == file.resolve():
        raise InputError("the file would be replaced", field="--out", remedy="give another name")
    mesh = read(file, unit, facet_size_m)
    check(mesh, file=file, workpiece=False)
    lines = [
        f"{file.name}: {len(mesh.faces):,} facets, {_not_third(mesh):,} with an obtuse corner that "
        "is not the third"
    ]
    places, spheres = overlooked(mesh, radius_m), f"spheres with a radius of {1e3 * radius_m:g} mm"
    if places.positions:
        lines += [
            f"contacts at convex edges that LIGGGHTS overlooks ({places.positions:,} positions, "
            f"{spheres}):",
            f"  as written: {_percent(places.as_written, places.positions)}",
            f"  turned:     {_percent(places.turned, places.positions)}",
        ]
    else:
        lines.append("no convex edges, so that no contact is overlooked there")
    gaps = gap_fraction(mesh, radius_m)
    lines.append(
        f"gaps at convex edges below 0.26 degrees: {100 * gaps:.2g} % of the surface ({spheres})"
    )
    if out is not None:
        write_text(out, stl_text(surface(mesh.vertices / UNITS[unit], mesh.faces)))
        lines.append(f"{out}: the same facets, turned; unit {unit}")
    return "\n".join(lines)


def _not_third(mesh: Trimesh) -> int:
    turned = obtuse_third(mesh.vertices, mesh.faces)
    return int((turned != mesh.faces).any(axis=1).sum())


def _percent(count: int, of: int) -> str:
    """A fraction with its exact confidence interval (Clopper and Pearson 1934)."""
    from scipy.stats import binomtest

    low, high = binomtest(count, of).proportion_ci()
    return f"{100 * count / of:.2g} % (95 % CI {100 * low:.2g} to {100 * high:.2g} %)"

"""What the engine, or the physics, does not stand in a mesh.

The limits are those of LIGGGHTS 3.8.0, fix mesh/surface; the geometry is trimesh's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError, together
from dragdeck.mesh.surface import (
    CAD_VOLUME,
    MERGED,
    NODE_PRECISION_M,
    REMESHED,
    Floats,
    Integers,
    facing_out,
    points_below,
)

if TYPE_CHECKING:
    from trimesh import Trimesh

_CURVATURE_DEG = 0.256235
"""Default of the engine's `curvature`; no facet may have a smaller angle."""

_ANGLE_WARNING_DEG = 0.5
"""Below this smallest angle the engine warns of a skewed element."""

_MAX_NEIGHBOURS = 5
"""Facets that may share an edge with a facet."""


_LOST_VOLUME = 0.05
"""Part of a CAD part's volume that its facets may cut off; a round bar is then 1.3 % narrower."""


@dataclass(frozen=True)
class Surroundings:
    """What a workpiece is to work in, to tell whether its size makes sense.

    Parameters
    ----------
    bowl_radius_m, particle_radius_m : float
        In metres; the particle's is the mean.
    depth_m : float
        Of what is in the bed and must be narrower than the bowl, above the lowest point, m.
    """

    bowl_radius_m: float
    particle_radius_m: float
    depth_m: float = np.inf


class MeshDefect(NamedTuple):
    """One thing that is wrong, or doubtful, with a mesh.

    Parameters
    ----------
    problem, value, limit, remedy : str
        The parts of the message.
    severity : {"error", "warning"}
        An error is what the engine, or the physics, does not stand.
    """

    problem: str
    value: str
    limit: str
    remedy: str
    severity: Literal["error", "warning"] = "error"


def check(
    mesh: Trimesh,
    *,
    file: Path | str | None = None,
    field: str | None = None,
    workpiece: bool = True,
    surroundings: Surroundings | None = None,
) -> list[MeshDefect]:
    """Refuse a mesh that the engine would refuse or that makes no sense.

    Parameters
    ----------
    mesh : Trimesh
        In metres, welded, as `read` and the makers return it.
    file, field : optional
        Where the mesh comes from, for the message.
    workpiece, surroundings
        As in `findings`.

    Returns
    -------
    list of MeshDefect
        The warnings.

    Raises
    ------
    InputError
        For all errors found.
    """
    problems = findings(mesh, workpiece=workpiece, surroundings=surroundings)
    errors = [
        InputError(problem, file=file, field=field, value=value, limit=limit, remedy=remedy)
        for problem, value, limit, remedy, severity in problems
        if severity == "error"
    ]
    if errors:
        raise together(errors)
    return problems


def findings(
    mesh: Trimesh, *, workpiece: bool = True, surroundings: Surroundings | None = None
) -> list[MeshDefect]:
    """List what is wrong with a mesh, the root causes first.

    Parameters
    ----------
    mesh : Trimesh
        In metres, welded.
    workpiece : bool
        Whether the mesh is a body and must be closed with its normals out.
    surroundings : Surroundings, optional
        To see whether the size is plausible.
    """
    if mesh.is_empty:
        limit, remedy = "at least one facet", "export the surface as triangles; or it was cut short"
        return [MeshDefect("the mesh is empty", "0 facets", limit, remedy)]
    problems = _implausible_size(mesh, surroundings) if surroundings else []
    problems += _degenerate(mesh) + _duplicates(mesh)
    sound = mesh.nondegenerate_faces(height=NODE_PRECISION_M) & mesh.unique_faces()
    problems += _sharp_angles(mesh, sound) + _overlaps(mesh, sound)
    problems += _crowded_edges(mesh)
    if workpiece:
        problems += (_open_edges(mesh) + _several_bodies(mesh)) or _turned_normals(mesh)
        problems += _merged_nodes(mesh) + _lost_volume(mesh)
    return sorted(problems, key=lambda finding: finding.severity)


def _facets(
    bad: NDArray[np.bool_], problem: str, limit: str, remedy: str, measured: str = ""
) -> list[MeshDefect]:
    """Return an error that names the bad facets, or nothing if there is none."""
    if not bad.any():
        return []
    numbers = np.flatnonzero(bad)
    shown = ", ".join(str(number) for number in numbers[:5])
    more = ", ..." if len(numbers) > 5 else ""
    value = f"{measured}{len(numbers)} of {len(bad)} facets (counted from 0: {shown}{more})"
    return [MeshDefect(problem, value, limit, remedy)]


def _implausible_size(mesh: Trimesh, scene: Surroundings) -> list[MeshDefect]:
    if _plausible(mesh, 1.0, scene):
        return []
    problem = "the size of the workpiece is not plausible in this bowl"
    value = " x ".join(f"{length:.4g}" for length in mesh.extents) + " m"
    limit = (
        f"narrower than the bowl (diameter {2 * scene.bowl_radius_m:g} m), no longer than ten "
        f"bowls, no smaller than a particle's radius ({scene.particle_radius_m:g} m)"
    )
    return [MeshDefect(problem, value, limit, _unit_remedy(mesh, scene))]


def _plausible(mesh: Trimesh, factor: float, scene: Surroundings) -> bool:
    low, high = mesh.bounds[:, 2]
    in_bed = points_below(mesh, min(high, low + scene.depth_m / factor))
    bowl_m, longest = 2.0 * scene.bowl_radius_m, factor * mesh.extents.max()
    narrow = factor * np.ptp(in_bed[:, :2], axis=0).max() < bowl_m
    return bool(narrow and scene.particle_radius_m <= longest <= 10.0 * bowl_m)


def _unit_remedy(mesh: Trimesh, scene: Surroundings) -> str:
    if _plausible(mesh, 1e-3, scene):
        return "check the unit: is the file in millimetres, but declared in metres?"
    if _plausible(mesh, 1e3, scene):
        return "check the unit: is the file in metres, but declared in millimetres?"
    return "check the unit of the file and the axis of the part, or use a workpiece of another size"


def _degenerate(mesh: Trimesh) -> list[MeshDefect]:
    bad = ~mesh.nondegenerate_faces(height=NODE_PRECISION_M)
    limit = f"a height above the precision of LIGGGHTS, {NODE_PRECISION_M:g} m"
    remedy = "remove degenerate facets in a mesh workpiece and export again, or state facet_size_m"
    return _facets(bad, "a facet has no area", limit, remedy)


def _duplicates(mesh: Trimesh) -> list[MeshDefect]:
    remedy = "remove duplicate facets in a mesh workpiece and export again"
    return _facets(~mesh.unique_faces(), "a facet is duplicated", "every facet once", remedy)


def _sharp_angles(mesh: Trimesh, sound: NDArray[np.bool_]) -> list[MeshDefect]:
    smallest = np.where(sound, np.degrees(mesh.face_angles.min(axis=1)), np.inf)
    x, y, z = 1e3 * mesh.triangles_center[smallest.argmin()]
    at = f"at ({x:.4g}, {y:.4g}, {z:.4g}) mm, clamp upwards"
    remedy = "state facet_size_m of a mesh workpiece: its surface is then meshed anew"
    if REMESHED in mesh.metadata:
        remedy = "use another facet_size_m, or remove tiny details of the part"
    measured = f"{smallest.min():.4g} degrees {at}; "
    problem = "the angle of a facet is too sharp for LIGGGHTS"
    limit = f"above the curvature of the mesh, {_CURVATURE_DEG:g} degrees"
    errors = _facets(smallest <= _CURVATURE_DEG, problem, limit, remedy, measured)
    problem = "needle-like facets slow LIGGGHTS down"
    limit = f"above {_ANGLE_WARNING_DEG:g} degrees"
    doubts = _facets(smallest <= _ANGLE_WARNING_DEG, problem, limit, remedy, measured)
    return errors or [doubt._replace(severity="warning") for doubt in doubts]


def _overlaps(mesh: Trimesh, sound: NDArray[np.bool_]) -> list[MeshDefect]:
    """Find facets of one plane on the same side of the edge that they share."""
    nodes = np.asarray(mesh.vertices)
    start, end = (nodes[row] for row in mesh.face_adjacency_edges.T)
    first, other = (nodes[row] - start for row in mesh.face_adjacency_unshared.T)
    edge = end - start
    # the cosine between edge x one and edge x other, by Lagrange's identity
    length = _dot(edge, edge)
    along_one, along_other = _dot(edge, first), _dot(edge, other)
    product = length * _dot(first, other) - along_one * along_other
    squares = (length * _dot(first, first) - along_one**2) * (
        length * _dot(other, other) - along_other**2
    )
    with np.errstate(divide="ignore", invalid="ignore"):  # of facets without area
        cosine = product / np.sqrt(squares)
    bad = np.zeros(len(mesh.faces), dtype=np.bool_)
    bad[mesh.face_adjacency[cosine >= np.cos(np.radians(_CURVATURE_DEG)), 0]] = True
    bad &= sound
    problem = "two facets of one plane lie on top of each other"
    limit = "facets that share an edge lie on both sides of it"
    return _facets(bad, problem, limit, "repair the mesh: one surface, without folds")


def _dot(first: Floats, other: Floats) -> Floats:
    return np.asarray(np.einsum("kc,kc->k", first, other))


def _edge_use(mesh: Trimesh) -> Integers:
    """How many facets have an edge, in the order of `edges_unique`."""
    return np.bincount(mesh.edges_unique_inverse)


def _crowded_edges(mesh: Trimesh) -> list[MeshDefect]:
    neighbours = (_edge_use(mesh)[mesh.faces_unique_edges] - 1).sum(axis=1)
    measured, limit = f"{neighbours.max()} neighbours; ", f"at most {_MAX_NEIGHBOURS} neighbours"
    problem = "too many facets meet at the edges of one"
    remedy = "repair the mesh: a surface has two facets at an edge"
    return _facets(neighbours > _MAX_NEIGHBOURS, problem, limit, remedy, measured)


def _open_edges(mesh: Trimesh) -> list[MeshDefect]:
    if mesh.is_watertight:
        return []
    use = _edge_use(mesh)
    value = f"{np.count_nonzero(use != 2)} of {len(use)} edges do not join exactly two facets"
    limit = "a workpiece is a body: exactly two facets at every edge"
    remedy = "close the holes and remove inner walls in a mesh workpiece, then export again"
    return [MeshDefect("the mesh is not closed", value, limit, remedy)]


def _several_bodies(mesh: Trimesh) -> list[MeshDefect]:
    from trimesh.graph import connected_component_labels

    body = connected_component_labels(mesh.face_adjacency, node_count=len(mesh.faces))
    facets = np.bincount(body)
    if len(facets) == 1:
        return []
    value = f"{len(facets)} bodies; the largest has {facets.max()} of {len(mesh.faces)} facets"
    remedy = "unite them in CAD, or remove all others, and inner walls, then export again"
    limit = "one body: the surface leads from every facet to every other"
    return [MeshDefect("the mesh contains several bodies", value, limit, remedy)]


def _turned_normals(mesh: Trimesh) -> list[MeshDefect]:
    turned, limit = facing_out(mesh), "corners counter-clockwise, seen from outside"
    if turned is mesh:
        return []
    if turned is None:
        remedy = "repair the mesh: a body has an inside and an outside"
        return [
            MeshDefect(
                "the surface has one side only", "inside and outside are undefined", limit, remedy
            )
        ]
    problem = "the normals do not all point out of the body"
    value = "all point inwards" if mesh.is_winding_consistent else "mixed directions"
    remedy = "they are turned outwards for the run; turn them in the file too"
    return [MeshDefect(problem, value, limit, remedy, "warning")]


def _merged_nodes(mesh: Trimesh) -> list[MeshDefect]:
    merged = mesh.metadata.get(MERGED, 0)
    if not merged:
        return []
    value = f"{merged} merged, {len(mesh.vertices)} remain"
    limit = f"one node within the precision of LIGGGHTS, {NODE_PRECISION_M:g} m"
    remedy = "they are merged for the run; merge them in the file too"
    return [MeshDefect("nodes are duplicated", value, limit, remedy, "warning")]


def _lost_volume(mesh: Trimesh) -> list[MeshDefect]:
    part = mesh.metadata.get(CAD_VOLUME, 0.0)
    lost = 1.0 - abs(mesh.volume) / part if part else 0.0
    if abs(lost) <= _LOST_VOLUME:
        return []
    value = f"{100 * lost:.3g} % of the part's volume is lost"
    remedy = "use a smaller facet_size_m"
    limit = f"at most {100 * _LOST_VOLUME:g} %"
    return [MeshDefect("the facets are coarse for this part", value, limit, remedy, "warning")]

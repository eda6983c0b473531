"""What the engine, or the physics, does not stand in a mesh.

The limits are those of LIGGGHTS 3.8.0, fix mesh/surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError
from dragdeck.mesh.surface import NODE_PRECISION_M, Floats, Integers, Mesh, unit_vectors

CURVATURE_DEG = 0.256235
"""Default of the engine's `curvature`; no facet may have a smaller angle."""

ANGLE_WARNING_DEG = 0.5
"""Below this smallest angle the engine warns of a skewed element."""

MAX_NEIGHBOURS = 5
"""Facets that may share an edge with a facet."""


@dataclass(frozen=True)
class Surroundings:
    """What a workpiece is to work in, to tell whether its size makes sense.

    Parameters
    ----------
    bowl_radius_m, particle_radius_m : float
        In metres; the particle's is the mean.
    """

    bowl_radius_m: float
    particle_radius_m: float


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or doubtful, with a mesh.

    Parameters
    ----------
    severity : {"error", "warning"}
        An error is what the engine, or the physics, does not stand.
    problem, value, limit, remedy : str
        The parts of the message.
    """

    severity: Literal["error", "warning"]
    problem: str
    value: str
    limit: str
    remedy: str


def check(
    mesh: Mesh,
    *,
    file: Path | str | None = None,
    field: str | None = None,
    workpiece: bool = True,
    surroundings: Surroundings | None = None,
    curvature_deg: float = CURVATURE_DEG,
) -> list[Finding]:
    """Refuse a mesh that the engine would refuse or that makes no sense.

    Parameters
    ----------
    mesh : Mesh
        In metres, welded, as `read` and the makers return it.
    file, field : optional
        Where the mesh comes from, for the message.
    workpiece, surroundings, curvature_deg
        As in `findings`.

    Returns
    -------
    list of Finding
        The warnings.

    Raises
    ------
    InputError
        For the first error found.
    """
    found = findings(
        mesh, workpiece=workpiece, surroundings=surroundings, curvature_deg=curvature_deg
    )
    for finding in found:
        if finding.severity == "error":
            raise InputError(
                finding.problem,
                file=file,
                field=field,
                value=finding.value,
                limit=finding.limit,
                remedy=finding.remedy,
            )
    return found


def findings(
    mesh: Mesh,
    *,
    workpiece: bool = True,
    surroundings: Surroundings | None = None,
    curvature_deg: float = CURVATURE_DEG,
) -> list[Finding]:
    """List what is wrong with a mesh, the root causes first.

    Parameters
    ----------
    mesh : Mesh
        In metres, welded.
    workpiece : bool
        Whether the mesh is a body and must be closed with its normals out.
    surroundings : Surroundings, optional
        To see whether the size is plausible.
    curvature_deg : float
        The deck's `curvature`: no angle of a facet may be smaller, in degrees.
    """
    broken = _empty(mesh) or _not_finite(mesh)
    if broken:
        return broken
    found = _implausible_size(mesh, surroundings) if surroundings else []
    degenerate = _degenerate(mesh)
    found += degenerate + _duplicates(mesh)
    if not degenerate:
        found += _sharp_angles(mesh, curvature_deg) + _overlaps(mesh, curvature_deg)
    found += _crowded_edges(mesh)
    if workpiece:
        found += _not_a_body(mesh)
    return sorted(found, key=lambda finding: finding.severity)


def _error(problem: str, value: str, limit: str, remedy: str) -> list[Finding]:
    return [Finding("error", problem, value, limit, remedy)]


def _which(bad: NDArray[np.bool_]) -> str:
    numbers = np.flatnonzero(bad)
    shown = ", ".join(str(number) for number in numbers[:5])
    more = ", ..." if len(numbers) > 5 else ""
    return f"{len(numbers)} of {len(bad)} facets (counted from 0: {shown}{more})"


def _empty(mesh: Mesh) -> list[Finding]:
    if len(mesh.triangles):
        return []
    return _error(
        "the mesh is empty", "0 facets", "at least one facet", "export the surface as triangles"
    )


def _not_finite(mesh: Mesh) -> list[Finding]:
    bad = np.asarray(~np.isfinite(mesh.corners).all(axis=(1, 2)))
    if not bad.any():
        return []
    return _error(
        "a coordinate is not a number", _which(bad), "finite numbers", "export the mesh again"
    )


def _implausible_size(mesh: Mesh, scene: Surroundings) -> list[Finding]:
    size = float(mesh.extent.max())
    if _plausible(mesh, 1.0, scene):
        return []
    limit = (
        f"narrower than the bowl (diameter {2 * scene.bowl_radius_m:g} m), no longer than ten "
        f"bowls, no smaller than a particle's radius ({scene.particle_radius_m:g} m)"
    )
    return _error(
        "the size of the workpiece makes no sense in this bowl",
        " x ".join(f"{length:.4g}" for length in mesh.extent) + " m",
        limit,
        _unit_remedy(mesh, scene) if size > 0.0 else "export the mesh again",
    )


def _plausible(mesh: Mesh, factor: float, scene: Surroundings) -> bool:
    width, depth, height = factor * mesh.extent
    bowl_m = 2.0 * scene.bowl_radius_m
    longest = max(width, depth, height)
    narrow = max(width, depth) < bowl_m
    return bool(narrow and scene.particle_radius_m <= longest <= 10.0 * bowl_m)


def _unit_remedy(mesh: Mesh, scene: Surroundings) -> str:
    if _plausible(mesh, 1e-3, scene):
        return "check the unit: in millimetres, declared as metres?"
    if _plausible(mesh, 1e3, scene):
        return "check the unit: in metres, declared as millimetres?"
    return "check the unit that the file is declared in, or use a workpiece of another size"


def _degenerate(mesh: Mesh) -> list[Finding]:
    edges = np.linalg.norm(mesh.edge_vectors, axis=2)
    longest = edges.max(axis=1)
    height = np.divide(
        2.0 * mesh.facet_areas, longest, out=np.zeros_like(longest), where=longest > 0
    )
    repeated = (mesh.triangles == np.roll(mesh.triangles, 1, axis=1)).any(axis=1)
    bad = repeated | (height <= NODE_PRECISION_M)
    if not bad.any():
        return []
    return _error(
        "a facet has no area",
        _which(bad),
        f"higher than the engine's precision, {NODE_PRECISION_M:g} m",
        "remove degenerate facets in a mesh workpiece and export again",
    )


def _duplicates(mesh: Mesh) -> list[Finding]:
    nodes = np.sort(mesh.triangles, axis=1)
    _, first = np.unique(nodes, axis=0, return_index=True)
    bad = np.ones(len(nodes), dtype=np.bool_)
    bad[first] = False
    if not bad.any():
        return []
    return _error(
        "a facet is there twice",
        _which(bad),
        "every facet once",
        "remove duplicate facets in a mesh workpiece and export again",
    )


def _sharp_angles(mesh: Mesh, curvature_deg: float) -> list[Finding]:
    smallest = mesh.angles_deg.min(axis=1)
    error, warning = smallest <= curvature_deg, smallest <= ANGLE_WARNING_DEG
    if error.any():
        return _error(
            "the angle of a facet is too sharp for the engine",
            f"{smallest.min():.4g} degrees; {_which(error)}",
            f"above the curvature of the mesh, {curvature_deg:g} degrees",
            "remesh with better shaped triangles",
        )
    if not warning.any():
        return []
    limit = f"above {ANGLE_WARNING_DEG:g} degrees"
    value = f"{smallest.min():.4g} degrees; {_which(warning)}"
    remedy = "remesh with better shaped triangles"
    return [Finding("warning", "needle-like facets slow the engine down", value, limit, remedy)]


def _overlaps(mesh: Mesh, curvature_deg: float) -> list[Finding]:
    one, other, inward = _edge_pairs(mesh)
    flat = np.cos(np.radians(curvature_deg))
    coplanar = np.abs(np.einsum("kc,kc->k", mesh.normals[one], mesh.normals[other])) >= flat
    same_side = np.einsum("kc,kc->k", inward[:, 0], inward[:, 1]) > 0.0
    different = (np.sort(mesh.triangles[one]) != np.sort(mesh.triangles[other])).any(axis=1)
    bad = np.zeros(len(mesh.triangles), dtype=np.bool_)
    bad[one[coplanar & same_side & different]] = True
    if not bad.any():
        return []
    return _error(
        "two facets of one plane lie on top of each other",
        _which(bad),
        "facets that share an edge lie on both sides of it",
        "repair the mesh: one surface, without folds",
    )


def _edge_pairs(mesh: Mesh) -> tuple[Integers, Integers, Floats]:
    """Facets that share an edge: two (K,) arrays, and (K, 2, 3), from the edge into each."""
    edge = mesh.edge_numbers.ravel()
    order = np.argsort(edge, kind="stable")
    pair = np.flatnonzero(edge[order[1:]] == edge[order[:-1]])
    slots = np.stack([order[pair], order[pair + 1]], axis=1)
    facet, corner = slots // 3, slots % 3
    along = unit_vectors(mesh.edge_vectors[facet, corner])
    inward = mesh.corners[facet, (corner + 2) % 3] - mesh.corners[facet, corner]
    inward = inward - np.einsum("kfc,kfc->kf", inward, along)[..., None] * along
    return facet[:, 0], facet[:, 1], inward


def _crowded_edges(mesh: Mesh) -> list[Finding]:
    neighbours = mesh.neighbours
    bad = neighbours > MAX_NEIGHBOURS
    if not bad.any():
        return []
    return _error(
        "too many facets meet at the edges of one",
        f"{neighbours.max()} neighbours; {_which(bad)}",
        f"at most {MAX_NEIGHBOURS} neighbours",
        "repair the mesh: a surface has two facets at an edge",
    )


def _not_a_body(mesh: Mesh) -> list[Finding]:
    loose = int(np.count_nonzero(mesh.edge_use != 2))
    if loose:
        return _error(
            "the mesh is not closed",
            f"{loose} of {len(mesh.edge_use)} edges do not join exactly two facets",
            "a workpiece is a body: exactly two facets at every edge",
            "close the holes and remove inner walls in a mesh workpiece, then export again",
        )
    if mesh.oriented and mesh.volume > 0.0:
        return []
    value = f"enclosed volume {mesh.volume:.4g} m3" if mesh.oriented else "mixed directions"
    limit = "corners counter-clockwise, seen from outside"
    remedy = "make the normals of the mesh consistent and outward"
    problem = "the normals do not all point out of the body"
    return [Finding("warning", problem, value, limit, remedy)]

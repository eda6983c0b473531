"""Mesh the surface of a STEP part with gmsh: `python step_mesher.py`, the arguments of `main`.

A program of its own that imports nothing of the package: OpenCASCADE, which reads the part, can end
the interpreter on a damaged file. The file is opened by its STEP reader only, without gmsh's own
scripts and configuration files, and without the other files that a STEP file may refer to.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

MOST_FACETS = 200_000
"""More facets than any workpiece needs: a facet size in the wrong unit."""

FACET_AREA = 0.433
"""Area of a facet whose edges have the length 1."""

_SHARP_DEG = 30.0
"""Smallest angle between the normals of two faces at a sharp edge."""

_GROWTH = 2.0
"""Distance from a sharp edge, in facet sizes, within which the facets grow to their full size."""

EXPORT = "export the part again as STEP, as one solid; or its surface as STL"
"""What helps against a damaged file."""

NO_SOLID = "close the surfaces to a solid body in the CAD program, and export it as STEP"

_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # the same mesh every time
    "Geometry.OCCImportLabels": 0,  # its reader of names opens other files
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 8,  # facets around a full circle, at least
}
_INSTALL = (
    "./run setup cad; or pip install 'dragdeck[cad]', and on Debian apt-get install libgl1 "
    "libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1; or export the surface as STL"
)


class Meshed(TypedDict):
    """Nodes, (N, 3), facets as rows of them, (M, 3), and the volume of the part itself."""

    points: list[list[float]]
    triangles: list[list[int]]
    volume: float


class Refusal(Exception):
    """What is wrong with a part: problem, value, limit and remedy of the message."""


def main(file: str, answer: str, size: str, edge_size: str, widest: str) -> None:
    """Write the mesh, or why there is none, as JSON.

    Parameters
    ----------
    file, answer : str
        The STEP file; the file to write.
    size, edge_size : str
        Target edge length of the facets, and of those at sharp edges, mm.
    widest : str
        Width of the bowl, mm, in which a part of too many facets does not fit.
    """
    meshed: Meshed | dict[str, tuple[object, ...]]
    try:
        meshed = _mesh(_gmsh(), file, float(size), float(edge_size), float(widest))
    except Refusal as refusal:
        meshed = {"refused": refusal.args}
    Path(answer).write_text(json.dumps(meshed), encoding="ascii")


def _gmsh() -> Any:
    try:
        import gmsh
    except (ImportError, OSError) as error:
        problem = "STEP files are read with gmsh, which cannot be loaded"
        raise Refusal(problem, str(error), "gmsh 4.12 or newer", _INSTALL) from error
    return gmsh


def _mesh(gmsh: Any, file: str, size: float, edge_size: float, widest: float) -> Meshed:
    """The mesh of the only solid of a file, in mm."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        solid = _solid(gmsh, file)
        _set_sizes(gmsh, size, edge_size, widest)
        points, triangles = _surface(gmsh)
        volume = gmsh.model.occ.getMass(3, solid)
        return {"points": points, "triangles": triangles, "volume": volume}
    finally:
        gmsh.finalize()


def _solid(gmsh: Any, file: str) -> int:
    """The only solid of a file."""
    try:
        gmsh.model.occ.importShapes(file, format="step")
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise Refusal("the STEP file is damaged", str(error), "a STEP part", EXPORT) from error
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if len(solids) == 1:
        return int(solids[0])
    value = f"{len(solids)} solids, {len(gmsh.model.getEntities(2))} faces"
    limit = "one solid: the workpiece is one body"
    if not solids:
        raise Refusal("the STEP file contains no solid", value, limit, NO_SOLID)
    parts = "join them into one solid, or remove all others, then export it as STEP"
    raise Refusal("the STEP file contains several parts", value, limit, parts)


def _refuse_too_many(
    gmsh: Any, size: float, edge_size: float, widest: float, sharp: list[int]
) -> None:
    """Refuse sizes that make too many facets; beside an edge, ``1 / size^2`` is integrated."""
    area, length = (
        sum(gmsh.model.occ.getMass(dimension, entity) for entity in ones)
        for dimension, ones in ((2, [face for _, face in gmsh.model.getEntities(2)]), (1, sharp))
    )
    facets = (area / size**2 + 2 * _GROWTH * length * (1 / edge_size - 1 / size)) / FACET_AREA
    if facets > MOST_FACETS:
        low, high = np.array(gmsh.model.getBoundingBox(-1, -1)).reshape(2, 3) / 1e3
        if sorted(high - low)[1] > widest / 1e3:
            value = " x ".join(f"{length:.4g}" for length in high - low) + " m"
            limit = f"narrower than the bowl, {widest / 1e3:g} m, about one axis at least"
            remedy = "correct the unit or the size of the part, or use a wider bowl"
            raise Refusal("the part is too large for the bowl", value, limit, remedy)
        field = "facet_size_m" if edge_size >= size else "facet_size_m or edge_facet_size_m"
        remedy = f"use a larger {field}: a fifth of a particle's diameter is fine"
        limit = f"at most {MOST_FACETS}"
        raise Refusal("the mesh would have too many facets", f"about {facets:.3g}", limit, remedy)


def _set_sizes(gmsh: Any, size: float, edge_size: float, widest: float) -> None:
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    finer = edge_size < size
    sharp = [curve for _, curve in gmsh.model.getEntities(1) if finer and _is_sharp(gmsh, curve)]
    _refuse_too_many(gmsh, size, edge_size, widest, sharp)
    if not sharp:
        return
    field = gmsh.model.mesh.field
    distance, target = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "CurvesList", sharp)
    field.setNumber(distance, "Sampling", 200)
    values = {"InField": distance, "SizeMin": edge_size, "SizeMax": size, "DistMin": 0.0}
    for name, value in {**values, "DistMax": _GROWTH * size}.items():
        field.setNumber(target, name, value)
    field.setAsBackgroundMesh(target)


def _is_sharp(gmsh: Any, curve: int) -> bool:
    """Whether two faces meet at a curve at an angle, seen in its middle."""
    faces = gmsh.model.getAdjacencies(1, curve)[0]
    if len(faces) != 2:
        return False
    start, end = gmsh.model.getParametrizationBounds(1, curve)
    middle = gmsh.model.getValue(1, curve, (start + end) / 2)
    first, other = (
        gmsh.model.getNormal(face, gmsh.model.getParametrization(2, face, middle)) for face in faces
    )
    return bool(np.dot(first, other) < np.cos(np.radians(_SHARP_DEG)))


def _surface(gmsh: Any) -> tuple[list[list[float]], list[list[int]]]:
    """Nodes, (N, 3), and rows of them, (M, 3), of the meshed faces."""
    try:
        gmsh.model.mesh.generate(2)
    except Exception as error:
        remedy = "use another facet_size_m, or remove tiny faces from the part and export it again"
        raise Refusal(
            "a face of the part cannot be meshed", str(error), "a mesh of every face", remedy
        ) from error
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    _, corners = gmsh.model.mesh.getElementsByType(2)
    rows = order[np.searchsorted(tags[order], corners)]
    return coordinates.reshape(-1, 3).tolist(), rows.reshape(-1, 3).tolist()


if __name__ == "__main__":
    main(*sys.argv[1:])

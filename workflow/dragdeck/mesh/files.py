"""Mesh files: a user's in many formats, the engine's in one."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError
from dragdeck.mesh import remesher, step_mesher
from dragdeck.mesh.deviation import deviation
from dragdeck.mesh.mesher import answer_of
from dragdeck.mesh.obj import obj
from dragdeck.mesh.ply import ply
from dragdeck.mesh.polygons import Polygons, no_polygons
from dragdeck.mesh.step import step_text
from dragdeck.mesh.stl import stl
from dragdeck.mesh.surface import (
    CAD_VOLUME,
    MERGED,
    REMESHED,
    Floats,
    Integers,
    are_lengths,
    facing_out,
    obtuse_third,
    surface,
    weld,
)
from dragdeck.mesh.vtk_legacy import vtk_legacy

if TYPE_CHECKING:
    from trimesh import Trimesh

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
"""Length units that a mesh file may be declared in, in metres."""

_MOST_FACETS = 500_000
"""Of a surface file: checks of more take too long, and so does meshing them anew."""

STEP = (".step", ".stp")
"""Suffixes of CAD parts, which are meshed here."""


def read(
    path: Path | str,
    unit: str | None,
    facet_size_m: float | None = None,
    edge_facet_size_m: float | None = None,
    widest_m: float = math.inf,
) -> Trimesh:
    """Read a surface from STL (ASCII or binary), OBJ, PLY, legacy VTK or VTU, or mesh a STEP part.

    Modules here read all but VTU, which meshio reads. gmsh meshes STEP; MMG meshes a closed surface
    anew for which a facet size is given.

    Parameters
    ----------
    path : Path or str
        The file; its suffix tells the format.
    unit : str, optional
        What one is in the file: a key of `UNITS`; none: the unit that a STEP file states.
    facet_size_m, edge_facet_size_m : float, optional
        Target edge length of the facets, and of those at sharp edges of a STEP part, in metres.
    widest_m : float, optional
        Width of the bowl, m, for the message on a part with too many facets.

    Returns
    -------
    Trimesh
        In metres, welded, where the file puts it. Its metadata have the nodes that were merged
        (`MERGED`), the volume of a part that was meshed here (`CAD_VOLUME`, m3) and the `Deviation`
        of a surface that was meshed anew (`REMESHED`), for `findings`.

    Raises
    ------
    InputError
        If the unit or the format is unknown, the file is missing or damaged,
        or holds cells that are no surface.
    """
    path = Path(path)
    step = path.suffix.lower() in STEP
    if unit not in UNITS and not (step and unit is None):
        raise InputError(
            "unknown length unit", file=path, field="unit", value=unit, limit=", ".join(UNITS)
        )
    if step:
        return _read_step(path, unit, facet_size_m, edge_facet_size_m, widest_m)
    assert unit is not None
    with _damage(path):
        points, cells = _polygons(path)
        triangles = [_triangles(nodes, points) for nodes in cells]
        joined = np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles])
        if len(joined) > _MOST_FACETS:
            raise InputError(
                "the mesh has too many facets",
                value=f"{len(joined)}",
                limit=f"at most {_MOST_FACETS}",
                remedy="reduce them in the program that made it, or in MeshLab: Simplification",
            )
        points = points * UNITS[unit]
        endless = np.asarray(~are_lengths(points).all(axis=1))
        if endless.any() and (bad := joined[endless[joined]]).size:
            value = f"node {bad[0] + 1} of {len(points)}: {' '.join(map(str, points[bad[0]]))}"
            limit = "finite numbers, at most 1e100 m"
            raise InputError("a coordinate is not a length", value=value, limit=limit)
        body = surface(points, joined)
        mesh = weld(body)
    if path.suffix.lower() != ".stl":  # each facet of an STL file has nodes of its own
        mesh.metadata[MERGED] = int(body.referenced_vertices.sum()) - len(mesh.vertices)
    if facet_size_m is None:
        return mesh
    return _meshed_anew(mesh, facet_size_m, path)


def _meshed_anew(mesh: Trimesh, size_m: float, path: Path) -> Trimesh:
    """A closed surface with facets of a size; one that is open or has one side only as it is.

    Raises
    ------
    InputError
        mmgpy is missing, the facets would be too many, or MMG cannot mesh the surface.
    """
    given = facing_out(mesh) if len(mesh.faces) and mesh.is_watertight else None
    if given is None:
        return mesh
    count = given.area / (step_mesher.FACET_AREA * size_m**2)
    if count > step_mesher.MOST_FACETS:
        raise InputError(
            "the mesh would have too many facets",
            file=path,
            value=f"about {count:.3g}",
            limit=f"at most {step_mesher.MOST_FACETS}",
            remedy="use a larger facet_size_m: a fifth of a particle's diameter is fine",
        )
    content = {"points": (given.vertices / size_m).tolist(), "triangles": given.faces.tolist()}
    meshed = answer_of(remesher.__file__, path, json.dumps(content), [1.0])
    made = weld(surface(size_m * np.array(meshed["points"]), meshed["triangles"]))
    made.metadata.update({REMESHED: deviation(given, made), CAD_VOLUME: given.volume})
    return made


def _read_step(
    path: Path, unit: str | None, size_m: float | None, edge_size_m: float | None, widest_m: float
) -> Trimesh:
    """Mesh the surface of the part in a STEP file; the same file gives the same mesh."""
    assert size_m is not None, "a study with a STEP part states the size of its facets"
    _refuse_missing(path)
    text = step_text(path, None if unit is None else UNITS[unit])
    lengths_mm = [1e3 * length_m for length_m in (size_m, edge_size_m or size_m, widest_m)]
    meshed = answer_of(step_mesher.__file__, path, text, lengths_mm)
    mesh = weld(surface(1e-3 * np.array(meshed["points"]), meshed["triangles"]))
    mesh.metadata[CAD_VOLUME] = 1e-9 * meshed["volume"]
    return mesh


def _refuse_missing(path: Path) -> None:
    if not path.is_file():
        raise InputError("there is no such mesh file", file=path)


def _polygons(path: Path) -> Polygons:
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(
            "unknown mesh format",
            file=path,
            value=path.suffix or "no suffix",
            limit=", ".join(FORMATS),
            remedy="export the surface as STL, in ParaView by File, Save Data",
        )
    _refuse_missing(path)
    return _READERS[suffix](path)


def _vtu(path: Path) -> Polygons:
    """Read VTU; meshio's own `read` ends the interpreter on bad files."""
    import meshio

    data = path.read_bytes()
    if not data.rstrip().endswith(b"</VTKFile>"):
        raise InputError("the file was cut short", limit='"</VTKFile>" at its end')
    if b"vtkLZ4DataCompressor" in data:
        raise InputError("the file is compressed with LZ4", limit="zlib, LZMA or no compression")
    content = meshio.vtu.read(path)
    blocks = [block for block in content.cells if block.type not in ("vertex", "line")]
    for block in blocks:
        if block.type not in ("triangle", "quad", "polygon"):
            raise no_polygons(len(block.data), block.type)
    points = np.asarray(content.points, dtype=np.float64).reshape(len(content.points), 3)
    return Polygons(points, [np.asarray(block.data, dtype=np.int64) for block in blocks])


def _bytes(read: Callable[[bytes], Polygons]) -> Callable[[Path], Polygons]:
    return lambda path: read(path.read_bytes())


_READERS: Mapping[str, Callable[[Path], Polygons]] = {
    ".stl": _bytes(stl),
    ".obj": _bytes(obj),
    ".ply": _bytes(ply),
    ".vtk": _bytes(vtk_legacy),
    ".vtu": _vtu,
}


FORMATS = (*_READERS, *STEP)
"""Suffixes of all files that are read."""


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """What is wrong in a file as an error for the user: meshio lets any error out."""
    try:
        yield
    except InputError as error:
        error.file, error.remedy = path, error.remedy or "export the surface again, as STL"
        raise
    except Exception as error:
        raise InputError(
            f"the mesh file is damaged, or a variant of {path.suffix[1:].upper()} not read here",
            file=path,
            value=str(error).strip() or type(error).__name__,
            remedy="export it again, as STL",
        ) from error


def _triangles(nodes: Integers, points: Floats) -> Integers:
    """(K, 3): polygons as triangles, quadrilaterals along a diagonal."""
    corners = nodes.shape[1]
    if corners == 3:
        return nodes
    if corners == 4:
        return _split(nodes, points)
    import pyvista

    polygons = pyvista.PolyData.from_regular_faces(points, nodes.tolist())
    divided = polygons.triangulate()  # it leaves out what it cannot divide
    if divided.n_cells < len(nodes) * (corners - 2) and not math.isclose(
        divided.area, _flat_area(points[nodes]), rel_tol=1e-6
    ):
        raise InputError(
            "a polygon cannot be divided into triangles",
            value=f"one of {len(nodes)} with {corners} corners",
            limit="flat polygons that do not cross themselves",
            remedy="export triangles alone",
        )
    return np.asarray(divided.regular_faces, dtype=np.int64)


def _flat_area(corners: Floats) -> float:
    """Area of flat polygons, (M, k, 3), bent inwards or not."""
    since = corners - corners[:, :1]
    return float(
        np.linalg.norm(np.cross(since[:, :-1], since[:, 1:]).sum(axis=1), axis=1).sum() / 2
    )


def _split(quads: Integers, points: Floats) -> Integers:
    """Along the shorter diagonal, or at the corner that is bent inwards."""
    corners = points[quads]
    diagonal = np.linalg.norm(corners[:, :2] - corners[:, 2:], axis=2)
    shorter = np.where(diagonal[:, 0] <= diagonal[:, 1], 0, 1)
    folded = [_is_folded(np.roll(corners, -turn, axis=1)) for turn in (0, 1)]
    first = np.where(folded[0] == folded[1], shorter, np.where(folded[0], 1, 0))
    turned = np.where(first[:, None] == 0, quads, np.roll(quads, -1, axis=1))
    return turned[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def _is_folded(corners: Floats) -> NDArray[np.bool_]:
    """(M,): whether quadrilaterals, (M, 4, 3), fold over along their first diagonal."""
    first, diagonal, last = (corners[:, corner] - corners[:, 0] for corner in (1, 2, 3))
    sides = np.cross(first, diagonal), np.cross(diagonal, last)
    return np.asarray(np.einsum("kc,kc->k", *sides) < 0)


def stl_text(mesh: Trimesh) -> str:
    """Return the ASCII STL text of a mesh in metres, as the engine reads it.

    Nine digits keep nodes apart that the engine keeps apart. The same mesh gives the same bytes.
    The corners of a facet with an obtuse one are turned, so that this is the third: LIGGGHTS
    overlooks contacts beside any other (docs/development/liggghts.md). Angles are those of the
    numbers as written.
    """
    words = np.char.mod("%.9g", mesh.vertices + 0.0)  # + 0.0 turns -0 into 0
    lines = np.array([f"vertex {x} {y} {z}\n" for x, y, z in words.tolist()])
    corners = obtuse_third(words.astype(np.float64), mesh.faces)
    normals = np.round(mesh.face_normals, 9) + 0.0
    facets = [
        "facet normal {:.9g} {:.9g} {:.9g}\nouter loop\n".format(*normal)
        + "".join(facet)
        + "endloop\nendfacet\n"
        for normal, facet in zip(normals.tolist(), lines[corners].tolist(), strict=True)
    ]
    return "solid mesh\n" + "".join(facets) + "endsolid mesh\n"

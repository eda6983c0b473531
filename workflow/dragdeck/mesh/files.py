"""Mesh files: a user's in many formats, the engine's in one."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dragdeck.errors import InputError
from dragdeck.mesh.surface import Floats, Integers, Mesh, weld

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
"""Length units that a mesh file may be declared in, in metres."""


def read(path: Path | str, unit: str) -> Mesh:
    """Read a surface from STL (ASCII or binary), OBJ, PLY or legacy VTK.

    Quadrilaterals are cut along their shorter diagonal. VTK polygon data is
    refused: meshio does not know it, and VTK's own reader fills a file that
    was cut short with whatever the memory holds.

    Parameters
    ----------
    path : Path or str
        The file; its suffix tells the format.
    unit : str
        What one is in the file: a key of `UNITS`.

    Returns
    -------
    Mesh
        In metres, welded, where the file puts it.

    Raises
    ------
    InputError
        If the unit or the format is unknown, the file is missing or damaged,
        or holds cells that are no surface.
    """
    path = Path(path)
    if unit not in UNITS:
        raise InputError(
            "unknown length unit", file=path, field="unit", value=unit, limit=", ".join(UNITS)
        )
    content = _load(path)
    points = np.asarray(content.points, dtype=np.float64)
    if points.size and points.shape[1] != 3:
        raise InputError("a surface in space needs three coordinates a node", file=path)
    triangles = [_triangles(block.type, block.data, points, path) for block in content.cells]
    joined = np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles])
    return weld(Mesh(points * UNITS[unit], joined))


def _load(path: Path) -> Any:
    read_format = _readers().get(path.suffix.lower())
    if read_format is None:
        raise InputError(
            "unknown mesh format",
            file=path,
            value=path.suffix or "no suffix",
            limit=", ".join(_readers()),
            remedy="export the surface as STL",
        )
    if not path.is_file():
        raise InputError("there is no such mesh file", file=path)
    try:
        with np.errstate(over="ignore"):  # meshio multiplies 32-bit numbers to spot a binary STL
            return read_format(path)
    except Exception as error:  # meshio lets any parser error out
        raise InputError(
            f"the mesh file is damaged, or not the {path.suffix.lower()[1:].upper()} that is read",
            file=path,
            value=str(error).strip() or type(error).__name__,
            remedy="export it again; VTK polygon data as STL or as an unstructured grid",
        ) from error


def _readers() -> dict[str, Callable[[Path], Any]]:
    """Return meshio's readers by suffix; its general one ends the interpreter on bad files."""
    import meshio

    return {
        ".stl": _read_stl,
        ".obj": meshio.obj.read,
        ".ply": _read_ply,
        ".vtk": meshio.vtk.read,
    }


def _read_stl(path: Path) -> Any:
    """Read STL; meshio takes a text file that was cut off after its last corner."""
    import meshio

    content = path.read_bytes()
    facets = int.from_bytes(content[80:84], "little")
    is_text = content.lstrip().startswith(b"solid") and len(content) != 84 + 50 * facets
    if is_text and not content.rstrip().splitlines()[-1].strip().startswith(b"endsolid"):
        raise meshio.ReadError("the last line is not 'endsolid'")
    return meshio.stl.read(path)


def _read_ply(path: Path) -> Any:
    """Read PLY; without the end of its header, meshio would search for it for ever."""
    import meshio

    if b"end_header" not in path.read_bytes():
        raise meshio.ReadError("the header has no end")
    return meshio.ply.read(path)


def _triangles(kind: str, cells: ArrayLike, points: Floats, path: Path) -> Integers:
    if kind in {"vertex", "line"}:
        return np.empty((0, 3), dtype=np.int64)
    nodes = np.asarray(cells, dtype=np.int64)
    if kind == "triangle":
        return nodes
    if kind == "quad":
        return _split(nodes, points)
    raise InputError(
        "the mesh holds cells that are neither triangles nor quadrilaterals",
        file=path,
        value=f"{len(nodes)} of type {kind}",
        limit="triangles or quadrilaterals",
        remedy="export the surface as triangles",
    )


def _split(quads: Integers, points: Floats) -> Integers:
    diagonal = np.linalg.norm(points[quads[:, :2]] - points[quads[:, 2:]], axis=2)
    turned = np.where(diagonal[:, [0]] <= diagonal[:, [1]], quads, np.roll(quads, -1, axis=1))
    return turned[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def write_stl(mesh: Mesh, path: Path | str) -> None:
    """Write an ASCII STL file in metres, as the engine reads it.

    Nine digits keep nodes apart that the engine keeps apart. The same mesh
    gives the same bytes, and the file appears whole or not at all.

    Parameters
    ----------
    mesh : Mesh
        In metres.
    path : Path or str
        The file; an existing one is replaced.
    """
    path = Path(path)
    descriptor, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "w", encoding="ascii", newline="\n") as stream:
            stream.write(stl_text(mesh))
        os.chmod(draft, 0o644)
        os.replace(draft, path)
    except BaseException:
        os.unlink(draft)
        raise


def stl_text(mesh: Mesh, factor: float = 1.0) -> str:
    """Return the ASCII STL text of a mesh, its coordinates times `factor`."""
    corners = factor * mesh.corners + 0.0  # + 0.0 turns -0 into 0
    normals = np.round(mesh.normals, 9) + 0.0
    facets = [
        "facet normal {:.9g} {:.9g} {:.9g}\nouter loop\n".format(*normal)
        + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in facet)
        + "endloop\nendfacet\n"
        for normal, facet in zip(normals.tolist(), corners.tolist(), strict=True)
    ]
    return "solid mesh\n" + "".join(facets) + "endsolid mesh\n"

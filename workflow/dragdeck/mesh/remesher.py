"""Mesh a closed surface anew with MMG: `python remesher.py`, the arguments of `main`.

A program of its own that imports nothing of the package: MMG can end the interpreter.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

_SHARP_DEG = 30.0, 45.0, 60.0
"""Angles between normals from which an edge is kept: the first with facets that are no needles."""

_GOOD_DEG = 1.0
"""Smallest angle of facets that are no needles."""

_OFF, _SHORTEST, _LONGEST, _GROWTH = 0.1, 0.25, 1.3, 2.0
"""In facet sizes: distance from the given surface that MMG aims at, shortest and longest edge; and
ratio of neighbouring edges."""

_INSTALL = "./run setup cad; or pip install 'dragdeck[cad]'; or mesh the part anew in its program"

OTHERWISE = "use another facet_size_m, or mesh the part anew in the program that made it"
"""What helps where MMG cannot."""


def main(given: str, answer: str, size: str) -> None:
    """Write nodes and facets of the new mesh, or why there is none, as JSON.

    Parameters
    ----------
    given, answer : str
        The file with `points`, (N, 3), and `triangles`, (M, 3), and the file to write.
    size : str
        Target edge length of the facets.
    """
    content = json.loads(Path(given).read_text(encoding="ascii"))
    points, triangles = np.array(content["points"]), np.array(content["triangles"], dtype=np.int32)
    meshed: dict[str, object]
    try:
        import mmgpy

        nodes, facets = _best(mmgpy, points, triangles, float(size))
        meshed = {"points": nodes.tolist(), "triangles": facets.tolist()}
    except (ImportError, OSError) as error:
        problem = "meshes are made anew with mmgpy, which cannot be loaded"
        meshed = {"refused": [problem, str(error), "mmgpy 0.17 or newer", _INSTALL]}
    except Exception as error:
        problem, limit = "the surface cannot be meshed anew", "one closed surface without folds"
        meshed = {"refused": [problem, str(error), limit, OTHERWISE]}
    Path(answer).write_text(json.dumps(meshed), encoding="ascii")


def _best(mmgpy: Any, points: Any, triangles: Any, size: float) -> tuple[Any, Any]:
    """Nodes and facets with the largest smallest angle; a good one ends the search."""
    meshes = []
    for sharp in _SHARP_DEG:
        mesh = mmgpy.MmgMeshS(points, triangles)
        mesh.remesh(
            hmin=_SHORTEST * size,
            hmax=_LONGEST * size,
            hausd=_OFF * size,
            hgrad=_GROWTH,
            ar=sharp,
            verbose=-1,
        )
        nodes, facets = mesh.get_vertices(), mesh.get_triangles()
        meshes.append((_smallest_angle(nodes, facets), nodes, facets))
        if meshes[-1][0] >= np.radians(_GOOD_DEG):
            break
    return max(meshes, key=lambda mesh: mesh[0])[1:]


def _smallest_angle(nodes: Any, facets: Any) -> float:
    """Smallest angle of all facets, rad."""
    corners = nodes[facets]
    after, before = (np.roll(corners, shift, axis=1) - corners for shift in (-1, 1))
    across = np.linalg.norm(np.cross(after, before), axis=2)
    return float(np.arctan2(across, (after * before).sum(axis=2)).min())


if __name__ == "__main__":
    main(*sys.argv[1:])

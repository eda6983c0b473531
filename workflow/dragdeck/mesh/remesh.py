"""Closed surfaces meshed anew with facets of another size, and how far they are from the given."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dragdeck.errors import InputError
from dragdeck.mesh import remesher
from dragdeck.mesh.mesher import MOST_FACETS, answer_of
from dragdeck.mesh.surface import Floats, facing_out, surface, weld

if TYPE_CHECKING:
    from trimesh import Trimesh

_AREA = 0.433
"""Of a facet with edges of length 1."""


class Deviation(NamedTuple):
    """What a surface differs by from that of its file.

    Parameters
    ----------
    facets : int
        Number in the file.
    distance_m : float
        Largest distance of a node or the centre of a facet from the other surface, m.
    volume, area : float
        Relative differences.
    """

    facets: int
    distance_m: float
    volume: float
    area: float

    def __str__(self) -> str:
        """In words."""
        return (
            f"meshed anew from {self.facets:,} facets: at most {1e3 * self.distance_m:.2g} mm from "
            f"the surface in the file, volume {100 * self.volume:+.2g} %, area "
            f"{100 * self.area:+.2g} %"
        )


def remeshed(mesh: Trimesh, size_m: float, file: Path) -> tuple[Trimesh, Deviation | None]:
    """Mesh a closed surface anew, its sharp edges kept, in a process of its own.

    The same surface gives the same mesh with the same version of MMG.

    Parameters
    ----------
    mesh : Trimesh
        In m, welded. One that is not closed, or has one side only, is returned as it is.
    size_m : float
        Target edge length of the facets.
    file : Path
        For messages.

    Raises
    ------
    InputError
        mmgpy is missing, the facets would be too many, or MMG cannot mesh the surface.
    """
    given = facing_out(mesh) if len(mesh.faces) and mesh.is_watertight else None
    if given is None:
        return mesh, None
    count = given.area / (_AREA * size_m**2)
    if count > MOST_FACETS:
        raise InputError(
            "the mesh would have too many facets",
            file=file,
            value=f"about {count:.3g}",
            limit=f"at most {MOST_FACETS}",
            remedy="use a larger facet_size_m: a fifth of a particle's diameter is fine",
        )
    with TemporaryDirectory() as folder:
        source = Path(folder, "given.json")
        content = {"points": (given.vertices / size_m).tolist(), "triangles": given.faces.tolist()}
        source.write_text(json.dumps(content), encoding="ascii")
        answer = answer_of(remesher.__file__, file, [str(source)], ["1.0"])
    made = weld(surface(size_m * np.array(answer["points"]), answer["triangles"]))
    return made, _deviation(given, made)


def _deviation(given: Trimesh, made: Trimesh) -> Deviation:
    there = _distance(np.concatenate([made.vertices, made.triangles_center]), given)
    back = _distance(np.asarray(given.vertices), made)
    return Deviation(
        len(given.faces),
        max(there, back),
        made.volume / given.volume - 1.0,
        made.area / given.area - 1.0,
    )


def _distance(points: Floats, mesh: Trimesh) -> float:
    """Largest distance of points, (N, 3), from a surface, in units of both."""
    import pyvista

    size = float(np.abs(mesh.extents).max())  # VTK's tolerances are those of lengths about 1
    other = pyvista.PolyData.from_regular_faces(mesh.vertices / size, mesh.faces)
    cloud = pyvista.PolyData(points / size).compute_implicit_distance(other)
    return size * float(np.abs(cloud["implicit_distance"]).max())

"""The inside of a bowl from a mesh file: open at a level rim, closed below it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.errors import InputError
from dragdeck.mesh.checks import check
from dragdeck.mesh.files import STEP, UNITS, read
from dragdeck.mesh.surface import Floats, facing_up, open_edges, surface

if TYPE_CHECKING:
    from trimesh import Trimesh

MOST_FACETS = 5000
"""Every step looks for contacts with all of them, and ``case.json`` contains them."""

_LEVEL = 1e-4
"""By how much the rim may be uneven, over the height of the bowl."""

_DIGITS = 9
"""Of coordinates, in decimals of a metre."""


def bowl_facets(file: Path, unit: str | None) -> Floats:
    """Corners of the facets of a bowl, (F, 3, 3) in m, which face inwards; its lowest z is 0.

    Raises
    ------
    InputError
        The file cannot be read or LIGGGHTS does not accept it; the bowl is not closed at the
        bottom, has no open top or no level rim.
    """
    field = "bowl.file"
    if file.suffix.lower() in STEP:
        problem, limit = "a bowl cannot be read from a STEP file", "STL, OBJ, PLY or VTK"
        remedy = "export its inner surface alone as STL, from the floor to the rim"
        raise InputError(problem, file=file, field=field, limit=limit, remedy=remedy)
    if unit not in UNITS:
        problem = f"{file.name} states no unit" if unit is None else f"unknown unit {unit!r}"
        raise InputError(problem, file=file, field="bowl.unit", limit=", ".join(UNITS))
    mesh = read(file, unit)
    check(mesh, file=file, field=field, workpiece=False)
    if len(mesh.faces) > MOST_FACETS:
        raise InputError(
            "the bowl has too many facets", file=file, field=field, value=len(mesh.faces),
            limit=f"at most {MOST_FACETS}",
            remedy="export it with coarser facets: those of a few particle diameters are fine",
        )  # fmt: skip
    points = mesh.vertices - [0.0, 0.0, mesh.bounds[0, 2]]
    bowl = surface(np.round(points, _DIGITS), mesh.faces)
    _refuse_holes(bowl, file, field)
    facing = facing_up(bowl)
    if facing is None:
        raise InputError("the surface of the bowl has one side only", file=file, field=field)
    return np.asarray(facing.triangles, dtype=np.float64)


def _refuse_holes(bowl: Trimesh, file: Path, field: str) -> None:
    edges, height = open_edges(bowl.faces), float(bowl.bounds[1, 2])
    if not len(edges):
        raise InputError(
            "the bowl has no open top: its surface is closed", file=file, field=field,
            remedy="export its inner surface alone, from the floor to the rim",
        )  # fmt: skip
    lowest = float(bowl.vertices[edges][:, :, 2].min())
    if lowest < (1 - _LEVEL) * height:
        raise InputError(
            "the bowl is not closed at the bottom, or its rim is not level", file=file, field=field,
            value=f"an open edge {lowest:.4g} m above its lowest point",
            limit=f"open edges only at the rim, {height:.4g} m",
            remedy="close the holes, or cut the bowl level at its rim",
        )  # fmt: skip

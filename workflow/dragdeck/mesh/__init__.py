"""Triangle surfaces for the engine: made, read, checked, placed and written.

Everything inside is in metres. A *workpiece* stands upright: +z points along its
axis, away from the floor, and its reference point, the origin, is the middle
of its bounding box in x and y, or the given clamping axis, at its lowest z.
`cylinder` makes meshes that stand so; `upright` and `place` move a user's mesh
there.
"""

from dragdeck.mesh.checks import Finding, Surroundings, check, findings
from dragdeck.mesh.files import UNITS, read, stl_text, write_stl
from dragdeck.mesh.shapes import (
    bowl,
    cylinder,
    cylinder_facets,
    cylinder_radius,
    polygon_radius,
    polygon_sides,
    prism,
)
from dragdeck.mesh.surface import (
    facing_out,
    outer_radius,
    place,
    points_below,
    surface,
    tilted,
    upright,
    weld,
)

__all__ = [
    "UNITS",
    "Finding",
    "Surroundings",
    "bowl",
    "check",
    "cylinder",
    "cylinder_facets",
    "cylinder_radius",
    "facing_out",
    "findings",
    "outer_radius",
    "place",
    "points_below",
    "polygon_radius",
    "polygon_sides",
    "prism",
    "read",
    "stl_text",
    "surface",
    "tilted",
    "upright",
    "weld",
    "write_stl",
]

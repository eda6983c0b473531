"""Triangle surfaces for the engine: made, read, checked, placed and written.

Everything inside is in metres. A *workpiece* stands upright: +z points along its
axis, away from the floor, and its reference point, the origin, is the middle
of its bounding box in x and y at its lowest z. `cylinder` makes meshes that
stand so; `place` moves a user's mesh there.
"""

from dragdeck.mesh.checks import Finding, Surroundings, check, findings
from dragdeck.mesh.files import UNITS, read, stl_text, write_stl
from dragdeck.mesh.shapes import bowl, cylinder, polygon_radius, polygon_sides, prism
from dragdeck.mesh.surface import Envelope, envelope, facing_out, place, surface, weld

__all__ = [
    "UNITS",
    "Envelope",
    "Finding",
    "Surroundings",
    "bowl",
    "check",
    "cylinder",
    "envelope",
    "facing_out",
    "findings",
    "place",
    "polygon_radius",
    "polygon_sides",
    "prism",
    "read",
    "stl_text",
    "surface",
    "weld",
    "write_stl",
]

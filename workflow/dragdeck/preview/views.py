"""From where a layout is seen, and in which colours: the same in the picture and on the page."""

import json
import math
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

COLOURS: dict[str, str] = json.loads(
    resources.files("dragdeck").joinpath("data/colours.json").read_text(encoding="utf-8")
)
"""Those of all figures, of which ``data/colours.json`` is a copy."""


@dataclass(frozen=True)
class View:
    """A parallel projection: what points right and up in it, as unit vectors."""

    title: str
    right: Floats
    up: Floats
    across: str
    along: str

    @property
    def basis(self) -> Floats:
        """(3, 3): right, up, and towards the viewer."""
        return np.array([self.right, self.up, np.cross(self.right, self.up)])


def views(direction_rad: float) -> list[View]:
    """From above, along the motion at the start of the drag, from its right, and obliquely."""
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    x, y, z = np.eye(3)
    ahead, beside = np.array([c, s, 0.0]), np.array([s, -c, 0.0])
    right, back = (beside + ahead) / math.sqrt(2), (beside - ahead) / math.sqrt(2)
    low = math.radians(28)
    return [
        View("From above", x, y, "x (mm)", "y (mm)"),
        View("In the direction of motion", beside, z, "to the right of the axis (mm)", "z (mm)"),
        View("From the right of the motion", ahead, z, "along the motion (mm)", "z (mm)"),
        View("Oblique", right, math.cos(low) * z - math.sin(low) * back, "", ""),
    ]

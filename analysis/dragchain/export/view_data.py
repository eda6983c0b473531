"""What the script `view` needs to know of an export: ``view.json`` beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.run.case import Case
from dragchain.run.kinematics import needed
from dragdeck.documents import Document

SCRIPT = "view.py"
DATA = "view.json"

SCALED = {
    "v": 0.99, "max_normal_force_n": 0.99, "normal_force_n": 0.999, "mean_pressure_pa": 0.99
}  # fmt: skip
"""Arrays that colour a view, and the fraction of a frame that the scale of each covers."""


class View(Document):
    """What the view of an export shows: flags and numbers only.

    Attributes
    ----------
    chains : bool
        Whether particles and contacts have the arrays of chains.
    bowl_radius_m, bowl_height_m, particle_radius_m : float
        Inner sizes of the bowl and mean radius of the particles, m.
    upper : mapping of str to float
        Upper end of the colour scale of each array that there is, in the array's unit.
    """

    remedy = "make it with: dragchain export"

    chains: bool
    bowl_radius_m: float
    bowl_height_m: float
    particle_radius_m: float
    upper: Mapping[str, float]


class ViewWriter:
    """Collects the colour scales frame by frame, and writes script and data at the end."""

    def __init__(self, case: Case, *, chains: bool) -> None:
        self._case = case
        self._chains = chains
        self._upper: dict[str, list[float]] = {}

    def add(self, parts: Mapping[str, Any]) -> None:
        """Take the meshes of one frame into account."""
        for mesh in parts.values():
            for name in (name for name in SCALED if name in mesh.array_names and mesh.n_points):
                values = mesh[name]
                sizes = np.linalg.norm(values, axis=1) if values.ndim > 1 else values
                found = float(np.quantile(sizes, SCALED[name]))
                self._upper.setdefault(name, []).append(found)

    def write(self, folder: Path) -> None:
        """Write ``view.py`` and ``view.json``; a scale ends at the median over the frames."""
        bowl = needed(self._case.bowl, "bowl")
        height_m = self._case.inputs.get("bowl.height_m")
        View(
            chains=self._chains,
            bowl_radius_m=bowl.radius_m,
            bowl_height_m=height_m if isinstance(height_m, int | float) else 2 * bowl.radius_m,
            particle_radius_m=self._case.media.radius_mean_m,
            upper={name: float(np.median(found)) for name, found in self._upper.items()},
        ).write(folder / DATA)
        (folder / SCRIPT).write_bytes(Path(__file__).with_name(SCRIPT).read_bytes())

"""Definitions of the dominant chain, each with its thresholds.

- ``widest_path``: as in `dragchain.network.chains`, from a strong workpiece contact through strong
  contacts to the bowl; the workpiece contact counts in the bottleneck.
- ``free_path``: the same search in which the forces on the workpiece play no part, neither in the
  choice of the path nor in its bottleneck nor in the mean: from any particle that the workpiece
  pushes.
- ``peters``: a chain by Peters et al. (2005) with a particle on the workpiece and one on the bowl.
- ``peters_workpiece``: such a chain with a particle on the workpiece, wherever it ends.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dragchain.network.chains import ALPHA_RAD, STRESS_FACTOR, THRESHOLD

FORCE_FACTORS = (0.5, 1.0, 1.5, 2.0, 10.0)
"""Times the mean normal force. Up to 2 a path is there almost always; at 10 only at times."""

_ANGLES_DEG = (30.0, 45.0, 60.0)
_STRESS_FACTORS = (0.5, 1.0, 1.5, 6.0)
"""Times the mean stress: 6 for the same reason."""

Definition = Literal["widest_path", "free_path", "peters", "peters_workpiece"]

DEFINITIONS: dict[Definition, str] = {
    "widest_path": "path from workpiece to bowl",
    "free_path": "path, forces on the workpiece left out",
    "peters": "Peters' chain on workpiece and bowl",
    "peters_workpiece": "Peters' chain on the workpiece",
}
"""Their names in figures and on the page."""


@dataclass(frozen=True)
class Setting:
    """A definition of the dominant chain with its thresholds.

    Attributes
    ----------
    definition : str
        One of `DEFINITIONS`.
    force_factor : float
        Least normal force of a path's contacts over the frame's mean; NaN for Peters' chains.
    alpha_rad, stress_factor : float
        Angle and stress of Peters' chains; NaN for paths.
    """

    definition: Definition
    force_factor: float = np.nan
    alpha_rad: float = np.nan
    stress_factor: float = np.nan

    @property
    def is_path(self) -> bool:
        """Whether it is a path from workpiece to bowl, not a chain by Peters et al."""
        return self.definition in ("widest_path", "free_path")

    @property
    def label(self) -> str:
        """The thresholds in words."""
        if self.is_path:
            return f"force {self.force_factor:g} x mean"
        return f"{np.degrees(self.alpha_rad):.0f}°, stress {self.stress_factor:g} x mean"

    @property
    def default(self) -> bool:
        """Whether the thresholds are those of `dragchain.network.chains`."""
        if self.is_path:
            return self.force_factor == THRESHOLD
        return (self.alpha_rad, self.stress_factor) == (ALPHA_RAD, STRESS_FACTOR)


def _settings() -> tuple[Setting, ...]:
    """One threshold is varied at a time."""
    angles = [(float(np.radians(angle)), STRESS_FACTOR) for angle in _ANGLES_DEG]
    stresses = [(ALPHA_RAD, factor) for factor in _STRESS_FACTORS if factor != STRESS_FACTOR]
    paths: tuple[Definition, ...] = ("widest_path", "free_path")
    chains: tuple[Definition, ...] = ("peters", "peters_workpiece")
    return (
        *(Setting(name, force_factor=factor) for name in paths for factor in FORCE_FACTORS),
        *(Setting(name, np.nan, *limits) for name in chains for limits in (*angles, *stresses)),
    )


SETTINGS = _settings()

DEFAULTS = {setting.definition: at for at, setting in enumerate(SETTINGS) if setting.default}
"""Place in `SETTINGS` of each definition at its default thresholds."""

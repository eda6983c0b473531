"""What is measured of a run of the map, and what is made of it beside its reference."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

from dragchain.stability.points import PointRun
from dragchain.statistics.estimate import Estimate
from dragchain.tables.run_folder import Run

NORMAL_95 = 1.96
"""Half a 95 % interval in standard errors, as the published map was classified with."""

COLUMNS = (
    "restitution_mean",
    "restitution_low",
    "restitution_high",
    "peak_force_n",
    "height_m",
    "peak_energy_j",
    "rest_energy_ratio",
    "drag_mean_n",
    "drag_se_n",
    "energy_after_over_before",
    "frequency_rad_s",
)
"""Columns of the table of points with what was measured; each regime has some of them."""


@dataclass(frozen=True, kw_only=True)
class Measured(ABC):
    """What a run of one regime showed.

    Attributes
    ----------
    overlap_ratio : float
        Largest overlap over the radius.
    frequency_rad_s : float
        Largest eigenfrequency of the contact network.
    """

    overlap_ratio: float
    frequency_rad_s: float

    @abstractmethod
    def energy_ratio(self, reference: Self | None) -> float | None:
        """Ratio of energies that `ENERGY_LIMITS` is for; None where the reference is needed."""

    @abstractmethod
    def errors(self, reference: Self) -> Mapping[str, Estimate]:
        """Deviations from the reference, by the quantity's name."""

    def columns(self) -> dict[str, float]:
        """What the table of points has of it."""
        return {name: value for name, value in vars(self).items() if name in COLUMNS}


Measure = Callable[[PointRun, Run], Measured]
"""Measures a run that came to its end."""

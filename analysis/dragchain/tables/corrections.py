"""How far the tables change the contacts that LIGGGHTS wrote."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dragchain.arrays import Floats
from dragchain.documents import Document
from dragchain.tables.network_contacts import KINDS, ContactRows

_ROUNDING = 1e-6
"""A force above the limit by this fraction is rounded, not cut."""


class Corrections(Document):
    """``corrections.json``: sums over all network frames.

    Attributes
    ----------
    friction : float
        Coefficient of friction between particles.
    particle_contacts, cut : int
        Contacts between particles, and those with a tangential force above the limit of friction.
    strong_contacts, strong_cut : int
        The same of contacts whose normal force is above the mean of their frame.
    removed_fraction : float
        What was cut off, over the sum of the tangential forces as written.
    workpiece_contacts, merged : int
        Contacts on the workpiece, and those that became part of another one; the sum of both was
        written.
    """

    made_by: ClassVar[str] = "dragchain tables"

    friction: float
    particle_contacts: int
    cut: int
    strong_contacts: int
    strong_cut: int
    removed_fraction: float
    workpiece_contacts: int
    merged: int


@dataclass
class Corrector:
    """Collects the corrections frame by frame.

    Parameters
    ----------
    friction : float
        Coefficient of friction between particles.
    """

    friction: float
    _counts: Floats = field(default_factory=lambda: np.zeros(6))
    _forces_n: Floats = field(default_factory=lambda: np.zeros(2))

    def add(self, rows: ContactRows, workpiece_contacts: int, merged: int) -> None:
        """Take in the contacts of one frame."""
        between = rows.kind == KINDS.index("particle-particle")
        normal, left, removed = (
            values[between]
            for values in (rows.normal_force_n, rows.tangential_force_n, rows.removed_n)
        )
        cut = removed > _ROUNDING * left
        strong = normal > normal.mean() if len(normal) else cut
        counts = [len(cut), cut.sum(), strong.sum(), (cut & strong).sum()]
        self._counts += [*counts, workpiece_contacts, merged]
        self._forces_n += [removed.sum(), (removed + left).sum()]

    def record(self) -> Corrections:
        """The content of ``corrections.json``."""
        removed, written = self._forces_n
        contacts, cut, strong, strong_cut, on_workpiece, merged = self._counts.astype(int).tolist()
        return Corrections(
            friction=self.friction,
            particle_contacts=contacts,
            cut=cut,
            strong_contacts=strong,
            strong_cut=strong_cut,
            removed_fraction=float(removed / written) if written else 0.0,
            workpiece_contacts=on_workpiece,
            merged=merged,
        )

"""How far the tables change the contacts that LIGGGHTS wrote."""

from typing import Self

import numpy as np

from dragchain.arrays import Floats
from dragchain.tables.network_contacts import KINDS, ContactRows
from dragdeck.documents import Document

_ROUNDING = 1e-6
"""A force above the limit by this fraction is rounded, not cut."""

_COUNTS = (
    *("particle_contacts", "cut", "strong_contacts", "strong_cut"),
    *("workpiece_contacts", "merged"),
)


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
    workpiece_contacts, merged : int
        Contacts on the workpiece, and those that became part of another one; the sum of both was
        written.
    removed_fraction : float
        What was cut off, over the sum of the tangential forces between particles as written.
    """

    remedy = "make it with: dragchain tables"

    friction: float
    particle_contacts: int
    cut: int
    strong_contacts: int
    strong_cut: int
    workpiece_contacts: int
    merged: int
    removed_fraction: float

    @classmethod
    def of(cls, friction: float, sums: Floats) -> Self:
        """The document of the sums of `count_corrections`."""
        counts = dict(zip(_COUNTS, sums[:6].astype(int).tolist(), strict=True))
        fraction = float(sums[6] / sums[7]) if sums[7] else 0.0
        return cls(friction=friction, **counts, removed_fraction=fraction)


def count_corrections(rows: ContactRows, merged: int) -> Floats:
    """The counts of one frame as `Corrections` has them, and tangential force removed and written.

    Returns
    -------
    (8,) ndarray
        Sums of frames are those of a run.
    """
    between, on_workpiece = (
        rows.kind == KINDS.index(f"particle-{body}") for body in ("particle", "workpiece")
    )
    left, removed = rows.tangential_force_n[between], rows.removed_n[between]
    cut, normal = removed > _ROUNDING * left, rows.normal_force_n[between]
    strong = normal > normal.mean() if len(normal) else cut
    counts = [len(cut), cut.sum(), strong.sum(), (cut & strong).sum(), on_workpiece.sum(), merged]
    return np.array([*counts, removed.sum(), (removed + left).sum()], dtype=np.float64)

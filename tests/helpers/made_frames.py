"""Frames of dumps and contacts with a wall, made by hand."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dragchain.tables.workpiece_contacts import WallContacts
from dragdeck.dumps.frame import Frame


def frame(names: Sequence[str], rows: Any, step: int = 100) -> Frame:
    """A frame of rows; ids are whole numbers."""
    table = np.array(rows, dtype=float).reshape(-1, len(names))
    kinds = {name: np.int64 if name.endswith("_id") else np.float64 for name in names}
    return Frame(step, {name: table[:, i].astype(kinds[name]) for i, name in enumerate(names)})


def wall(
    forces: Any = (), points: Any = None, normals: Any = None, silent: Any = None
) -> WallContacts:  # fmt: skip
    """Contacts of particles 1, 2 and so on; what is not given is zero, or the force."""
    force = np.array(forces, dtype=float).reshape(-1, 3)
    count, none = len(force), np.zeros_like(force)
    return WallContacts(
        particle_id=np.arange(1, count + 1),
        facet_id=np.arange(count),
        point_m=none if points is None else np.array(points, dtype=float),
        force_n=force,
        normal=none if normals is None else np.array(normals, dtype=float),
        surface_m_s=none,
        overlap_m=np.full(count, 1e-6),
        attraction_n=np.zeros(count),
        silent=np.zeros(count, dtype=bool) if silent is None else np.array(silent, dtype=bool),
    )

"""Statistics of the contact network, frame by frame.

Only frames inside the counted stretch of the drag are used: those between the first and the last
sample that ``workpiece_force.parquet`` marks as ``counted``.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Ints
from dragchain.network.frame import KINDS, NetworkFrame

_LEAST_CONTACTS = 4
"""A particle with fewer contacts is a rattler. Four is the mean number with which frictional
spheres are isostatic; Thornton (2000) leaves out only particles with fewer than two."""


def contact_counts(frame: NetworkFrame) -> Ints:
    """The number of contacts of each particle, those with workpiece and bowl included, (N,)."""
    size = frame.particle_id.size
    return np.bincount(frame.a, minlength=size) + np.bincount(
        frame.b[frame.between_particles()], minlength=size
    )


def mechanical_coordination_number(counts: NDArray[np.integer[Any]]) -> float:
    """The mean number of contacts of the particles that carry load.

    Particles with fewer than `_LEAST_CONTACTS` contacts are left out as carriers, while their
    contacts still count for the carriers that they touch, as in the (2 M - N1) / (N - N0 - N1) of
    Thornton (2000, Geotechnique 50, 43-53), who leaves out those with fewer than two. NaN where no
    particle is left.
    """
    return _mean(counts[counts >= _LEAST_CONTACTS])


def frame_statistics(frame: NetworkFrame) -> dict[str, float]:
    """Return one row of ``network.parquet``; forces in N, NaN where a frame has no contact.

    The coordination number is the mean number of contacts per particle. Without walls that is
    2 M / N for M contacts (Thornton 2000, Geotechnique 50, 43-53); a contact with workpiece or
    bowl counts once, for the particle.
    """
    counts = contact_counts(frame)
    normal = frame.normal_force
    mean = _mean(normal)
    of_kind = {
        f"n_particle_{name}_contacts": int((frame.other == kind).sum())
        for kind, name in KINDS.items()
    }
    return {
        "step": frame.step,
        "time_s": frame.time_s,
        "n_particles": frame.particle_id.size,
        "n_contacts": normal.size,
        **of_kind,
        "coordination_number": _mean(counts),
        "mechanical_coordination_number": mechanical_coordination_number(counts),
        "rattler_fraction": _mean(counts < _LEAST_CONTACTS),
        "normal_force_mean_n": mean,
        "normal_force_max_n": float(normal.max()) if normal.size else mean,
        "above_mean_fraction": _mean(normal > mean),
    }


def _mean(values: NDArray[Any]) -> float:
    return float(values.mean()) if values.size else float("nan")

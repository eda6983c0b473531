"""Shared by tests of several modules."""

from pathlib import Path
from typing import Any

import numpy as np
from tradeoff_files import measures, write

from dragchain.tradeoff.compare import read_runs
from dragchain.tradeoff.outcome import Tradeoff, compare

REFERENCE, SOFT, COARSE, FAST = (1.0, 0.2, 1.0), (0.01, 0.2, 1.0), (1.0, 0.5, 1.0), (1.0, 0.2, 5.0)
BOTH = (0.01, 0.5, 1.0)
SOFTNESS = {"drag_mean": 1.1, "lateral_mean": 0.2, "contact_force_mean": 0.7}
FAILURE = [
    {
        "code": "particles_kept",
        "passed": False,
        "name": "no particle lost",
        "seen": "12 particles",
        "limit": "1422",
    }
]


def contents(**changes: Any) -> list[dict[str, Any]]:
    """Four seeds at the reference and three at each of the others."""
    rng = np.random.default_rng(1)
    found = [measures(REFERENCE, seed, rng, cpu_time_s=100.0, **changes) for seed in (1, 2, 3, 4)]
    for seed in (1, 2, 3):
        found += [
            measures(SOFT, seed, rng, effects=SOFTNESS, cpu_time_s=10.0, **changes),
            measures(COARSE, seed, rng, cpu_time_s=40.0, **changes),
            measures(BOTH, seed, rng, effects=SOFTNESS, cpu_time_s=5.0, **changes),
        ]
    return found


def made(folder: Path, found: list[dict[str, Any]]) -> Tradeoff:
    """The trade-off of runs with these measures, the first at the reference."""
    files = write(folder, found)
    return compare(*read_runs(files, files[0].parent))


def point_of(content: dict[str, Any]) -> tuple[float, ...]:
    """Levels of the fidelity parameters of a run."""
    fidelity = content["fidelity"]
    return tuple(
        fidelity[name] for name in ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
    )


WITHIN = 0.03
"""Over four standard errors of a difference here, 3 % / sqrt(8 blocks) / sqrt(3 or so pairs)."""

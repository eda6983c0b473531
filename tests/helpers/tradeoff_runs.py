"""Shared by tests of several modules."""

from __future__ import annotations

from typing import Any

import numpy as np
from tradeoff_files import measures

REFERENCE, SOFT, COARSE, FAST = (1.0, 0.2, 1.0), (0.01, 0.2, 1.0), (1.0, 0.5, 1.0), (1.0, 0.2, 5.0)
BOTH = (0.01, 0.5, 1.0)
SOFTNESS = {"drag_mean": 1.1, "lateral_mean": 0.2, "contact_force_mean": 0.7}
FAILURE = [
    {"name": "every particle kept", "passed": False, "seen": "12 particles", "limit": "1422"}
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

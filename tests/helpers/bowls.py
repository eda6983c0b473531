"""Bowls of several kinds, and a bowl as ``case.json`` has it."""

from typing import Any

import numpy as np

from dragdeck.physics.walls import round_container


def hexagon(across_m: float, height_m: float) -> np.ndarray:
    """Facets of a hexagonal bowl that widens from two thirds of its width, (F, 3, 3)."""
    angle = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * across_m / np.sqrt(3)
    low, high = (
        np.insert(share * ring, 2, z, axis=1) for share, z in ((2 / 3, 0), (1, height_m / 4))
    )
    top, middle = np.insert(ring, 2, height_m, axis=1), np.zeros(3)
    facets = []
    for here, after in ((side, (side + 1) % 6) for side in range(6)):
        facets.append([middle, low[here], low[after]])
        for below, above in ((low, high), (high, top)):
            facets.append([below[here], above[here], above[after]])
            facets.append([below[here], above[after], below[after]])
    return np.array(facets)


OWN_BOWL: dict[str, Any] = {
    "bowl": {"kind": "mesh", "material": "steel", "height_m": 0.06,
             "facets_m": hexagon(0.06, 0.06).reshape(-1, 9).round(9).tolist()},
    "media.count": 420,
}  # fmt: skip
"""A hexagonal bowl as a mesh."""

SMALL_BOWLS: dict[str, dict[str, Any]] = {
    "annulus": {
        "bowl": {"kind": "annulus", "material": "steel", "radius_m": 0.046, "core_radius_m": 0.010,
                 "height_m": 0.08},
        "motion.path": {"kind": "circle", "radius_m": 0.028, "revolutions": 0.05},
        "motion.plunge_at_m": [0.028, 0.0],
        "media.count": 600,
    },
    "trough": {
        "bowl": {"kind": "trough", "material": "steel", "length_m": 0.08, "width_m": 0.045,
                 "height_m": 0.08},
        "motion.path": {"kind": "line", "start_m": [-0.01, 0], "direction_deg": 0,
                        "length_m": 0.01},
        "media.count": 350,
    },
    "revolved": {
        "bowl": {"kind": "revolved", "material": "steel", "height_m": 0.05,
                 "profile_m": [[0, 0], [0.012, 0], [0.024, 0.008], [0.03, 0.02], [0.032, 0.05]]},
        "media.count": 380,
    },
    "ring": {
        "bowl": {"kind": "revolved", "material": "steel", "height_m": 0.05,
                 "profile_m": [[0.012, 0.05], [0.012, 0.018], [0.020, 0.004], [0.029, 0],
                               [0.038, 0.004], [0.046, 0.018], [0.046, 0.05]]},
        "motion.path": {"kind": "circle", "radius_m": 0.029, "revolutions": 0.05},
        "motion.plunge_at_m": [0.029, 0.0],
        "media.count": 640,
    },
    "lid": {
        "bowl": {"radius_m": 0.025, "height_m": 0.1, "lid_m": 0.05},
        "media.count": 200,
    },
}  # fmt: skip
"""Changes of the small study: bowls, with a path and a number of particles that fit."""


def bowl_of_run(radius_m: float) -> dict[str, Any]:
    """A cylinder."""
    return round_container(radius_m).model_dump(mode="json")

"""Recordings of the verification suite, made by hand."""

from typing import Any

import numpy as np

from evidence.verification.experiment import CollideCase
from evidence.verification.recording import Recording

STEEL = {"name": "steel", "youngs_modulus_pa": 2e11, "poissons_ratio": 0.3, "density_kg_m3": 7800.0}
ON_PLANE = {"particle": 1, "partner": "plane", "value": 0.0}
ON_PARTICLE = {"particle": 2, "partner": 1, "value": 0.0}


def recording(heights: list[list[float]], **facts: Any) -> Recording:
    """Particles of radius 1 m above z = 0, at these heights over time, one frame per second."""
    z = np.array(heights, dtype=np.float64)
    place = np.zeros((*z.shape, 3))
    place[:, :, 2] = z
    still = np.zeros_like(place)
    case = {
        "schema": 2, "study_name": "verification", "title": "made by hand", "scene": "collide",
        "run": "made", "versions": {}, "fidelity": {"ranks": 1},
        "media": {"count": len(heights[0])}, "test": "elastic_plane", "number": 2,
        "heading": "made by hand", "series": "s on s", "vary": "tangential_m_s",
        "steps_per_contact": 100, "timestep_s": 1.0, "rayleigh_time_s": 1.0, "limit_force": True,
        "gravity_m_s2": [0.0, 0.0, 0.0], "types": [STEEL, STEEL],
        "pairs": [{"types": [1, 2], "restitution": 0.5, "friction": 0.2},
                  {"types": [1, 1], "restitution": 0.9, "friction": 0.1}],
        "bodies": [{"type": 1, "radius_m": 1.0, "position_m": (0.0, 0.0, 0.0)} for _ in heights[0]],
        "walls": [{"name": "plane", "type": 2, "shape": "zplane 0.0"}], "contacts": [ON_PLANE],
        **facts,
    }  # fmt: skip
    velocity = np.gradient(place, axis=0) if len(z) > 1 else np.zeros_like(place)
    moving = (np.arange(len(z), dtype=float), place, velocity, still, still)
    return Recording(CollideCase.model_validate(case), *moving, {"plane": still})

"""The elastic contact of Hertz: what modulus two bodies have together, how long they touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def effective_modulus(first: Mapping[str, Any], second: Mapping[str, Any]) -> float:
    """Effective Young's modulus, Pa (Johnson 1985, eq. 4.21 ff.)."""
    compliance: float = sum(
        (1 - material["poissons_ratio"] ** 2) / material["youngs_modulus_pa"]
        for material in (first, second)
    )
    return 1 / compliance


def contact_time(mass_kg: float, radius_m: float, modulus_pa: float, speed_m_s: float) -> float:
    """Time for which a particle that hits a plane touches it, s (Johnson 1985, eq. 11.24).

    ``2.87 (m^2 / (R E*^2 v))^(1/5)``, of an elastic impact without adhesion.
    """
    scale: float = (mass_kg**2 / (radius_m * modulus_pa**2 * speed_m_s)) ** 0.2
    return 2.87 * scale

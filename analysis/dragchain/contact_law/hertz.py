"""The elastic contact of Hertz: the moduli that two bodies have together, how long they touch."""

import math
from dataclasses import dataclass
from typing import TypeVar

from dragchain.arrays import Floats

Number = TypeVar("Number", float, Floats)


@dataclass(frozen=True)
class Elastic:
    """Elastic constants of a material: Young's modulus, Pa, and Poisson's ratio."""

    youngs_modulus_pa: float
    poissons_ratio: float


def effective_modulus(first: Elastic, second: Elastic) -> float:
    """Effective Young's modulus, Pa (Johnson 1985, eq. 4.21 ff.)."""
    return 1 / sum(
        (1 - material.poissons_ratio**2) / material.youngs_modulus_pa
        for material in (first, second)
    )


def contact_time(mass_kg: float, radius_m: float, modulus_pa: float, speed_m_s: float) -> float:
    """Time for which a particle that hits a plane touches it, s (Johnson 1985, eq. 11.24).

    ``2.87 (m^2 / (R E*^2 v))^(1/5)``, of an elastic impact without adhesion.
    """
    scale: float = (mass_kg**2 / (radius_m * modulus_pa**2 * speed_m_s)) ** 0.2
    return 2.87 * scale


def sphere_mass(radius_m: Number, density_kg_m3: float) -> Number:
    """Mass of solid spheres, kg."""
    return 4 / 3 * math.pi * radius_m**3 * density_kg_m3

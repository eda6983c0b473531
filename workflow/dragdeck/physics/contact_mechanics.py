"""Mechanics of contacts and beds: moduli, damping, time steps, contact times.

Every function is plain arithmetic on SI values.
"""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dragdeck.study.material import Material

Size = TypeVar("Size", float, NDArray[np.float64])

SOLID_FRACTION_ESTIMATE = 0.59
"""Solid fraction of a poured bed about twelve particles wide, an estimate used only
for expectations before the bed exists (measured beds replace it)."""

COORDINATION_ESTIMATE = 5.0
"""Contacts of a particle in a poured bed with friction, an estimate used only for expectations."""

DENSEST_RANDOM_PACKING = 0.64
"""Random close packing of equal particles (Scott and Kilgour 1969, 0.6366)."""


@dataclass(frozen=True)
class Elastic:
    """Elastic constants of a material: Young's modulus, Pa, and Poisson's ratio."""

    youngs_modulus_pa: float
    poissons_ratio: float


def shear_modulus(material: Material | Elastic, scale: float = 1.0) -> float:
    """Shear modulus G = E / (2 (1 + nu)), Pa, with E scaled by `scale`."""
    return scale * material.youngs_modulus_pa / (2 * (1 + material.poissons_ratio))


def effective_modulus(
    first: Material | Elastic, second: Material | Elastic, scale: float = 1.0
) -> float:
    """Effective modulus of a contact, Pa (Johnson 1985, Contact Mechanics, eq. 4.21 ff.)."""
    compliance = sum(
        (1 - material.poissons_ratio**2) / (scale * material.youngs_modulus_pa)
        for material in (first, second)
    )
    return 1 / compliance


def effective_shear(
    first: Material | Elastic, second: Material | Elastic, scale: float = 1.0
) -> float:
    """Effective shear modulus of a contact, Pa: 1 / G* sums (2 - nu) / G (Mindlin 1949)."""
    bodies = (first, second)
    return 1 / sum((2 - body.poissons_ratio) / shear_modulus(body, scale) for body in bodies)


def rayleigh_time(material: Material, radius_m: float, scale: float = 1.0) -> float:
    """Travel time of a Rayleigh wave over half the circumference of a particle, s.

    ``pi R sqrt(rho / G) / (0.1631 nu + 0.8766)``, as in LIGGGHTS' ``fix check/timestep/gran``
    (Thornton and Randall 1988, Micromechanics of Granular Materials, 133-142; Sheng et al. 2004,
    Engineering Computations 21, 304-317).
    """
    wave = math.sqrt(material.density_kg_m3 / shear_modulus(material, scale))
    return math.pi * radius_m * wave / (0.1631 * material.poissons_ratio + 0.8766)


def particle_mass(material: Material, radius_m: float) -> float:
    """Mass of a particle, kg."""
    return sphere_mass(radius_m, material.density_kg_m3)


def sphere_mass(radius_m: Size, density_kg_m3: float) -> Size:
    """Mass of solid spheres, kg."""
    return 4 / 3 * math.pi * radius_m**3 * density_kg_m3


def fall_energy(
    particles: int, density_kg_m3: float, radius_m: float, gravity_m_s2: float
) -> float:
    """Energy of particles that fall by their diameter, N m g d, J: the unit of a settling bed."""
    return particles * sphere_mass(radius_m, density_kg_m3) * gravity_m_s2 * 2 * radius_m


def hertz_contact_time(
    mass_kg: float, radius_m: float, modulus_pa: float, speed_m_s: float
) -> float:
    """Duration of an elastic impact, s (Johnson 1985, eq. 11.24).

    Parameters
    ----------
    mass_kg, radius_m, modulus_pa : float
        Effective mass, radius and modulus of the two bodies.
    speed_m_s : float
        Relative normal speed.
    """
    stiffness = mass_kg**2 / (radius_m * modulus_pa**2 * speed_m_s)
    return 2.87 * float(stiffness**0.2)


def hertz_overlap(force_n: float, radius_m: float, modulus_pa: float) -> float:
    """Overlap under a static normal force, m (Johnson 1985, eq. 4.23)."""
    return float((3 * force_n / (4 * modulus_pa * math.sqrt(radius_m))) ** (2 / 3))


def fall_speed(height_m: float, gravity_m_s2: float) -> float:
    """Speed after a free fall from rest, m/s."""
    return math.sqrt(2 * gravity_m_s2 * height_m)


def bed_height(volume_m3: float, bowl_radius_m: float, solid_fraction: float) -> float:
    """Height of a bed of particles of that total volume, m."""
    return volume_m3 / (solid_fraction * math.pi * bowl_radius_m**2)


def bed_pressure(density_kg_m3: float, gravity_m_s2: float, depth_m: float) -> float:
    """Weight of the bed above a depth, Pa, at a solid fraction of `SOLID_FRACTION_ESTIMATE`.

    The wall carries a part of it (Janssen 1895), which is left out: the true
    pressure is lower.
    """
    return SOLID_FRACTION_ESTIMATE * density_kg_m3 * gravity_m_s2 * depth_m


def bed_overlap(modulus_pa: float, pressure_pa: float) -> float:
    """Overlap of two particles of a bed under a pressure, over their diameter d: an estimate.

    The mean normal force of a contact is F = pi d^2 p / (z phi) (Agnolin and Roux 2007,
    Physical Review E 76, 061302), here with z = `COORDINATION_ESTIMATE` contacts a particle and
    the solid fraction phi = `SOLID_FRACTION_ESTIMATE`; its overlap is that of `hertz_overlap`.

    Parameters
    ----------
    modulus_pa : float
        Effective modulus of two particles.
    pressure_pa : float
    """
    force = math.pi * pressure_pa / (COORDINATION_ESTIMATE * SOLID_FRACTION_ESTIMATE)
    return hertz_overlap(force, 0.25, modulus_pa)  # of particles with a diameter of 1


def stiffness_number(material: Material, pressure_pa: float) -> float:
    """How stiff particles are against the pressure on them: (E / ((1 - nu^2) p))^(2/3).

    Agnolin and Roux 2007, Physical Review E 76, 061302: its inverse goes as the
    overlap of a Hertz contact over the diameter.
    """
    modulus = material.youngs_modulus_pa / (1 - material.poissons_ratio**2)
    return float((modulus / pressure_pa) ** (2 / 3))


def inertial_number(
    shear_rate_per_s: float, diameter_m: float, density_kg_m3: float, pressure_pa: float
) -> float:
    """Time in which the pressure moves a particle by its size, over that of the shear.

    I = rate d / sqrt(p / rho): GDR MiDi 2004, European Physical Journal E 14, 341;
    da Cruz et al. 2005, Physical Review E 72, 021309. Small where flow is quasi-static.
    """
    return shear_rate_per_s * diameter_m / math.sqrt(pressure_pa / density_kg_m3)

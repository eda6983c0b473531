"""Mechanics of contacts and packings: moduli, damping, contact times, limits of LIGGGHTS.

All values are in SI units.
"""

import math
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dragdeck.physics.estimates import COORDINATION_ESTIMATE, SOLID_FRACTION_ESTIMATE

Size = TypeVar("Size", float, NDArray[np.float64])


class Solid(Protocol):
    """An elastic material."""

    @property
    def youngs_modulus_pa(self) -> float:
        """Young's modulus, Pa."""

    @property
    def poissons_ratio(self) -> float:
        """Poisson's ratio."""

    @property
    def density_kg_m3(self) -> float:
        """Density of the solid, kg/m3."""


def shear_modulus(material: Solid, scale: float = 1.0) -> float:
    """Shear modulus G = E / (2 (1 + nu)), Pa, with E scaled by `scale`."""
    return scale * material.youngs_modulus_pa / (2 * (1 + material.poissons_ratio))


def effective_modulus(first: Solid, second: Solid, scale: float = 1.0) -> float:
    """Effective modulus of a contact, Pa (Johnson 1985, Contact Mechanics, eq. 4.21 ff.)."""
    compliance = sum(
        (1 - material.poissons_ratio**2) / (scale * material.youngs_modulus_pa)
        for material in (first, second)
    )
    return 1 / compliance


def pull_off_force(slope_n_m: float, modulus_pa: float, reduced_radius_m: float) -> float:
    """Largest tension of a contact with an attraction proportional to the overlap, N.

    The attraction ``a d`` minus Hertz's force ``4/3 E* sqrt(R*) d^(3/2)`` is largest at
    ``sqrt(d) = a / (2 E* sqrt(R*))``, where it is ``a^3 / (12 E*^2 R*)``.
    """
    return slope_n_m**3 / (12 * modulus_pa**2 * reduced_radius_m)


def effective_shear(first: Solid, second: Solid, scale: float = 1.0) -> float:
    """Effective shear modulus of a contact, Pa: 1 / G* sums (2 - nu) / G (Mindlin 1949)."""
    bodies = (first, second)
    return 1 / sum((2 - body.poissons_ratio) / shear_modulus(body, scale) for body in bodies)


def rayleigh_time(material: Solid, radius_m: float, scale: float = 1.0) -> float:
    """Travel time of a Rayleigh wave over half the circumference of a particle, s.

    ``pi R sqrt(rho / G) / (0.1631 nu + 0.8766)``, as in LIGGGHTS' ``fix check/timestep/gran``
    (Thornton and Randall 1988, Micromechanics of Granular Materials, 133-142; Sheng et al. 2004,
    Engineering Computations 21, 304-317).
    """
    wave = math.sqrt(material.density_kg_m3 / shear_modulus(material, scale))
    return math.pi * radius_m * wave / (0.1631 * material.poissons_ratio + 0.8766)


def particle_mass(material: Solid, radius_m: float) -> float:
    """Mass of a particle, kg."""
    return sphere_mass(radius_m, material.density_kg_m3)


def sphere_mass(radius_m: Size, density_kg_m3: Size | float) -> Size:
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


def fall_time(height_m: float, gravity_m_s2: float) -> float:
    """Duration of a free fall from rest, s."""
    return math.sqrt(2 * height_m / gravity_m_s2)


def wedge_ratio(friction: float, wall: bool) -> float:
    """Size ratio from which friction can hold a sphere between two touching bodies.

    The line through the two contacts of a sphere of radius r makes the angle a with both normals,
    and forces along it need a friction of ``tan(a)``. Between two spheres of radius R this is
    ``sqrt((1 + r / R)^2 - 1)``, between one and a plane ``sqrt(r / R)``.

    Parameters
    ----------
    friction : float
        The smaller one of the two contacts.
    wall : bool
        Whether one of the bodies is a plane.
    """
    if friction == 0:
        return math.inf
    return 1 / friction**2 if wall else 1 / (math.sqrt(1 + friction**2) - 1)


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


def impact_overlap(density_kg_m3: float, modulus_pa: float, speed_m_s: float) -> float:
    """Largest overlap of two equal spheres in an elastic impact, over their diameter.

    ``(15 m v^2 / (16 E* sqrt(R)))^(2/5)`` with effective mass, radius and modulus (Johnson 1985,
    eq. 11.23); the size of the spheres cancels.
    """
    mass = sphere_mass(0.5, density_kg_m3) / 2
    return float((15 * mass * speed_m_s**2 / (16 * modulus_pa * math.sqrt(0.25))) ** 0.4)


def stiffness_number(material: Solid, pressure_pa: float) -> float:
    """How stiff particles are against the pressure on them: (E / ((1 - nu^2) p))^(2/3).

    Agnolin and Roux 2007, Physical Review E 76, 061302: its inverse goes as the
    overlap of a Hertz contact over the diameter.
    """
    modulus = material.youngs_modulus_pa / (1 - material.poissons_ratio**2)
    return float((modulus / pressure_pa) ** (2 / 3))


FAST = 0.1
"""Inertial number above which impacts decide (docs/evidence/windows.md)."""

SOFT_AT_SPEED = (
    "at 1 to 3 m/s, each tenth of Young's modulus gave 1.7 times as many contacts and 0.54 times "
    "the force of each"
)
"""Of a rod in a trough at inertial numbers of 2.4 and 7 (docs/evidence/scaling.md)."""

AT_SPEED = 1.0
"""Inertial number above which that is said."""


def inertial_number(
    shear_rate_per_s: float, diameter_m: float, density_kg_m3: float, pressure_pa: float
) -> float:
    """Time in which the pressure moves a particle by its size, over that of the shear.

    I = rate d / sqrt(p / rho): GDR MiDi 2004, European Physical Journal E 14, 341;
    da Cruz et al. 2005, Physical Review E 72, 021309. Small where flow is quasi-static.
    """
    return shear_rate_per_s * diameter_m / math.sqrt(pressure_pa / density_kg_m3)


def damping_ratio(restitution: float) -> float:
    """Damping ratio ``|ln e| / sqrt(ln^2 e + pi^2)`` of a contact with restitution e.

    LIGGGHTS multiplies it with ``sqrt(5/6)`` in its Hertz law (Tsuji, Tanaka and Ishida 1992,
    Powder Technology 71, 239-250).
    """
    log = math.log(restitution)
    return -log / math.hypot(log, math.pi)


@dataclass(frozen=True)
class ContactConstants:
    """Constants of the contact of a particle with another body, at the run's Young's modulus.

    Attributes
    ----------
    modulus_pa, shear_pa : float
        Effective moduli E* and G*.
    restitution, friction : float
        Coefficients.
    """

    modulus_pa: float
    shear_pa: float
    restitution: float
    friction: float

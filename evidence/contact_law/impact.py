"""An impact of two bodies: what is known of it exactly.

Sources: K.L. Johnson 1985, Contact Mechanics; D. Antypov, J.A. Elliott 2011, EPL 94, 50004;
T. Schwager, T. Poeschel 2007, Granular Matter 9, 465; A.H. Kharaz et al. 2001, Powder Technology
120, 281.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import gamma

from dragchain.arrays import Floats

CONTACT_TIME = 4 * math.sqrt(math.pi) * gamma(2 / 5) / (5 * gamma(9 / 10))
"""Elastic contact time over (largest overlap / speed), 2.9432 (Johnson 1985, eq. 11.24)."""

SPHERE = 2 / 5
"""Moment of inertia of a solid particle over m R^2."""

SLIDING = 1 + 1 / SPHERE
"""Tangential mobility of the contact point over that of the centre: 7/2."""


@dataclass(frozen=True)
class Particle:
    """Mass (kg) and radius (m) of a particle."""

    mass_kg: float
    radius_m: float

    @property
    def inertia_kg_m2(self) -> float:
        """Moment of inertia, kg m2."""
        return SPHERE * self.mass_kg * self.radius_m**2


@dataclass(frozen=True)
class Contact:
    """A particle and its partner: another particle, or a plane that does not move.

    Attributes
    ----------
    particle : Particle
    partner : Particle or None
        None for a plane.
    modulus_pa, shear_pa : float
        Effective Young's and shear modulus, Pa.
    restitution, friction : float
        As in the deck.
    limit_force : bool
        Whether attraction at the end of an impact is cut off.
    """

    particle: Particle
    partner: Particle | None
    modulus_pa: float
    shear_pa: float
    restitution: float
    friction: float
    limit_force: bool

    @property
    def mass_kg(self) -> float:
        """Effective mass, kg."""
        if self.partner is None:
            return self.particle.mass_kg
        return 1 / (1 / self.particle.mass_kg + 1 / self.partner.mass_kg)

    @property
    def radius_m(self) -> float:
        """Effective radius, m."""
        if self.partner is None:
            return self.particle.radius_m
        return 1 / (1 / self.particle.radius_m + 1 / self.partner.radius_m)

    @property
    def rebound(self) -> float:
        """Exact ratio of normal speeds of this law."""
        return limited_restitution(self.restitution) if self.limit_force else self.restitution


@dataclass(frozen=True)
class Motion:
    """Relative motion at a contact.

    Attributes
    ----------
    normal_m_s : float
        Speed of approach before, of separation after.
    tangential_m_s : float
        Velocity of the particle's centre past that of its partner.
    spin_rad_s, partner_spin_rad_s : float
        Positive: the surface at the contact moves the same way as a positive
        tangential velocity of the particle.
    """

    normal_m_s: float
    tangential_m_s: float = 0.0
    spin_rad_s: float = 0.0
    partner_spin_rad_s: float = 0.0

    def patch_m_s(self, contact: Contact) -> float:
        """Tangential velocity of the surfaces past each other where they touch, m/s."""
        second = contact.partner.radius_m if contact.partner is not None else 0.0
        return (
            self.tangential_m_s
            + contact.particle.radius_m * self.spin_rad_s
            + second * self.partner_spin_rad_s
        )


def largest_overlap(contact: Contact, speed_m_s: float) -> float:
    """Largest overlap of an elastic impact, m (Johnson 1985, eq. 11.23)."""
    energy = 15 * contact.mass_kg * speed_m_s**2
    return float((energy / (16 * contact.modulus_pa * math.sqrt(contact.radius_m))) ** 0.4)


def hertz_force(contact: Contact, overlap_m: Floats | float) -> Floats:
    """Elastic normal force, N (Johnson 1985, eq. 4.23)."""
    stiffness = 4 / 3 * contact.modulus_pa * np.sqrt(contact.radius_m)
    return np.asarray(stiffness * np.power(overlap_m, 1.5))


def hertz_overlap(contact: Contact, force_n: float) -> float:
    """Overlap under a static force, m (Johnson 1985, eq. 4.23)."""
    stiffness = 4 / 3 * contact.modulus_pa * math.sqrt(contact.radius_m)
    return float((force_n / stiffness) ** (2 / 3))


def elastic_time(contact: Contact, speed_m_s: float) -> float:
    """Duration of an elastic impact, s (Johnson 1985, eq. 11.24)."""
    return CONTACT_TIME * largest_overlap(contact, speed_m_s) / speed_m_s


def limited_restitution(restitution: float) -> float:
    """Restitution that comes out when attraction is cut off (``limitForce on``).

    Damping in proportion to overlap^(1/4) turns into a linear spring and dashpot
    under the change of variable of Antypov and Elliott (2011), in which force
    and speed vanish at the same moments; for the linear law Schwager and
    Poeschel (2007) give the speed at which the force vanishes. With
    x = -ln(e)/pi, the damping over the frequency, that is
    exp(-x (pi - 2 arctan x)). The speed of impact does not matter.
    """
    ratio = -math.log(restitution) / math.pi
    return math.exp(-ratio * (math.pi - 2 * math.atan(ratio)))


def sliding_impact(contact: Contact, before: Motion) -> Motion | None:
    """Motion after an impact that slides from begin to end, for rigid bodies.

    Coulomb's law in impulses: the tangential impulse is the friction times the
    normal one. None if the surfaces would stop sliding before the end, where
    rigid bodies say nothing (Kharaz et al. 2001, Powder Technology 120, 281).
    """
    way = math.copysign(1.0, before.patch_m_s(contact))
    drop = contact.friction * (1 + contact.rebound) * before.normal_m_s
    if abs(before.patch_m_s(contact)) < SLIDING * drop or drop == 0.0:
        return None
    impulse = way * drop * contact.mass_kg
    return Motion(
        contact.rebound * before.normal_m_s,
        before.tangential_m_s - way * drop,
        before.spin_rad_s - impulse * contact.particle.radius_m / contact.particle.inertia_kg_m2,
        before.partner_spin_rad_s - _partner_spin(contact, impulse),
    )


def _partner_spin(contact: Contact, impulse_n_s: float) -> float:
    if contact.partner is None:
        return 0.0
    return impulse_n_s * contact.partner.radius_m / contact.partner.inertia_kg_m2

"""An impact of two bodies by the Hertz-Mindlin law: exact formulae, and the law integrated.

The law is that of LIGGGHTS's ``model hertz tangential history``, written down again from its
equations and integrated in small steps: a second solution on purpose, which shares no code with
LIGGGHTS and no formula of damping with dragdeck.

Sources: K.L. Johnson 1985, Contact Mechanics; R.D. Mindlin 1949, J. Appl. Mech. 16, 259; Y. Tsuji
et al. 1992, Powder Technology 71, 239; D. Antypov, J.A. Elliott 2011, EPL 94, 50004; T. Schwager,
T. Poeschel 2007, Granular Matter 9, 465; A.H. Kharaz et al. 2001, Powder Technology 120, 281.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from scipy.special import gamma

from dragchain.arrays import Floats

CONTACT_TIME = 4 * math.sqrt(math.pi) * gamma(2 / 5) / (5 * gamma(9 / 10))
"""Elastic contact time over (largest overlap / speed), 2.9432 (Johnson 1985, eq. 11.24)."""

SPHERE = 2 / 5
"""Moment of inertia of a solid particle over m R^2."""

SLIDING = 1 + 1 / SPHERE
"""Tangential mobility of the contact point over that of the centre: 7/2."""

_STEPS, _LONGEST = 20_000, 20
"""Steps of the integrated law in an elastic contact time, and such times that an impact may take.
The error is about 2 / steps."""


@dataclass(frozen=True)
class Particle:
    """Mass (kg) and radius (m) of a particle."""

    mass_kg: float
    radius_m: float

    @property
    def inertia_kg_m2(self) -> float:
        """Moment of inertia, kg m2."""
        return SPHERE * self.mass_kg * self.radius_m**2

    def spun_rad_s(self, impulse_n_s: float) -> float:
        """Change of its spin by an impulse at its surface, rad/s."""
        return impulse_n_s * self.radius_m / self.inertia_kg_m2


_PLANE = Particle(1.0, 0.0)
"""Stands in for the partner of a particle on a plane, which has no lever and never turns."""


@dataclass(frozen=True)
class ContactPair:
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
class RelativeMotion:
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

    def patch_m_s(self, contact: ContactPair) -> float:
        """Tangential velocity of the surfaces past each other where they touch, m/s."""
        second = contact.partner.radius_m if contact.partner is not None else 0.0
        return (
            self.tangential_m_s
            + contact.particle.radius_m * self.spin_rad_s
            + second * self.partner_spin_rad_s
        )


def largest_overlap(contact: ContactPair, speed_m_s: float) -> float:
    """Largest overlap of an elastic impact, m (Johnson 1985, eq. 11.23)."""
    energy = 15 * contact.mass_kg * speed_m_s**2
    return float((energy / (16 * contact.modulus_pa * math.sqrt(contact.radius_m))) ** 0.4)


def hertz_force(contact: ContactPair, overlap_m: Floats | float) -> Floats:
    """Elastic normal force, N (Johnson 1985, eq. 4.23)."""
    stiffness = 4 / 3 * contact.modulus_pa * np.sqrt(contact.radius_m)
    return np.asarray(stiffness * np.power(overlap_m, 1.5))


def elastic_time(contact: ContactPair, speed_m_s: float) -> float:
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


def sliding_impact(contact: ContactPair, before: RelativeMotion) -> RelativeMotion | None:
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
    return RelativeMotion(
        contact.rebound * before.normal_m_s,
        before.tangential_m_s - way * drop,
        before.spin_rad_s - contact.particle.spun_rad_s(impulse),
        before.partner_spin_rad_s - (contact.partner.spun_rad_s(impulse) if contact.partner else 0),
    )


# --- the law integrated -----------------------------------------------------------------------


def integrated_impacts(
    contacts: Sequence[ContactPair], before: Sequence[RelativeMotion]
) -> list[RelativeMotion]:
    """Motions after impacts by the contact law, integrated in `_STEPS` steps per contact time.

    The spring is cut back where it exceeds friction, and the dashpot acts only where it does not;
    with the limit, attraction is cut off. Motions are NaN where an impact does not end.
    """
    mass, root, modulus, shear, restitution, friction, limited = np.array(
        [
            (c.mass_kg, math.sqrt(c.radius_m), c.modulus_pa, c.shear_pa, c.restitution,
             c.friction, c.limit_force)
            for c in contacts
        ]
    ).T  # fmt: skip
    partners = [c.partner or _PLANE for c in contacts]
    radius = np.array([[c.particle.radius_m for c in contacts], [p.radius_m for p in partners]])
    masses = np.array([[c.particle.mass_kg for c in contacts], [p.mass_kg for p in partners]])
    with np.errstate(divide="ignore"):
        turn = np.where(radius > 0, 1 / (SPHERE * masses * radius**2), 0.0)
    centres = np.where(radius > 0, 0.5, 0.0)
    # Tsuji et al. 1992 with the exact coefficient of Antypov and Elliott 2011
    alpha = -math.sqrt(5) * np.log(restitution) / np.hypot(math.pi, np.log(restitution))
    normal, tangential = 4 / 3 * modulus * root, 8 * shear * root
    damping = alpha * np.sqrt(mass * normal)
    # the engine damps with the tangential stiffness where the normal force has
    # S_n = 2 E* sqrt(R* d), of which the normal constant is 2/3
    tangential_damping = alpha * np.sqrt(2 / 3 * mass * tangential)
    speed, along, *spins = np.array([astuple(motion) for motion in before]).T
    spin, overlap, spring = np.array(spins), np.zeros(len(mass)), np.zeros(len(mass))
    dt = np.array([elastic_time(*pair) for pair in zip(contacts, speed, strict=True)]) / _STEPS
    for _ in range(_LONGEST * _STEPS):
        overlap = overlap + dt * speed
        dt[overlap <= 0.0] = 0.0  # it has ended
        if not dt.any():
            break
        inside = np.maximum(overlap, 0.0)
        width, fourth = np.sqrt(inside), inside**0.25
        force = normal * inside * width + damping * fourth * speed
        force = np.where((limited > 0) & (force < 0), 0.0, force)
        arm = radius - centres * inside
        patch = along + (arm * spin).sum(axis=0)
        stiffness, most = tangential * width, friction * np.abs(force)
        spring = spring + dt * patch
        slides = stiffness * np.abs(spring) > most
        pull = stiffness * spring + tangential_damping * fourth * patch
        pull = np.where(slides, np.copysign(most, spring), pull)
        with np.errstate(divide="ignore", invalid="ignore"):
            spring = np.where(slides, np.copysign(most / stiffness, spring), spring)
        speed = speed - dt * force / mass
        along = along - dt * pull / mass
        spin = spin - dt * pull * turn * arm
    ends = np.where(dt == 0.0, np.stack([-speed, along, *spin]), math.nan)
    return [RelativeMotion(*map(float, column)) for column in ends.T]

"""An impact of two bodies by the Hertz-Mindlin law: exact formulae, and the law integrated.

The law is that of LIGGGHTS's ``model hertz tangential history``, written down again from its
equations and integrated by scipy with an adaptive step: a second solution on purpose, which shares
no code with LIGGGHTS and no formula of damping with dragdeck.

Sources: K.L. Johnson 1985, Contact Mechanics; R.D. Mindlin 1949, J. Appl. Mech. 16, 259; Y. Tsuji
et al. 1992, Powder Technology 71, 239; D. Antypov, J.A. Elliott 2011, EPL 94, 50004; T. Schwager,
T. Poeschel 2007, Granular Matter 9, 465; A.H. Kharaz et al. 2001, Powder Technology 120, 281.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import gamma

from dragchain.arrays import Floats

CONTACT_TIME = 4 * math.sqrt(math.pi) * gamma(2 / 5) / (5 * gamma(9 / 10))
"""Elastic contact time over (largest overlap / speed), 2.9432 (Johnson 1985, eq. 11.24)."""

SPHERE = 2 / 5
"""Moment of inertia of a solid particle over m R^2."""

SLIDING = 1 + 1 / SPHERE
"""Tangential mobility of the contact point over that of the centre: 7/2."""

_START = 1e-6
"""Overlap at which integration begins and ends, over the largest one."""

_LEAST_OVERLAP_M = 1e-20
"""Stands in for zero where the law divides by the overlap."""

_MOST_SWITCHES = 100
_RELATIVE_ERROR = 1e-8
_LEAST_STEPS = 60


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


@dataclass(frozen=True)
class IntegratedImpact:
    """An integrated impact.

    Attributes
    ----------
    after : RelativeMotion
    duration_s : float
        Until the surfaces part, or with a limited force until the force vanishes.
    overlap_m : float
        The largest one.
    """

    after: RelativeMotion
    duration_s: float
    overlap_m: float


class HertzLaw:
    """Forces of a contact.

    A state is an array of the overlap, its rate, the tangential spring, the tangential velocity of
    the centres past each other, and the two spins, SI units. ``way`` is 0 where the contact
    sticks, else the sign of the sliding velocity.
    """

    def __init__(self, contact: ContactPair) -> None:
        self.contact = contact
        root = math.sqrt(contact.radius_m)
        logarithm = math.log(contact.restitution)
        # Tsuji et al. 1992 with the exact coefficient of Antypov and Elliott 2011
        alpha = -math.sqrt(5) * logarithm / math.hypot(math.pi, logarithm)
        self.normal = 4 / 3 * contact.modulus_pa * root
        self.normal_damping = alpha * math.sqrt(contact.mass_kg * self.normal)
        self.tangential = 8 * contact.shear_pa * root
        # the engine damps with the tangential stiffness where the normal force has
        # S_n = 2 E* sqrt(R* d), of which the normal constant is 2/3
        self.tangential_damping = alpha * math.sqrt(2 / 3 * contact.mass_kg * self.tangential)

    def whole_force(self, state: Floats) -> float:
        """Normal force as if attraction were never cut off, N."""
        overlap = max(state[0], 0.0)
        damping = self.normal_damping * overlap**0.25 * state[1]
        return float(self.normal * overlap**1.5 + damping)

    def normal_force(self, state: Floats) -> float:
        """Normal force, N."""
        force = self.whole_force(state)
        return max(force, 0.0) if self.contact.limit_force else force

    def arms(self, state: Floats) -> tuple[float, float]:
        """Distance of the contact point from the two centres, m; 0 from a plane."""
        partner = self.contact.partner
        second = partner.radius_m - state[0] / 2 if partner is not None else 0.0
        return self.contact.particle.radius_m - state[0] / 2, second

    def patch(self, state: Floats) -> float:
        """Velocity of the surfaces past each other, m/s."""
        first, second = self.arms(state)
        return float(state[3] + first * state[4] + second * state[5])

    def spring_limit(self, state: Floats) -> float:
        """Tangential displacement at which friction gives way, m."""
        stiffness = self.tangential * math.sqrt(max(state[0], _LEAST_OVERLAP_M))
        return self.contact.friction * abs(self.normal_force(state)) / stiffness

    def spring_limit_rate(self, state: Floats) -> float:
        """Rate of `spring_limit`, m/s."""
        overlap, rate = max(state[0], _LEAST_OVERLAP_M), state[1]
        force = self.whole_force(state)
        elastic, damped = self.normal / self.tangential, self.normal_damping / self.tangential
        change = (
            elastic * rate
            - damped / 4 * overlap**-1.25 * rate**2
            - damped * overlap**-0.25 * force / self.contact.mass_kg
        )
        way = 1.0 if self.contact.limit_force else math.copysign(1.0, force)
        return float(self.contact.friction * way * change)

    def friction_force(self, state: Floats, way: int) -> float:
        """Tangential force on the particle, N."""
        if way:
            return -way * self.contact.friction * abs(self.normal_force(state))
        overlap = max(state[0], 0.0)
        spring = self.tangential * math.sqrt(overlap) * state[2]
        return float(-spring - self.tangential_damping * overlap**0.25 * self.patch(state))

    def rates(self, way: int, _time_s: float, state: Floats) -> list[float]:
        """Rates of the state."""
        contact, other = self.contact, self.contact.partner
        force = self.friction_force(state, way)
        first, second = self.arms(state)
        return [
            state[1],
            -self.normal_force(state) / contact.mass_kg,
            0.0 if way else self.patch(state),
            force / contact.mass_kg,
            force * first / contact.particle.inertia_kg_m2,
            force * second / other.inertia_kg_m2 if other is not None else 0.0,
        ]


@dataclass(frozen=True)
class _Event:
    """An event that ends a stretch: a function of the state that falls or rises through zero."""

    function: Callable[[Floats], float]
    direction: float = -1.0
    terminal: bool = True

    def __call__(self, _time_s: float, state: Floats) -> float:
        return self.function(state)


def integrated_impact(contact: ContactPair, before: RelativeMotion) -> IntegratedImpact:
    """Integrate the contact law through one impact.

    Raises
    ------
    ArithmeticError
        The integration fails or does not come to the end of the impact.
    """
    law = HertzLaw(contact)
    unit = largest_overlap(contact, before.normal_m_s)
    period = elastic_time(contact, before.normal_m_s)
    state, way = _begin(law, before, unit)
    speeds = max(before.normal_m_s, abs(before.patch_m_s(contact)))
    tolerance = 1e-10 * np.array([unit, speeds, unit, speeds, *[speeds / contact.radius_m] * 2])
    time, overlap, force = _START * unit / before.normal_m_s, 0.0, 0.0
    repels = law.normal_damping > 0
    for _ in range(_MOST_SWITCHES):
        events = _events(law, way, _START * unit, repels)
        solved = solve_ivp(
            partial(law.rates, way),
            (time, time + 20 * period),
            state,
            events=list(events.values()),
            rtol=_RELATIVE_ERROR,
            atol=tolerance,
            max_step=period / _LEAST_STEPS,
        )
        if solved.status != 1:
            raise ArithmeticError(f"the impact did not end: {solved.message}")
        time, state = float(solved.t[-1]), np.asarray(solved.y[:, -1], dtype=np.float64)
        overlap = max(overlap, float(solved.y[0].max()))
        force = max(force, max(law.normal_force(column) for column in solved.y.T))
        fired = {name for name, at in zip(events, solved.t_events or [], strict=True) if len(at)}
        vanished = contact.limit_force and law.whole_force(state) < 1e-9 * force
        if vanished or "parted" in fired:
            after = RelativeMotion(-float(state[1]), *(float(velocity) for velocity in state[3:]))
            return IntegratedImpact(after, time, overlap)
        if "let_go" in fired:
            repels = False
            state, way = _attracted(law, state)
        else:
            state, way = _switched(law, state, way)
    raise ArithmeticError(f"sticking and sliding took turns {_MOST_SWITCHES} times")


def _begin(law: HertzLaw, before: RelativeMotion, unit_m: float) -> tuple[Floats, int]:
    """State just after touching, and whether it slides at once."""
    spins = before.spin_rad_s, before.partner_spin_rad_s
    state = np.array(
        [_START * unit_m, before.normal_m_s, 0.0, before.tangential_m_s, *spins], dtype=np.float64
    )
    moved = law.patch(state) * _START * unit_m / before.normal_m_s
    limit = law.spring_limit(state)
    if law.contact.friction == 0.0:
        return state, 1
    state[2] = min(max(moved, -limit), limit)
    return state, int(math.copysign(1, moved)) if abs(moved) >= limit and moved else 0


def _events(law: HertzLaw, way: int, least_m: float, repels: bool) -> dict[str, _Event]:
    """Events that end a stretch: parting, sticking or sliding anew, the end of repulsion."""

    def let_go(state: Floats) -> float:
        force = law.whole_force(state)
        return force if state[1] < 0 else abs(force) + 1e-300

    def switched(state: Floats) -> float:
        if law.contact.friction == 0.0:
            return 1.0
        if way:
            return way * law.patch(state) - law.spring_limit_rate(state)
        return float(abs(state[2])) - law.spring_limit(state)

    events = {
        "parted": _Event(lambda state: float(state[0] - least_m)),
        "switched": _Event(switched, -1.0 if way else 1.0),
    }
    return {**events, "let_go": _Event(let_go)} if repels else events


def _attracted(law: HertzLaw, state: Floats) -> tuple[Floats, int]:
    """Go on where repulsion turns into attraction: friction, and with it the spring, is zero."""
    loose = state.copy()
    loose[2] = 0.0
    patch = law.patch(loose)
    slides = abs(patch) > law.spring_limit_rate(loose)
    return loose, int(math.copysign(1, patch)) if slides else 0


def _switched(law: HertzLaw, state: Floats, way: int) -> tuple[Floats, int]:
    """Go on sliding after sticking, or sticking after sliding."""
    if way == 0:
        return state, int(math.copysign(1, state[2]))
    stuck = state.copy()
    stuck[2] = way * law.spring_limit(state)
    return stuck, 0

"""What is taken from recordings, for the checks and for the figures."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.run.kinematics import needed
from evidence.contact_law.impact import SLIDING, SPHERE, Contact, Motion
from evidence.verification.recording import RecordedContact, Recording

Derived = Callable[[Contact, Motion, Motion], float]
"""A quantity of an impact, from its contact and the motions before and after it."""

_BY_SERIES_AND_LIMIT: tuple[str, ...] = ("restitution", "oblique_study", "spin_plane", "time_step")
"""Tests that are run with and without the limit on attraction."""


def series_name(run: Recording) -> str:
    """Materials, and whether attraction is cut off where a test has both."""
    case = run.case
    limit = "limitForce on" if case.limit_force else "limitForce off"
    series = case.series.replace("_", " ")
    name = f"{series}, {limit}" if case.test in _BY_SERIES_AND_LIMIT else series
    steps = case.test in ("time_step", "bounce")
    return f"{name}, {case.steps_per_contact} steps a contact" if steps else name


_OBLIQUE: Mapping[str, Derived] = {
    "tangential_restitution": lambda _, before, after: after.tangential_m_s / before.tangential_m_s,
    "spin_rad_s": lambda _, before, after: after.spin_rad_s,
    "rebound_angle_deg": lambda contact, _, after: math.degrees(
        math.atan2(after.patch_m_s(contact), after.normal_m_s)
    ),
}
_SCALED: Mapping[str, Derived] = {
    "scaled_patch": lambda contact, _, after: (
        after.patch_m_s(contact) / (contact.friction * after.normal_m_s)
    ),
    "scaled_spin": lambda contact, before, after: (
        contact.particle.radius_m * after.spin_rad_s / (contact.friction * before.normal_m_s)
    ),
}
_SPUN: Mapping[str, Derived] = {
    "patch_restitution": lambda contact, before, after: (
        -after.patch_m_s(contact) / before.patch_m_s(contact)
    ),
    "recoil_tangent": lambda contact, _, after: after.patch_m_s(contact) / after.normal_m_s,
}
_SPUN_PAIR: Mapping[str, Derived] = {
    "tangential_m_s": lambda _, before, after: after.tangential_m_s,
    "spin_rad_s": lambda _, before, after: after.spin_rad_s,
}

QUANTITIES: Mapping[str, Mapping[str, Derived]] = {
    "oblique_angle": _OBLIQUE,
    "oblique_study": _OBLIQUE,
    "oblique_tangential": _SCALED,
    "spin_plane": _SPUN,
    "spin_pair": _SPUN_PAIR,
    "spin_pair_same": _SPUN_PAIR,
    "spin_unequal": _SPUN,
}
"""What the paper plots for each test of oblique and spinning impacts."""


def abscissa(impact: RecordedContact, quantity: str) -> float:
    """What the paper plots a quantity against: the angle, or a ratio of speeds."""
    contact, before, test = impact.constants, impact.before, impact.run.case.test
    patch = before.patch_m_s(contact)
    if test in ("oblique_angle", "oblique_study"):
        return impact.value
    if test == "oblique_tangential":
        return patch / (contact.friction * before.normal_m_s)
    if quantity == "recoil_tangent":
        return patch / before.normal_m_s
    if quantity == "patch_restitution":
        slip = SLIDING * contact.friction * (1 + contact.restitution)
        return slip * before.normal_m_s / patch
    return before.spin_rad_s


def convergence(runs: Sequence[Recording]) -> dict[bool, list[tuple[int, float]]]:
    """Steps per contact and error of the rebound, with and without limit."""
    rows: dict[bool, list[tuple[int, float]]] = {False: [], True: []}
    for run in runs:
        error = abs(run.contact.rebound - run.contact.constants.rebound)
        rows[run.case.limit_force].append((run.case.steps_per_contact, error))
    return {limit: sorted(own) for limit, own in rows.items()}


def fitted_order(rows: Sequence[tuple[int, float]]) -> float:
    """Order of convergence: slope of log error over log step."""
    steps, errors = np.array(rows, dtype=np.float64).T
    return -float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def flight_energy(run: Recording) -> tuple[Ints, Floats]:
    """Impacts before each flight of a bouncing particle, and the relative energy of flight."""
    touching = (run.force_n[:, 0] != 0.0).any(axis=1)
    starts = np.flatnonzero(np.diff(touching.astype(np.int8)) == 1) + 1
    free = np.flatnonzero(~touching)
    speed = np.linalg.norm(run.velocity_m_s[free, 0], axis=1)
    return np.searchsorted(starts, free), (speed / speed[0]) ** 2


def momentum_changes(contact: RecordedContact) -> tuple[Floats, Floats]:
    """Change of linear and angular momentum of a closed pair since the first frame, (T, 3).

    Over the sum of the sizes of its parts; angular momentum about the first common centre of mass.
    """
    run, partner = contact.run, needed(contact.partner_at, "partner")
    at = [contact.at, partner]
    particles = [run.particle(row + 1) for row in at]
    mass = np.array([particle.mass_kg for particle in particles])[:, None]
    inertia = np.array([particle.inertia_kg_m2 for particle in particles])[:, None]
    linear = mass * run.velocity_m_s[:, at]
    centre = (mass * run.position_m[0, at]).sum(axis=0) / mass.sum()
    orbital = np.cross(run.position_m[:, at] - centre, linear)
    angular = orbital + inertia * run.spin_rad_s[:, at]
    size = np.linalg.norm(linear[0], axis=1).sum()
    turn = (np.linalg.norm(orbital[0], axis=1) + np.linalg.norm(angular[0], axis=1)).sum()
    total, spun = linear.sum(axis=1), angular.sum(axis=1)
    return (total - total[0]) / size, (spun - spun[0]) / turn


def last_fifth(run: Recording) -> slice:
    """Frames in which a column rests."""
    return slice(-len(run.time_s) // 5, None)


def column_loads(run: Recording) -> list[tuple[Contact, float, float]]:
    """Each contact of the column from the floor up, the weight on it (N), its mean overlap (m)."""
    size, bodies = math.hypot(*run.case.gravity_m_s2), len(run.case.bodies)
    return [
        (
            contact.constants,
            sum(run.particle(number + 1).mass_kg for number in range(at, bodies)) * size,
            float(contact.overlap_m[last_fifth(run)].mean()),
        )
        for at, contact in enumerate(run.contacts)
    ]


def second_half(run: Recording) -> slice:
    """Frames in which a particle on an incline rolls or slips steadily."""
    return slice(len(run.time_s) // 2, None)


def incline_reference(contact: RecordedContact) -> tuple[float, float]:
    """Acceleration of a particle down the incline and of its spin, m/s2 and rad/s2.

    It rolls without slip up to tan(angle) = 7/2 of the friction, and slips beyond.
    """
    case, constants = contact.run.case, contact.constants
    angle, size = math.radians(needed(case.angle_deg, "angle_deg")), math.hypot(*case.gravity_m_s2)
    normal, drive = size * math.cos(angle), size * math.sin(angle)
    friction = min(drive / SLIDING, constants.friction * normal)
    return drive - friction, -friction / (SPHERE * constants.particle.radius_m)


def incline_slopes(contact: RecordedContact) -> tuple[float, float]:
    """The same, fitted to the second half of the run."""
    run, half = contact.run, second_half(contact.run)
    time = run.time_s[half]
    velocity = float(np.polyfit(time, run.velocity_m_s[half, contact.at, 0], 1)[0])
    return velocity, -float(np.polyfit(time, run.spin_rad_s[half, contact.at, 1], 1)[0])

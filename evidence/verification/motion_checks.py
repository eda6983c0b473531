"""Checks of many impacts, of rest and of steady motion."""

import math
from collections.abc import Iterator

import numpy as np

from dragchain.arrays import Floats, Ints
from dragdeck.physics import contact_mechanics as mechanics
from evidence.verification.law import SLIDING, SPHERE
from evidence.verification.quantity_check import EXACT, QuantityCheck
from evidence.verification.recording import RecordedContact, Recording

_CONSERVED = 1e-9
"""Sums of thousands of steps in double precision."""

_BOUNCES = 0.01
"""Energy after 1,000 impacts: one such bounce of ceramic on steel loses half of it."""

_AT_REST = 1e-3
"""What is left of the motion of a column of particles after many of its periods."""

_FITTED = 0.01
"""Slope of a velocity that still carries the ringing of the contact."""


# --- many impacts, rest, steady motion ------------------------------------------------------


def bounce(run: Recording) -> Iterator[QuantityCheck]:
    """Number of impacts, and energy in flight, of a particle between two walls."""
    impacts, energy = flight_energy(run)
    least = float(run.case.impacts or 0)
    yield QuantityCheck("impacts", EXACT, [(math.nan, least, min(float(impacts[-1]), least))], 0.0)
    worst = float(np.abs(energy - 1).max())
    yield QuantityCheck("energy_change", EXACT, [(math.nan, 0.0, worst)], _BOUNCES, 1.0)


def flight_energy(run: Recording) -> tuple[Ints, Floats]:
    """Impacts before each flight of a bouncing particle, and the relative energy of flight."""
    touching = (run.force_n[:, 0] != 0.0).any(axis=1)
    starts = np.flatnonzero(np.diff(touching.astype(np.int8)) == 1) + 1
    free = np.flatnonzero(~touching)
    speed = np.linalg.norm(run.velocity_m_s[free, 0], axis=1)
    return np.searchsorted(starts, free), (speed / speed[0]) ** 2


def momentum(run: Recording) -> Iterator[QuantityCheck]:
    """Linear and angular momentum of pairs that collide freely."""
    changes = [momentum_changes(contact) for contact in run.contacts]
    for at, quantity in enumerate(("linear_momentum_change", "angular_momentum_change")):
        sizes = [np.linalg.norm(change[at], axis=1) for change in changes]
        rows = [(c.value, 0.0, float(s.max())) for c, s in zip(run.contacts, sizes, strict=True)]
        yield QuantityCheck(quantity, EXACT, rows, _CONSERVED, 1.0)


def momentum_changes(contact: RecordedContact) -> tuple[Floats, Floats]:
    """Change of linear and angular momentum of a closed pair since the first frame, (T, 3).

    Over the sum of the sizes of its parts; angular momentum about the first common centre of mass.
    """
    run, partner = contact.run, contact.partner_at
    assert partner is not None
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


def column(run: Recording) -> Iterator[QuantityCheck]:
    """Each contact of the column from the floor up carries the weight above it."""
    at_rest = slice(-len(run.time_s) // 5, None)
    gravity, bodies = math.hypot(*run.case.gravity_m_s2), len(run.case.bodies)
    rows, weights = [], []
    for at, contact in enumerate(run.contacts):
        above = range(at, bodies)
        weights.append(sum(run.particle(number + 1).mass_kg for number in above) * gravity)
        radius, modulus = contact.constants.radius_m, contact.constants.modulus_pa
        hertz = mechanics.hertz_overlap(weights[-1], radius, modulus)
        rows.append((at + 1.0, hertz, float(contact.overlap_m[at_rest].mean())))
    floor = run.wall_force_n["plane"][:, 0, 2]
    row = (math.nan, weights[0], float(floor[at_rest].mean()))
    yield QuantityCheck("floor_force_n", EXACT, [row], _AT_REST)
    yield QuantityCheck("overlap_m", EXACT, rows, _AT_REST)


def incline(run: Recording) -> Iterator[QuantityCheck]:
    """Acceleration and spin of particles that roll or slip down."""
    for at, quantity in enumerate(("acceleration_m_s2", "spin_up_rad_s2")):
        rows = [
            (contact.value, incline_reference(contact)[at], incline_slopes(contact)[at])
            for contact in run.contacts
        ]
        yield QuantityCheck(quantity, EXACT, rows, _FITTED)
    gravity = math.hypot(*run.case.gravity_m_s2) * math.cos(_angle(run))
    force = run.wall_force_n["plane"][_steady(run)]
    rows = [
        (
            contact.value,
            contact.constants.particle.mass_kg * gravity,
            float(force[:, contact.at, 2].mean()),
        )
        for contact in run.contacts
    ]
    yield QuantityCheck("normal_force_n", EXACT, rows, _FITTED)


def _angle(run: Recording) -> float:
    return math.radians(run.case.angle_deg or 0.0)


def _steady(run: Recording) -> slice:
    """Frames in which a particle on an incline rolls or slips steadily."""
    return slice(len(run.time_s) // 2, None)


def incline_reference(contact: RecordedContact) -> tuple[float, float]:
    """Acceleration of a particle down the incline and of its spin, m/s2 and rad/s2.

    It rolls without slip up to tan(angle) = 7/2 of the friction, and slips beyond.
    """
    constants, size = contact.constants, math.hypot(*contact.run.case.gravity_m_s2)
    angle = _angle(contact.run)
    normal, drive = size * math.cos(angle), size * math.sin(angle)
    friction = min(drive / SLIDING, constants.friction * normal)
    return drive - friction, -friction / (SPHERE * constants.particle.radius_m)


def incline_slopes(contact: RecordedContact) -> tuple[float, float]:
    """The same, fitted to the second half of the run."""
    run, half = contact.run, _steady(contact.run)
    time = run.time_s[half]
    velocity = float(np.polyfit(time, run.velocity_m_s[half, contact.at, 0], 1)[0])
    return velocity, -float(np.polyfit(time, run.spin_rad_s[half, contact.at, 1], 1)[0])

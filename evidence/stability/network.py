"""Contacts of a frame, and the critical time step of their network."""

import math
from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats, Ints
from dragdeck.physics.contact_mechanics import damping_ratio, sphere_mass
from dragdeck.physics.contact_network import largest_eigenvalue
from dragdeck.records.case import CaseOfRun


def critical_step(frequency_rad_s: float) -> float:
    """Largest stable step of central differences without damping, ``2 / omega``, s.

    Belytschko 1983, in Computational Methods for Transient Analysis; infinite for no contact.
    """
    return np.inf if frequency_rad_s == 0.0 else 2.0 / frequency_rad_s


def damped_fraction(restitution: float) -> float:
    """Critical step with the contact's damping over that without.

    ``sqrt(1 + z^2) - z`` for velocities that lag half a step (Belytschko 1983), with the damping
    ratio z of LIGGGHTS's Hertz law, ``sqrt(5/6)`` times `damping_ratio`, taken for every mode.
    """
    ratio = math.sqrt(5.0 / 6.0) * damping_ratio(restitution)
    return float(np.hypot(1.0, ratio) - ratio)


# --- contacts of particles with each other, the bowl and the workpiece -------------------------

PARTNERS = ("particle", "bowl", "workpiece")
"""Names of the partners in ``contact_moduli`` of ``case.json``."""

PARTICLE, BOWL, WORKPIECE = range(len(PARTNERS))


@dataclass(frozen=True)
class Contacts:
    """M contacts of N particles.

    Attributes
    ----------
    bodies : (2, M) ndarray of int
        Rows of the particles; N for another body.
    normal : (M, 3) ndarray
        Unit vectors from the first to the second.
    overlap_m : (M,) ndarray
    partner : (M,) ndarray of int
        Index of the second body into `PARTNERS`.
    """

    bodies: Ints
    normal: Floats
    overlap_m: Floats
    partner: Ints

    def overlap_ratio(self, radius_m: Floats) -> float:
        """Largest overlap over the radius of the first body; 0 without a contact."""
        return float((self.overlap_m / radius_m[self.bodies[0]]).max(initial=0.0))


def network_frequency(case: CaseOfRun, sticks: bool, radius_m: Floats, contacts: Contacts) -> float:
    """Largest eigenfrequency of the contacts' network, rotations included, rad/s.

    Stiffnesses are those of `dragdeck.physics.contact_mechanics.stability_number`, without damping:
    ``k_n = 2 E* sqrt(R* d)`` (the derivative of Johnson 1985, eq. 4.23, by the overlap d) and
    ``k_t = 8 G* sqrt(R* d)`` (Mindlin 1949, no slip). Every contact sticks (a sliding one is
    softer, so the frequency is an upper bound). It is 0 where nothing touches.

    Parameters
    ----------
    case : CaseOfRun
        Gives density and effective moduli.
    sticks : bool
        Whether there is friction, and so a tangential stiffness.
    radius_m : (N,) ndarray
        Of the particles; bowl and workpiece count as planes.
    contacts : Contacts

    References
    ----------
    Otsubo, O'Sullivan and Shire (2017), Computers and Geotechnics 86, 67-79.
    """
    if not (contacts.overlap_m > 0.0).any():
        return 0.0
    # another body is the last one: it has no curvature and never moves
    curvature = np.append(1.0 / radius_m, 0.0)
    inverse_mass = np.append(1.0 / sphere_mass(radius_m, case.media.density_kg_m3), 0.0)
    contact_radius = np.sqrt(contacts.overlap_m / curvature[contacts.bodies].sum(axis=0))
    pairs = [case.contact_moduli[name] for name in PARTNERS]
    moduli = np.array([(2 * pair.modulus_pa, 8 * sticks * pair.shear_pa) for pair in pairs])
    stiffness = moduli[contacts.partner].T * contact_radius
    largest = largest_eigenvalue(contacts.bodies, contacts.normal, stiffness, inverse_mass)
    return math.sqrt(max(largest, 0.0))

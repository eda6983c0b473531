"""The critical time step of the contact network of a frame."""

import math
from dataclasses import replace

import numpy as np

from dragchain.arrays import Floats, Ints
from dragdeck.physics.contact_mechanics import damping_ratio
from dragdeck.physics.contact_network import network_number
from dragdeck.records.case import CaseOfRun

Contacts = tuple[Ints, Floats, Floats]
"""Bodies, (2, M), unit vectors from the first to the second, (M, 3), and overlaps in m, (M,), as
`dragdeck.physics.contact_network.touching` has them."""


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


def overlap_ratio(radius_m: Floats, contacts: Contacts) -> float:
    """Largest overlap over the radius of the first body; 0 without a contact."""
    bodies, _, overlap = contacts
    return float((overlap / radius_m[bodies[0]]).max(initial=0.0))


def network_frequency(
    case: CaseOfRun,
    radius_m: Floats,
    contacts: Contacts,
    walls: tuple[str, ...] = ("bowl", "workpiece"),
) -> float:
    """Largest eigenfrequency of a contact network, rotations included, without damping, rad/s.

    That of the `network_number` of elastic contacts, which is ``omega dt / 2``. Every contact with
    friction sticks (a sliding one is softer, so the frequency is an upper bound). It is 0 where
    nothing touches.

    Parameters
    ----------
    case : CaseOfRun
        Gives density and contact constants.
    radius_m : (N,) ndarray
        Of the particles.
    contacts : tuple of ndarray
        Bodies from N on are planes.
    walls : tuple of str
        Their names in ``contact_moduli`` of ``case.json``.
    """
    names = ("particle", *walls)
    elastic = [replace(case.contact_moduli[name], restitution=1.0) for name in names]
    classes = np.append(np.zeros(len(radius_m), dtype=np.int64), range(1, len(names)))
    places = np.zeros((len(radius_m), 3))  # do not matter to spheres
    density = case.media.density_kg_m3
    of_step = network_number(
        places, radius_m, density, contacts, [elastic], 1.0, classes, tolerance=0.0
    )
    return 2.0 * of_step

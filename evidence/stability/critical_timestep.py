"""The critical time step of a loaded contact network."""

import math

import numpy as np

from dragchain.arrays import Floats, Ints
from dragdeck.physics.contact_network import largest_eigenvalue
from dragdeck.physics.damping import damping_ratio


def hertz_stiffness(
    overlap_m: Floats, radius_m: Floats, modulus_pa: Floats, shear_pa: Floats
) -> tuple[Floats, Floats]:
    """Tangent stiffnesses of Hertzian contacts.

    ``k_n = 2 E* sqrt(R* d)`` (the derivative of Johnson 1985, eq. 4.23, by the overlap d) and
    ``k_t = 8 G* sqrt(R* d)`` (Mindlin 1949, no slip).

    Parameters
    ----------
    overlap_m, radius_m : (M,) ndarray
        Overlaps and effective radii.
    modulus_pa, shear_pa : (M,) ndarray
        Effective moduli E* and G*.

    Returns
    -------
    (M,) ndarray, (M,) ndarray
        k_n and k_t, N/m; zero where bodies do not overlap.
    """
    contact_radius = np.sqrt(radius_m * np.maximum(overlap_m, 0.0))
    return 2.0 * modulus_pa * contact_radius, 8.0 * shear_pa * contact_radius


def largest_frequency(
    mass_kg: Floats, a: Ints, b: Ints, normal: Floats, stiffness_n_m: tuple[Floats, Floats]
) -> float:
    """Largest eigenfrequency of a contact network, rotations included.

    The largest eigenvalue of ``M^-1/2 K M^-1/2`` by Lanczos iteration, K being the sum over all
    contacts of ``G^T (k_n n n^T + k_t (1 - n n^T)) G`` with G the relative displacement at the
    contact for unit displacements and rotations of its two bodies. Every contact sticks (a sliding
    one is softer, so the frequency is an upper bound) and nothing is damped.

    Parameters
    ----------
    mass_kg : (N,) ndarray
        Of the particles.
    a, b : (M,) ndarray of int
        The bodies of a contact as rows of the particles; ``b`` is -1 for a wall, which does not
        move.
    normal : (M, 3) ndarray
        Unit vectors from ``a`` to ``b``.
    stiffness_n_m : (M,) ndarray, (M,) ndarray
        Normal and tangential tangent stiffness.

    Returns
    -------
    float
        rad/s; 0 where there are no contacts.

    References
    ----------
    Otsubo, O'Sullivan and Shire (2017), Empirical assessment of the critical time increment in
    explicit particulate discrete element method simulations, Computers and Geotechnics 86, 67-79.
    """
    if not len(a):
        return 0.0
    # a wall is the last body, row -1, and has no inverse mass
    inverse_mass = np.append(1.0 / mass_kg, 0.0)
    stiffness = np.stack(stiffness_n_m)
    largest = largest_eigenvalue(np.stack([a, b]), normal, stiffness, inverse_mass)
    return float(np.sqrt(max(largest, 0.0)))


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

"""The critical time step of a loaded contact network."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import eigsh

from dragchain.arrays import Floats, Ints

_DENSE_BODIES = 20
"""Up to this many bodies the matrix is solved whole."""


@dataclass(frozen=True)
class Network:
    """Particles and their loaded contacts; N particles and M contacts.

    Attributes
    ----------
    radius_m, mass_kg : (N,) ndarray
    a, b : (M,) ndarray of int
        The bodies of a contact as rows of the particles; ``b`` is -1 for a wall, which does not
        move.
    normal : (M, 3) ndarray
        Unit vectors from ``a`` to ``b``.
    normal_stiffness_n_m, tangential_stiffness_n_m : (M,) ndarray
        Tangent stiffnesses.
    """

    radius_m: Floats
    mass_kg: Floats
    a: Ints
    b: Ints
    normal: Floats
    normal_stiffness_n_m: Floats
    tangential_stiffness_n_m: Floats


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


def largest_frequency(network: Network) -> float:
    """Largest eigenfrequency of a contact network, rotations included.

    The largest eigenvalue of ``M^-1/2 K M^-1/2`` by Lanczos iteration, K being the sum over all
    contacts of ``G^T (k_n n n^T + k_t (1 - n n^T)) G`` with G the relative displacement at the
    contact for unit displacements and rotations of its two bodies. Every contact sticks (a sliding
    one is softer, so the frequency is an upper bound) and nothing is damped.

    Parameters
    ----------
    network : Network

    Returns
    -------
    float
        rad/s; 0 where there are no contacts.

    References
    ----------
    Otsubo, O'Sullivan and Shire (2017), Empirical assessment of the critical time increment in
    explicit particulate discrete element method simulations, Computers and Geotechnics 86, 67-79.
    """
    if not len(network.a):
        return 0.0
    matrix = _scaled_stiffness(network)
    if len(network.mass_kg) <= _DENSE_BODIES:
        largest = float(np.linalg.eigvalsh(matrix.toarray())[-1])
    else:
        start = np.random.default_rng(1).normal(size=matrix.shape[0])  # the same result every time
        largest = float(eigsh(matrix, k=1, which="LA", v0=start, return_eigenvectors=False)[0])
    return float(np.sqrt(max(largest, 0.0)))


def critical_step(frequency_rad_s: float) -> float:
    """Largest stable step of central differences without damping, ``2 / omega``, s.

    Belytschko 1983, in Computational Methods for Transient Analysis; infinite for no contact.
    """
    return np.inf if frequency_rad_s == 0.0 else 2.0 / frequency_rad_s


def damped_fraction(restitution: float) -> float:
    """Critical step with the contact's damping over that without.

    ``sqrt(1 + z^2) - z`` for velocities that lag half a step (Belytschko 1983), with the damping
    ratio of the engine's Hertz law, ``z = sqrt(5/6) |ln e| / sqrt(ln^2 e + pi^2)`` (Tsuji et al.
    1992 in the engine's form), taken for every mode.
    """
    log = abs(np.log(restitution))
    ratio = np.sqrt(5.0 / 6.0) * log / np.hypot(log, np.pi)
    return float(np.hypot(1.0, ratio) - ratio)


def _scaled_stiffness(network: Network) -> csr_array:
    """``M^-1/2 K M^-1/2``, (6 N, 6 N).

    For each particle three displacements, then three rotations.
    """
    count = len(network.mass_kg)
    inverse = np.empty((count, 6))
    inverse[:, :3] = 1.0 / np.sqrt(network.mass_kg)[:, None]
    inertia = 0.4 * network.mass_kg * network.radius_m**2
    inverse[:, 3:] = 1.0 / np.sqrt(inertia)[:, None]
    blocks = _blocks(network, inverse)
    places = _places(network)
    held = places >= 0
    rows = np.broadcast_to(places[:, :, None], blocks.shape)
    columns = np.broadcast_to(places[:, None, :], blocks.shape)
    keep = held[:, :, None] & held[:, None, :]
    entries = (blocks[keep], (rows[keep], columns[keep]))
    return csr_array(coo_array(entries, shape=(6 * count, 6 * count)))


def _places(network: Network) -> Ints:
    """Row of each of a contact's 12 freedoms in the whole matrix, (M, 12); -1 for a wall's."""
    steps = np.arange(6)
    first = 6 * network.a[:, None] + steps
    second = np.where(network.b[:, None] >= 0, 6 * network.b[:, None] + steps, -1)
    return np.concatenate([first, second], axis=1)


def _blocks(network: Network, inverse: Floats) -> Floats:
    """Scaled stiffness of each contact, (M, 12, 12)."""
    count = len(network.a)
    normal, wall = network.normal, network.b < 0
    other = np.where(wall, 0, network.b)
    cross = _cross(normal)
    unit = np.broadcast_to(np.eye(3), (count, 3, 3))
    moved = np.concatenate(
        [
            -unit,
            network.radius_m[network.a][:, None, None] * cross,
            unit,
            np.where(wall, 0.0, network.radius_m[other])[:, None, None] * cross,
        ],
        axis=2,
    )
    scale = np.concatenate([inverse[network.a], inverse[other]], axis=1)
    moved = moved * scale[:, None, :]
    along = normal[:, :, None] * normal[:, None, :]
    stiffness = network.normal_stiffness_n_m[:, None, None] * along
    stiffness = stiffness + network.tangential_stiffness_n_m[:, None, None] * (unit - along)
    return np.asarray(np.einsum("mki,mkl,mlj->mij", moved, stiffness, moved))


def _cross(vectors: Floats) -> Floats:
    """Matrices of the cross product ``v x``, (M, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

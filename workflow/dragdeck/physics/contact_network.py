"""The contact network of a packing, and whether a time step is stable on it."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from dragdeck.physics.damping import damping_ratio

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TOLERANCE = 1e-3
"""Relative error of the largest eigenvalue, far below its scatter from frame to frame."""


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


def stability_number(
    centre_m: Floats,
    radius_m: Floats,
    density_kg_m3: float,
    bowl_radius_m: float,
    constants: Sequence[ContactConstants],
    timestep_s: float,
) -> float:
    """Stability number of a time step: above 1 the contacts gain energy from step to step.

    The velocity Verlet scheme of LIGGGHTS evaluates damping forces with the velocity of half a
    step before. A displacement that changes its sign at every step then neither grows nor decays
    if ``(dt^2 K + 2 dt C) u = 4 M u``: the number is the square root of the largest eigenvalue of
    ``M^-1 (dt^2 K + 2 dt C) / 4``. For one contact without damping it is ``omega dt / 2``, for one
    with the damping ratio z it is 1 at ``omega dt = 2 (sqrt(1 + z^2) - z)`` (Belytschko 1983, in
    Computational Methods for Transient Analysis).

    K has the tangent stiffnesses ``k_n = 2 E* sqrt(R* d)`` and ``k_t = 8 G* sqrt(R* d)`` (Hertz
    and Mindlin), C the damping ``2 sqrt(5/6) b sqrt(k m*)`` of LIGGGHTS' Hertz law with
    ``b = |ln e| / sqrt(ln^2 e + pi^2)``; rotations are included, and every contact sticks. The
    workpiece is left out, which can only lower the number.

    Parameters
    ----------
    centre_m, radius_m : (N, 3) and (N,) ndarray
        Of the particles, in a bowl about the z axis with its floor at z = 0.
    density_kg_m3, bowl_radius_m : float
    constants : sequence of ContactConstants
        Of a particle with a particle and with the bowl.
    timestep_s : float

    Returns
    -------
    float
        0 where nothing touches.

    References
    ----------
    Otsubo, O'Sullivan and Shire (2017), Computers and Geotechnics 86, 67-79.
    """
    bodies, normal, overlap = _touching(centre_m, radius_m, bowl_radius_m)
    if not overlap.size:
        return 0.0
    # the bowl is the last body: it has no curvature and never moves
    curvature = np.append(1 / radius_m, 0.0)
    inverse_mass = 3 / (4 * math.pi * density_kg_m3) * curvature**3
    laws = np.array([(*astuple(one), damping_ratio(one.restitution)) for one in constants])
    modulus, shear, _, friction, ratio = laws[(bodies[1] == len(radius_m)).astype(int)].T
    contact_radius = np.sqrt(overlap / curvature[bodies].sum(axis=0))
    stiffness = np.stack([2 * modulus, 8 * shear * (friction > 0)]) * contact_radius
    damping = 2 * math.sqrt(5 / 6) * ratio * np.sqrt(stiffness / inverse_mass[bodies].sum(axis=0))
    weights = timestep_s**2 * stiffness + 2 * timestep_s * damping
    return math.sqrt(largest_eigenvalue(bodies, normal, weights, inverse_mass, _TOLERANCE)) / 2


def largest_eigenvalue(
    bodies: Ints, normal: Floats, weights: Floats, inverse_mass: Floats, tolerance: float = 0.0
) -> float:
    """Largest eigenvalue of ``M^-1/2 W M^-1/2`` of a contact network by Lanczos iteration.

    W adds up all contacts, each with its normal and its tangential weight on the relative
    displacement of the two surfaces; rotations are included.

    Parameters
    ----------
    bodies : (2, M) ndarray of int
        The two bodies of each contact.
    normal : (M, 3) ndarray
        Unit vectors from the first to the second.
    weights : (2, M) ndarray
        Normal and tangential.
    inverse_mass : (N,) ndarray
        Of the bodies; 0 for one that never moves.
    tolerance : float
        Relative error; 0: the machine's.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    a, b = bodies
    ahead, across = weights[:, :, None]
    # rotations count times the radius; the inertia of a sphere is 2/5 m R^2
    scale = np.sqrt(inverse_mass)[:, None] * np.repeat([1, math.sqrt(2.5)], 3)

    def act(shape: Floats) -> Floats:
        moved, turned = np.hsplit(shape.reshape(scale.shape) * scale, 2)
        apart = moved[b] - moved[a] + np.cross(normal, turned[a] + turned[b])
        along = (apart * normal).sum(axis=1, keepdims=True) * normal
        force = ahead * along + across * (apart - along)
        torque, found = np.cross(force, normal), np.zeros_like(scale)
        np.add.at(found, a, np.hstack([-force, torque]))
        np.add.at(found, b, np.hstack([force, torque]))
        return np.asarray((found * scale).ravel())

    operator = LinearOperator((scale.size, scale.size), matvec=act, dtype=np.float64)
    start = np.random.default_rng(1).normal(size=scale.size)  # the same result every time
    return float(eigsh(operator, k=1, v0=start, tol=tolerance, return_eigenvectors=False)[0])


def _touching(centre: Floats, radius: Floats, bowl_radius: float) -> tuple[Ints, Floats, Floats]:
    """Contacts of particles with each other, the floor and the side.

    Returns
    -------
    (2, M), (M, 3) and (M,) ndarray
        Bodies a and b, where N is the bowl; unit vector from a to b; overlap, m.
    """
    from scipy.spatial import KDTree

    first, second = KDTree(centre).query_pairs(2 * radius.max(), output_type="ndarray").T
    everyone, bowl = np.arange(count := len(radius)), np.full(count, count)
    bodies = np.stack([np.r_[first, everyone, everyone], np.r_[second, bowl, bowl]])
    away = np.concatenate([centre[second] - centre[first], centre * [0, 0, -1], centre * [1, 1, 0]])
    distance = np.linalg.norm(away, axis=1)
    reach = np.r_[radius[first] + radius[second], radius, radius - bowl_radius]
    overlap = reach - np.r_[distance[:-count], -distance[-count:]]
    hit = (overlap > 0) & (distance > 0)
    return bodies[:, hit], away[hit] / distance[hit, None], overlap[hit]

"""The contact network of a packing, and whether a time step is stable on it."""

import math
from collections.abc import Sequence
from dataclasses import astuple
from functools import partial
from typing import Protocol

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.physics.contact_mechanics import ContactConstants, damping_ratio
from dragdeck.physics.rigid import Levers, RigidBodies
from dragdeck.physics.walls import Container

_TOLERANCE = 1e-3
"""Relative error of the largest eigenvalue, far below its scatter from frame to frame."""


def stability_number(
    centre_m: Floats,
    radius_m: Floats,
    density_kg_m3: Floats | float,
    bowl: Container,
    constants: Sequence[Sequence[ContactConstants]],
    timestep_s: float,
    classes: Ints | None = None,
    rigid: RigidBodies | None = None,
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
        Of the particles.
    density_kg_m3 : float or (N,) ndarray
    bowl : Container
    constants : sequence of sequence of ContactConstants
        For each class of particles, those with particles of each class and with the bowl.
    timestep_s : float
    classes : (N,) ndarray of int, optional
        Number of each particle's class; of one class if not given.
    rigid : RigidBodies, optional
        The bodies, if particles are spheres of clumps.

    Returns
    -------
    float
        0 where nothing touches.

    References
    ----------
    Otsubo, O'Sullivan and Shire (2017), Computers and Geotechnics 86, 67-79.
    """
    contacts = touching(centre_m, radius_m, bowl.walls)
    number = np.zeros(len(radius_m), dtype=np.int64) if classes is None else classes
    number = np.append(number, len(constants))  # the bowl comes after the classes
    return network_number(
        centre_m, radius_m, density_kg_m3, contacts, constants, timestep_s, number, rigid
    )


def network_number(
    centre_m: Floats,
    radius_m: Floats,
    density_kg_m3: Floats | float,
    contacts: tuple[Ints, Floats, Floats],
    constants: Sequence[Sequence[ContactConstants]],
    timestep_s: float,
    classes: Ints,
    rigid: RigidBodies | None = None,
    tolerance: float = _TOLERANCE,
) -> float:
    """The `stability_number` of given contacts, with walls of any shape.

    Parameters
    ----------
    centre_m, radius_m, density_kg_m3, timestep_s, rigid
        As in `stability_number`.
    contacts : (2, M), (M, 3) and (M,) ndarray
        As in `touching`; bodies from N on are walls, which have no curvature and never move.
    constants : sequence of sequence of ContactConstants
        For each class of particles, those with a body of each class.
    classes : (N + W,) ndarray of int
        Class of each particle, then of each wall.
    tolerance : float
        Relative error of the eigenvalue; 0: the machine's.
    """
    bodies, normal, overlap = contacts
    walls = len(classes) - len(radius_m)
    if rigid is not None:
        owner = np.append(rigid.of_sphere, np.full(walls, len(rigid.mass_kg)))
        apart = owner[bodies[0]] != owner[bodies[1]]
        bodies, normal, overlap = bodies[:, apart], normal[apart], overlap[apart]
    if not overlap.size:
        return 0.0
    curvature = np.append(1 / radius_m, np.zeros(walls))
    inverse_mass = 3 / (4 * math.pi * density_kg_m3) * np.ones_like(radius_m)
    inverse_mass = np.append(inverse_mass, np.zeros(walls)) * curvature**3
    if rigid is not None:
        of_bodies = np.append(1 / rigid.mass_kg, 0.0)
        inverse_mass = of_bodies[owner]
    laws = np.array(
        [
            [
                (*astuple(pair_constants), damping_ratio(pair_constants.restitution))
                for pair_constants in row
            ]
            for row in constants
        ]
    )
    modulus, shear, _, friction, ratio = laws[classes[bodies[0]], classes[bodies[1]]].T
    contact_radius = np.sqrt(overlap / curvature[bodies].sum(axis=0))
    stiffness = np.stack([2 * modulus, 8 * shear * (friction > 0)]) * contact_radius
    damping = 2 * math.sqrt(5 / 6) * ratio * np.sqrt(stiffness / inverse_mass[bodies].sum(axis=0))
    weights = timestep_s**2 * stiffness + 2 * timestep_s * damping
    if rigid is not None:
        point = centre_m[bodies[0]] + (radius_m[bodies[0]] - overlap / 2)[:, None] * normal
        arms = point - np.vstack([rigid.centre_m, np.zeros(3)])[owner[bodies]]
        levers = Levers(arms, np.concatenate([rigid.roots, np.zeros((1, 3, 3))]))
        largest = largest_eigenvalue(owner[bodies], normal, weights, of_bodies, tolerance, levers)
        return math.sqrt(largest) / 2
    return math.sqrt(largest_eigenvalue(bodies, normal, weights, inverse_mass, tolerance)) / 2


def largest_eigenvalue(
    bodies: Ints,
    normal: Floats,
    weights: Floats,
    inverse_mass: Floats,
    tolerance: float = 0.0,
    levers: Levers | None = None,
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
    levers : Levers, optional
        Of bodies that are no spheres.
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
        torque, accelerations = np.cross(force, normal), np.zeros_like(scale)
        np.add.at(accelerations, a, np.hstack([-force, torque]))
        np.add.at(accelerations, b, np.hstack([force, torque]))
        return np.asarray((accelerations * scale).ravel())

    def act_by_levers(levers: Levers, shape: Floats) -> Floats:
        moved, turned = np.hsplit(shape.reshape(scale.shape), 2)
        moved = moved * scale[:, :3]
        turned, (arm_a, arm_b) = np.einsum("nij,nj->ni", levers.roots, turned), levers.arms_m
        apart = moved[b] + np.cross(turned[b], arm_b) - moved[a] - np.cross(turned[a], arm_a)
        along = (apart * normal).sum(axis=1, keepdims=True) * normal
        force = ahead * along + across * (apart - along)
        accelerations = np.zeros_like(scale)
        np.add.at(accelerations, a, np.hstack([-force, -np.cross(arm_a, force)]))
        np.add.at(accelerations, b, np.hstack([force, np.cross(arm_b, force)]))
        torque = np.einsum("nij,nj->ni", levers.roots, accelerations[:, 3:])
        return np.hstack([accelerations[:, :3] * scale[:, :3], torque]).ravel()

    acts = act if levers is None else partial(act_by_levers, levers)
    operator = LinearOperator((scale.size, scale.size), matvec=acts, dtype=np.float64)
    start = np.random.default_rng(1).normal(size=scale.size)  # the same result every time
    return float(eigsh(operator, k=1, v0=start, tol=tolerance, return_eigenvectors=False)[0])


class ContactSurface(Protocol):
    """A part of the surface of a body."""

    def contacts(self, centre_m: Floats) -> tuple[Floats, Floats]:
        """Distances, (N,), and normals towards (N, 3) points, (N, 3)."""


def touching(
    centre: Floats, radius: Floats, *bodies: Sequence[ContactSurface]
) -> tuple[Ints, Floats, Floats]:
    """Contacts of particles with each other and with other bodies, such as a bowl.

    Returns
    -------
    (2, M), (M, 3) and (M,) ndarray
        Bodies a and b, where N is the first other one; unit vector from a to b; overlap, m.
    """
    from scipy.spatial import KDTree

    first, second = KDTree(centre).query_pairs(2 * radius.max(), output_type="ndarray").T
    away = centre[second] - centre[first]
    distance = np.linalg.norm(away, axis=1)
    hit = (distance < radius[first] + radius[second]) & (distance > 0)
    pairs = [np.stack([first, second])[:, hit]]
    normals = [away[hit] / distance[hit, None]]
    overlaps = [(radius[first] + radius[second] - distance)[hit]]
    for body, surfaces in enumerate(bodies, start=len(radius)):
        for surface in surfaces:
            gap, normal = surface.contacts(centre)
            near = np.flatnonzero(gap < radius)
            pairs.append(np.stack([near, np.full(len(near), body)]))
            normals.append(-normal[near])
            overlaps.append((radius - gap)[near])
    return np.hstack(pairs), np.concatenate(normals), np.concatenate(overlaps)

"""Mechanics of contacts and packings: moduli, damping, contact times, limits of LIGGGHTS.

`stability_number` says whether a time step is stable on a whole contact network. All values are
in SI units.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import partial
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dragdeck.arrays import Floats, Ints
from dragdeck.physics.estimates import COORDINATION_ESTIMATE, SOLID_FRACTION_ESTIMATE
from dragdeck.physics.rigid import Levers, RigidBodies
from dragdeck.physics.walls import Container

Size = TypeVar("Size", float, NDArray[np.float64])


class Solid(Protocol):
    """An elastic material."""

    @property
    def youngs_modulus_pa(self) -> float:
        """Young's modulus, Pa."""

    @property
    def poissons_ratio(self) -> float:
        """Poisson's ratio."""

    @property
    def density_kg_m3(self) -> float:
        """Density of the solid, kg/m3."""


def shear_modulus(material: Solid, scale: float = 1.0) -> float:
    """Shear modulus G = E / (2 (1 + nu)), Pa, with E scaled by `scale`."""
    return scale * material.youngs_modulus_pa / (2 * (1 + material.poissons_ratio))


def effective_modulus(first: Solid, second: Solid, scale: float = 1.0) -> float:
    """Effective modulus of a contact, Pa (Johnson 1985, Contact Mechanics, eq. 4.21 ff.)."""
    compliance = sum(
        (1 - material.poissons_ratio**2) / (scale * material.youngs_modulus_pa)
        for material in (first, second)
    )
    return 1 / compliance


def pull_off_force(slope_n_m: float, modulus_pa: float, reduced_radius_m: float) -> float:
    """Largest tension of a contact with an attraction proportional to the overlap, N.

    The attraction ``a d`` minus Hertz's force ``4/3 E* sqrt(R*) d^(3/2)`` is largest at
    ``sqrt(d) = a / (2 E* sqrt(R*))``, where it is ``a^3 / (12 E*^2 R*)``.
    """
    return slope_n_m**3 / (12 * modulus_pa**2 * reduced_radius_m)


def effective_shear(first: Solid, second: Solid, scale: float = 1.0) -> float:
    """Effective shear modulus of a contact, Pa: 1 / G* sums (2 - nu) / G (Mindlin 1949)."""
    bodies = (first, second)
    return 1 / sum((2 - body.poissons_ratio) / shear_modulus(body, scale) for body in bodies)


def rayleigh_time(material: Solid, radius_m: float, scale: float = 1.0) -> float:
    """Travel time of a Rayleigh wave over half the circumference of a particle, s.

    ``pi R sqrt(rho / G) / (0.1631 nu + 0.8766)``, as in LIGGGHTS' ``fix check/timestep/gran``
    (Thornton and Randall 1988, Micromechanics of Granular Materials, 133-142; Sheng et al. 2004,
    Engineering Computations 21, 304-317).
    """
    wave = math.sqrt(material.density_kg_m3 / shear_modulus(material, scale))
    return math.pi * radius_m * wave / (0.1631 * material.poissons_ratio + 0.8766)


def particle_mass(material: Solid, radius_m: float) -> float:
    """Mass of a particle, kg."""
    return sphere_mass(radius_m, material.density_kg_m3)


def sphere_mass(radius_m: Size, density_kg_m3: Size | float) -> Size:
    """Mass of solid spheres, kg."""
    return 4 / 3 * math.pi * radius_m**3 * density_kg_m3


def fall_energy(
    particles: int, density_kg_m3: float, radius_m: float, gravity_m_s2: float
) -> float:
    """Energy of particles that fall by their diameter, N m g d, J: the unit of a settling bed."""
    return particles * sphere_mass(radius_m, density_kg_m3) * gravity_m_s2 * 2 * radius_m


def hertz_contact_time(
    mass_kg: float, radius_m: float, modulus_pa: float, speed_m_s: float
) -> float:
    """Duration of an elastic impact, s (Johnson 1985, eq. 11.24).

    Parameters
    ----------
    mass_kg, radius_m, modulus_pa : float
        Effective mass, radius and modulus of the two bodies.
    speed_m_s : float
        Relative normal speed.
    """
    stiffness = mass_kg**2 / (radius_m * modulus_pa**2 * speed_m_s)
    return 2.87 * float(stiffness**0.2)


def hertz_overlap(force_n: float, radius_m: float, modulus_pa: float) -> float:
    """Overlap under a static normal force, m (Johnson 1985, eq. 4.23)."""
    return float((3 * force_n / (4 * modulus_pa * math.sqrt(radius_m))) ** (2 / 3))


def fall_speed(height_m: float, gravity_m_s2: float) -> float:
    """Speed after a free fall from rest, m/s."""
    return math.sqrt(2 * gravity_m_s2 * height_m)


def fall_time(height_m: float, gravity_m_s2: float) -> float:
    """Duration of a free fall from rest, s."""
    return math.sqrt(2 * height_m / gravity_m_s2)


def wedge_ratio(friction: float, wall: bool) -> float:
    """Size ratio from which friction can hold a sphere between two touching bodies.

    The line through the two contacts of a sphere of radius r makes the angle a with both normals,
    and forces along it need a friction of ``tan(a)``. Between two spheres of radius R this is
    ``sqrt((1 + r / R)^2 - 1)``, between one and a plane ``sqrt(r / R)``.

    Parameters
    ----------
    friction : float
        The smaller one of the two contacts.
    wall : bool
        Whether one of the bodies is a plane.
    """
    if friction == 0:
        return math.inf
    return 1 / friction**2 if wall else 1 / (math.sqrt(1 + friction**2) - 1)


def bed_pressure(density_kg_m3: float, gravity_m_s2: float, depth_m: float) -> float:
    """Weight of the bed above a depth, Pa, at a solid fraction of `SOLID_FRACTION_ESTIMATE`.

    The wall carries a part of it (Janssen 1895), which is left out: the true
    pressure is lower.
    """
    return SOLID_FRACTION_ESTIMATE * density_kg_m3 * gravity_m_s2 * depth_m


def bed_overlap(modulus_pa: float, pressure_pa: float) -> float:
    """Overlap of two particles of a bed under a pressure, over their diameter d: an estimate.

    The mean normal force of a contact is F = pi d^2 p / (z phi) (Agnolin and Roux 2007,
    Physical Review E 76, 061302), here with z = `COORDINATION_ESTIMATE` contacts a particle and
    the solid fraction phi = `SOLID_FRACTION_ESTIMATE`; its overlap is that of `hertz_overlap`.

    Parameters
    ----------
    modulus_pa : float
        Effective modulus of two particles.
    pressure_pa : float
    """
    force = math.pi * pressure_pa / (COORDINATION_ESTIMATE * SOLID_FRACTION_ESTIMATE)
    return hertz_overlap(force, 0.25, modulus_pa)  # of particles with a diameter of 1


def impact_overlap(density_kg_m3: float, modulus_pa: float, speed_m_s: float) -> float:
    """Largest overlap of two equal spheres in an elastic impact, over their diameter.

    ``(15 m v^2 / (16 E* sqrt(R)))^(2/5)`` with effective mass, radius and modulus (Johnson 1985,
    eq. 11.23); the size of the spheres cancels.
    """
    mass = sphere_mass(0.5, density_kg_m3) / 2
    return float((15 * mass * speed_m_s**2 / (16 * modulus_pa * math.sqrt(0.25))) ** 0.4)


def stiffness_number(material: Solid, pressure_pa: float) -> float:
    """How stiff particles are against the pressure on them: (E / ((1 - nu^2) p))^(2/3).

    Agnolin and Roux 2007, Physical Review E 76, 061302: its inverse goes as the
    overlap of a Hertz contact over the diameter.
    """
    modulus = material.youngs_modulus_pa / (1 - material.poissons_ratio**2)
    return float((modulus / pressure_pa) ** (2 / 3))


FAST = 0.1
"""Inertial number above which impacts decide (docs/evidence/windows.md)."""

SOFT_AT_SPEED = (
    "at 1 to 3 m/s, each tenth of Young's modulus gave 1.7 times as many contacts and 0.54 times "
    "the force of each"
)
"""Of a rod in a trough at inertial numbers of 2.4 and 7 (docs/evidence/scaling.md)."""

AT_SPEED = 1.0
"""Inertial number above which that is said."""


def inertial_number(
    shear_rate_per_s: float, diameter_m: float, density_kg_m3: float, pressure_pa: float
) -> float:
    """Time in which the pressure moves a particle by its size, over that of the shear.

    I = rate d / sqrt(p / rho): GDR MiDi 2004, European Physical Journal E 14, 341;
    da Cruz et al. 2005, Physical Review E 72, 021309. Small where flow is quasi-static.
    """
    return shear_rate_per_s * diameter_m / math.sqrt(pressure_pa / density_kg_m3)


def damping_ratio(restitution: float) -> float:
    """Damping ratio ``|ln e| / sqrt(ln^2 e + pi^2)`` of a contact with restitution e.

    LIGGGHTS multiplies it with ``sqrt(5/6)`` in its Hertz law (Tsuji, Tanaka and Ishida 1992,
    Powder Technology 71, 239-250).
    """
    log = math.log(restitution)
    return -log / math.hypot(log, math.pi)


# --- the contact network of a packing ------------------------------------------------------------


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
        largest = largest_eigenvalue(owner[bodies], normal, weights, of_bodies, _TOLERANCE, levers)
        return math.sqrt(largest) / 2
    return math.sqrt(largest_eigenvalue(bodies, normal, weights, inverse_mass, _TOLERANCE)) / 2


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

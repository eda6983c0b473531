"""The contacts of particles with each other, the bowl and the workpiece, as a network."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from dragchain.arrays import Floats, Ints
from dragchain.contact_law.hertz import sphere_mass
from dragdeck.decks.case_file import CaseOfStudy
from dragdeck.dumps.frame import Frame
from evidence.stability.critical_timestep import hertz_stiffness, largest_frequency

PARTNERS = ("particle", "bowl", "workpiece")
"""Names of the partners in ``contact_moduli`` of ``case.json``."""

PARTICLE, BOWL, WORKPIECE = range(len(PARTNERS))


@dataclass(frozen=True)
class Contacts:
    """N contacts.

    Attributes
    ----------
    a, b : (N,) ndarray of int
        Rows of the particles; ``b`` is -1 for another body.
    partner : (N,) ndarray of int
        Index of body b into `PARTNERS`.
    normal : (N, 3) ndarray
        Unit vectors from a to b.
    overlap_m : (N,) ndarray
    """

    a: Ints
    b: Ints
    partner: Ints
    normal: Floats
    overlap_m: Floats

    def overlap_ratio(self, radius_m: Floats) -> float:
        """Largest overlap over the radius of body a; 0 without a contact."""
        return float((self.overlap_m / radius_m[self.a]).max(initial=0.0))

    def effective_radius_m(self, radius_m: Floats) -> Floats:
        """Effective radii; bowl and workpiece count as planes."""
        own, other = radius_m[self.a], radius_m[np.where(self.b < 0, 0, self.b)]
        return np.where(self.b < 0, own, own * other / (own + other))


def in_id_order(frame: Frame) -> Frame:
    """A frame with its rows in the order of the particles' ids."""
    return frame.take(np.argsort(frame.columns["particle_id"]))


def centres(frame: Frame) -> Floats:
    """Centres of the particles, (N, 3), m."""
    return frame.vectors("x_m", "y_m", "z_m")


def radii(frame: Frame) -> Floats:
    """Radii of the particles, (N,), m."""
    return frame.vectors("radius_m")[:, 0]


def touching(centre_m: Floats, radius_m: Floats, bowl_radius_m: float) -> Contacts:
    """Contacts of particles with each other, the floor and the side, from where they are."""
    pairs = KDTree(centre_m).query_pairs(2.0 * float(radius_m.max()), output_type="ndarray")
    pairs = pairs.astype(np.int64)
    away = centre_m[pairs[:, 1]] - centre_m[pairs[:, 0]]
    distance = np.linalg.norm(away, axis=1)
    overlap = radius_m[pairs].sum(axis=1) - distance
    hit = overlap > 0.0
    across = np.linalg.norm(centre_m[:, :2], axis=1)
    side, floor = radius_m - (bowl_radius_m - across), radius_m - centre_m[:, 2]
    at_side, at_floor = np.flatnonzero(side > 0.0), np.flatnonzero(floor > 0.0)
    outward = np.zeros((len(at_side), 3))
    outward[:, :2] = centre_m[at_side, :2] / across[at_side, None]
    down = np.tile([0.0, 0.0, -1.0], (len(at_floor), 1))
    particles, walls = int(hit.sum()), len(at_side) + len(at_floor)
    return Contacts(
        a=np.concatenate([pairs[hit, 0], at_side, at_floor]),
        b=np.concatenate([pairs[hit, 1], np.full(walls, -1)]),
        partner=np.repeat([PARTICLE, BOWL], [particles, walls]),
        normal=np.concatenate([away[hit] / distance[hit, None], outward, down]),
        overlap_m=np.concatenate([overlap[hit], side[at_side], floor[at_floor]]),
    )


def network_frequency(
    case: CaseOfStudy,
    sticks: bool,
    radius_m: Floats,
    contacts: Contacts,
    effective_radius_m: Floats | None = None,
) -> float:
    """Largest eigenfrequency of the contacts' network, rad/s.

    Parameters
    ----------
    case : CaseOfStudy
        Gives density and effective moduli.
    sticks : bool
        Whether there is friction, and so a tangential stiffness.
    radius_m : (N,) ndarray
        Of the particles.
    contacts : Contacts
    effective_radius_m : (M,) ndarray, optional
        Of the contacts; from the radii if not given.
    """
    effective = (
        contacts.effective_radius_m(radius_m) if effective_radius_m is None else effective_radius_m
    )
    moduli = [case.contact_moduli[name] for name in PARTNERS]
    modulus = np.array([pair.modulus_pa for pair in moduli])[contacts.partner]
    shear = np.array([pair.shear_pa for pair in moduli])[contacts.partner]
    normal, tangential = hertz_stiffness(contacts.overlap_m, effective, modulus, shear)
    mass = sphere_mass(radius_m, case.media.density_kg_m3)
    stiffness = normal, tangential if sticks else 0.0 * tangential
    return largest_frequency(mass, contacts.a, contacts.b, contacts.normal, stiffness)

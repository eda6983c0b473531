"""Rigid bodies of spheres: where they are, from where their spheres are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.arrays import Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Levers:
    """What turns bodies at M contacts of two bodies each.

    Attributes
    ----------
    arms_m : (2, M, 3) array
        From the centre of mass of each body to the contact.
    roots : (N, 3, 3) array
        Inverse square roots of the tensors of inertia of the bodies, 1/(kg^0.5 m).
    """

    arms_m: Floats
    roots: Floats


@dataclass(frozen=True)
class RigidBodies:
    """B bodies of N spheres.

    Attributes
    ----------
    of_sphere : (N,) array of int
        Body of each sphere.
    centre_m : (B, 3) array
        Centres of mass.
    mass_kg : (B,) array
    roots : (B, 3, 3) array
        As of `Levers`.
    """

    of_sphere: Ints
    centre_m: Floats
    mass_kg: Floats
    roots: Floats


def pose(offsets_m: Floats, centres_m: Floats) -> tuple[Floats, Rotation]:
    """Centres of mass, (N, 3), and orientations of bodies whose spheres are at (N, K, 3) points.

    Parameters
    ----------
    offsets_m : (K, 3) array
        Places of the spheres in the body, from its centre of mass.
    centres_m : (N, K, 3) array

    References
    ----------
    Kabsch (1976), Acta Crystallographica A 32, 922: the rotation is that of least squares; about a
    line on which all spheres lie it has any angle.
    """
    from scipy.spatial.transform import Rotation

    middle, mean = offsets_m.mean(axis=0), centres_m.mean(axis=1)
    moved = centres_m - mean[:, None]
    left, _, right = np.linalg.svd(np.einsum("nki,kj->nij", moved, offsets_m - middle))
    left[np.linalg.det(left @ right) < 0, :, 2] *= -1
    turned = Rotation.from_matrix(left @ right)
    return mean - turned.apply(np.tile(middle, (len(mean), 1))), turned

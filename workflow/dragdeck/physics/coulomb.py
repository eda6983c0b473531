"""Coulomb's limit of friction, to which the forces in dumps of contacts are cut."""

import numpy as np

from dragdeck.arrays import Floats


def within_friction(
    force_n: Floats, normal: Floats, friction: Floats | float, attraction_n: Floats | float = 0.0
) -> tuple[Floats, Floats]:
    """Cut the tangential part of forces to friction times the repulsive normal force.

    The repulsive force is the normal part of the force as written, plus the attraction which the
    contact law subtracts from it.

    LIGGGHTS evaluates the contact law again when it writes a contact. In the step the tangential
    spring of a sliding contact was shortened to the limit; the second evaluation finds it within
    the limit and adds the tangential dashpot, which the limit does not include. The direction of
    the tangential part is kept.

    Parameters
    ----------
    force_n, normal : (N, 3) ndarray
        Forces as written, and unit normals of the contacts in the direction of repulsion.
    friction : float or (N,) ndarray
        Coefficients of friction.
    attraction_n : float or (N,) ndarray
        Magnitudes of the attractive forces, N.

    Returns
    -------
    force_n : (N, 3) ndarray
        The forces within the limit.
    removed_n : (N,) ndarray
        What was cut off the magnitude of the tangential part, N.
    """
    along = np.einsum("ij,ij->i", force_n, normal)
    tangential = force_n - along[:, None] * normal
    size = np.linalg.norm(tangential, axis=1)
    removed = np.maximum(size - friction * np.abs(along + attraction_n), 0.0)
    fraction = np.divide(removed, size, out=np.zeros_like(size), where=size > 0.0)
    return force_n - fraction[:, None] * tangential, removed

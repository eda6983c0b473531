"""Coulomb's limit of friction, to which the forces in dumps of contacts are cut."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def within_friction(
    force_n: Floats, normal: Floats, friction: Floats | float
) -> tuple[Floats, Floats]:
    """Cut the tangential part of forces to friction times the magnitude of the normal part.

    LIGGGHTS evaluates the contact law again when it writes a contact. In the step the tangential
    spring of a sliding contact was shortened to the limit; the second evaluation finds it within
    the limit and adds the tangential dashpot, which the limit does not include. The direction of
    the tangential part is kept.

    Parameters
    ----------
    force_n, normal : (N, 3) ndarray
        Forces as written, and unit normals of the contacts.
    friction : float or (N,) ndarray
        Coefficients of friction.

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
    removed = np.maximum(size - friction * np.abs(along), 0.0)
    fraction = np.divide(removed, size, out=np.zeros_like(size), where=size > 0.0)
    return force_n - fraction[:, None] * tangential, removed

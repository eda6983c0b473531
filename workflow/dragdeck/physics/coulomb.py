"""Coulomb's limit of friction, to which the forces in dumps of contacts are cut."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dragdeck.study.contact_law import Floats, coefficients
from dragdeck.study.media import Ints, class_numbers


@dataclass(frozen=True)
class FrictionLimit:
    """What limits the tangential forces of particles on one body.

    Attributes
    ----------
    friction : float or ndarray
        Coefficient of friction: one, or one per class of particles, (C,), and per class of the
        other particle, (C, C); after `at`, one per contact.
    attractive : mapping
        Coefficients that add an attractive force by name, as simulated; likewise.
    wall : bool
        Whether the body is a wall; otherwise it is another particle.
    first_ids : sequence of int
        First particle of each class, if there are several.
    """

    friction: Floats | float
    attractive: Mapping[str, Floats | float] = field(default_factory=dict)
    wall: bool = True
    first_ids: Sequence[int] = ()

    def at(self, particle_id: Ints, other_id: Ints) -> "FrictionLimit":
        """What limits (N,) contacts; the ids of the other body count if it is a particle."""
        if not self.first_ids:
            return self
        first, second = (class_numbers(ids, self.first_ids) for ids in (particle_id, other_id))
        place = first if self.wall else (first, second)
        attractive = {name: np.asarray(values)[place] for name, values in self.attractive.items()}
        return FrictionLimit(np.asarray(self.friction)[place], attractive, self.wall)

    def attraction_n(self, reduced_radius_m: Floats, overlap_m: Floats) -> Floats:
        """Magnitude of the attractive forces of (N,) contacts, N.

        The reduced radius R* is that of the particle at a wall.
        """
        total = np.zeros_like(overlap_m)
        for name, value in self.attractive.items():
            attraction = coefficients()[name].attraction
            assert attraction is not None, name
            total += attraction(value, reduced_radius_m, np.maximum(overlap_m, 0.0), self.wall)
        return total


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

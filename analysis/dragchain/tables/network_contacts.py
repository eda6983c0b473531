"""All contacts of a network frame in one form: point, force on body a, normal part."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints, places
from dragchain.errors import TableError
from dragchain.tables.columns import CENTRE, FORCES, vector
from dragchain.tables.workpiece_contacts import WallContacts, tangential_force
from dragdeck.dumps.frame import Frame
from dragdeck.physics.coulomb import within_friction
from dragdeck.physics.walls import Wall
from dragdeck.study.contact_law import FrictionLimit

KINDS = ("particle-particle", "particle-workpiece", "particle-floor", "particle-side")
"""Kinds of contact; their position is the code in `ContactRows.kind`."""

BODY_IDS = {"particle-workpiece": 0, "particle-floor": -1, "particle-side": -2}
"""``b_id`` of the bodies that are not particles."""


@dataclass(frozen=True)
class ContactRows:
    """N contacts, forces on body a.

    Attributes
    ----------
    kind : (N,) ndarray of int8
        Index into `KINDS`.
    a_id, b_id : (N,) ndarray of int64
        Body a, a particle, and body b, a particle or one of `BODY_IDS`.
    point_m, force_n : (N, 3) ndarray
        Contact point and force on body a.
    normal_force_n, tangential_force_n, overlap_m : (N,) ndarray
        Normal part of the force, positive in compression; magnitude of the
        rest; overlap.
    normal : (N, 3) ndarray
        Unit vector from the contact into body a.
    """

    kind: NDArray[np.int8]
    a_id: Ints
    b_id: Ints
    point_m: Floats
    force_n: Floats
    normal_force_n: Floats
    tangential_force_n: Floats
    overlap_m: Floats
    normal: Floats


@dataclass(frozen=True)
class _Particles:
    """The particles of a frame in the order of their ids."""

    step: int
    ids: Ints
    centres: Floats
    radii: Floats

    def rows_of(self, ids: Ints) -> Ints:
        """Row of each particle; an error names the first that is not there."""
        rows = places(ids, self.ids)
        lost = np.flatnonzero(rows < 0)
        if lost.size:
            raise TableError(
                f"step {self.step}: particle {int(ids[lost[0]])} is in a contact, but missing "
                f"in particles"
            )
        return rows


def contact_rows(
    particles: Frame,
    contacts: Frame,
    workpiece: WallContacts,
    bowl: WallContacts,
    walls: Sequence[Wall],
    friction: FrictionLimit,
) -> ContactRows:
    """Bring the contacts of one step into one form.

    A contact is one that carries force, whatever the other body is: overlaps without force, where
    damping exceeds the elastic force and tension is suppressed, are left out.

    Parameters
    ----------
    particles, contacts : Frame
        ``particles`` and ``contacts`` of one step.
    workpiece, bowl : WallContacts
        Contacts on the workpiece and on a meshed bowl at the same step.
    walls : sequence of Wall
        Those of a bowl without a mesh.
    friction : FrictionLimit
        Of contacts between particles, to which their forces are cut.

    Returns
    -------
    ContactRows
        Sorted by kind, body a and body b.

    Raises
    ------
    TableError
        If the frames are of different steps, a particle is there twice, or a contact names an
        unknown one.
    """
    if particles.step != contacts.step:
        raise TableError(
            f"the next step of contacts is {contacts.step}, but that of particles is "
            f"{particles.step}"
        )
    particles = particles.by_particle()
    known = _Particles(
        particles.step,
        particles.ids("particle_id"),
        particles.vectors(*CENTRE),
        np.asarray(particles.columns["radius_m"], dtype=np.float64),
    )
    twice = np.flatnonzero(np.diff(known.ids) == 0)
    if twice.size:
        raise TableError(
            f"step {particles.step}: particles contains particle {int(known.ids[twice[0]])} twice"
        )
    groups = [
        _particle_particle(known, contacts, friction),
        _mesh(workpiece.select(~workpiece.silent), "particle-workpiece"),
        *_meshed_bowl(bowl.select(~bowl.silent)),
    ]
    for wall in walls:
        names = vector(f"{wall.name}_force", "n")
        if names[0] in particles.columns:
            groups.append(_wall(known, particles.vectors(*names), wall))
    return _joined(groups)


def _particle_particle(
    particles: _Particles, contacts: Frame, friction: FrictionLimit
) -> ContactRows:
    """Contact point: centre 1 + (R1 - overlap / 2) n, with n from particle 1 to particle 2."""
    contacts = contacts.take(np.flatnonzero(contacts.vectors(*FORCES).any(axis=1)))
    first, second = contacts.ids("particle1_id"), contacts.ids("particle2_id")
    at_first, at_second = particles.rows_of(first), particles.rows_of(second)
    centre = particles.centres[at_first]
    between = particles.centres[at_second] - centre
    away = between / np.linalg.norm(between, axis=1, keepdims=True)
    overlap = np.asarray(contacts.columns["overlap_m"], dtype=np.float64)
    point = centre + (particles.radii[at_first] - 0.5 * overlap)[:, None] * away
    first_m, second_m = particles.radii[at_first], particles.radii[at_second]
    reduced = first_m * second_m / (first_m + second_m)
    limit = friction.at(first, second)
    attraction = limit.attraction_n(reduced, overlap)
    force, _ = within_friction(contacts.vectors(*FORCES), -away, limit.friction, attraction)
    return _rows("particle-particle", first, second, point, force, -away, overlap)


def _wall(particles: _Particles, force_n: Floats, wall: Wall) -> ContactRows:
    """Contact point where the engine has friction act: R - overlap / 2 from the centre."""
    kind = "particle-side" if wall.upright or wall.inwards < 0 else "particle-floor"
    touching = (force_n != 0.0).any(axis=1)
    centre, radius = particles.centres[touching], particles.radii[touching]
    distance, normal = wall.contacts(centre)
    overlap, ids = radius - distance, particles.ids[touching]
    point = centre - (radius - 0.5 * overlap)[:, None] * normal
    others = np.full(len(ids), BODY_IDS[kind])
    return _rows(kind, ids, others, point, force_n[touching], normal, overlap)


def _mesh(wall: WallContacts, kind: str) -> ContactRows:
    others = np.full(len(wall.particle_id), BODY_IDS[kind])
    return _rows(
        kind, wall.particle_id, others, wall.point_m, wall.force_n, wall.normal, wall.overlap_m
    )


def _meshed_bowl(bowl: WallContacts) -> list[ContactRows]:
    """Contacts with a meshed bowl, whose floor is what is less steep than 60 degrees."""
    low = bowl.normal[:, 2] > 0.5
    return [_mesh(bowl.select(low), "particle-floor"), _mesh(bowl.select(~low), "particle-side")]


def _rows(
    kind: str,
    a_id: Ints,
    b_id: Ints,
    point_m: Floats,
    force_n: Floats,
    normal: Floats,
    overlap_m: Floats,
) -> ContactRows:
    """Rows of one kind; `normal` points from the contact into body a."""
    return ContactRows(
        kind=np.full(len(a_id), KINDS.index(kind), dtype=np.int8),
        a_id=a_id,
        b_id=b_id.astype(np.int64),
        point_m=point_m,
        force_n=force_n,
        normal_force_n=np.asarray(np.einsum("ij,ij->i", force_n, normal)),
        tangential_force_n=tangential_force(force_n, normal),
        overlap_m=overlap_m,
        normal=normal,
    )


def _joined(groups: list[ContactRows]) -> ContactRows:
    names = ContactRows.__dataclass_fields__
    parts = [np.concatenate([getattr(group, name) for group in groups]) for name in names]
    rows = ContactRows(*parts)
    order = np.lexsort((rows.b_id, rows.a_id, rows.kind))
    return ContactRows(*(getattr(rows, name)[order] for name in names))

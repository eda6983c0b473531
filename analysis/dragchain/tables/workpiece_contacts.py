"""Contacts on the workpiece: their geometry joined with the forces that were applied.

``workpiece_contacts`` says where the particles touch the workpiece, but its forces are
evaluated a second time for output; ``workpiece_particles`` says what force each particle
received. `join_workpiece_frames` joins the two.

LIGGGHTS counts a particle over a convex edge twice, once for each facet. `_merged` makes one
contact of those of a particle that lie within one contact patch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints, places
from dragchain.errors import TableError
from dragchain.tables.columns import ATTRACTION, CENTRE, FORCES, POINT, SPIN, VELOCITY
from dragdeck.dumps.frame import Columns, Frame
from dragdeck.physics.coulomb import within_friction
from dragdeck.study.contact_law import FrictionLimit

_NORMAL = ("normal_x", "normal_y", "normal_z")


@dataclass(frozen=True)
class Meshes:
    """``mesh_id`` of the workpiece's contacts and of the bowl's, if the bowl is a mesh too."""

    workpiece: int = 0
    bowl: int = 1


_ONE_WORKPIECE = Meshes()


@dataclass(frozen=True)
class WallContacts:
    """N contacts of particles with one body, forces **on the particles**.

    Attributes
    ----------
    particle_id, facet_id : (N,) ndarray of int64
        The particle and the facet of the body.
    point_m : (N, 3) ndarray
        Contact point.
    force_n : (N, 3) ndarray
        Force on the particle as applied.
    normal : (N, 3) ndarray
        Unit vector from the contact point to the particle's centre, the mean of several merged
        contacts; zero where the particle received no force, because no centre is written then.
    surface_m_s : (N, 3) ndarray
        Velocity of the particle's surface at the contact point, v + w x r with r
        from the particle's centre; NaN where the particle received no force, and
        everywhere if ``workpiece_particles`` holds no velocities.
    overlap_m : (N,) ndarray
        Overlap.
    attraction_n : (N,) ndarray
        Magnitude of the attractive force that the contact law includes.
    silent : (N,) ndarray of bool
        Contacts of particles that received no force: they overlap, but damping
        would have made the force attractive and the engine cuts that to zero.
    """

    particle_id: Ints
    facet_id: Ints
    point_m: Floats
    force_n: Floats
    normal: Floats
    surface_m_s: Floats
    overlap_m: Floats
    attraction_n: Floats
    silent: NDArray[np.bool_]

    def __len__(self) -> int:
        """The number of contacts N."""
        return len(self.particle_id)

    def select(self, mask: NDArray[np.bool_] | Ints) -> "WallContacts":
        """Keep the contacts of a mask of shape (N,), or of rows."""
        return WallContacts(*(getattr(self, name)[mask] for name in self.__dataclass_fields__))

    def normal_force_n(self) -> Floats:
        """Component of the force along the normal, shape (N,), positive in compression."""
        return np.asarray(np.einsum("ij,ij->i", self.force_n, self.normal))

    def tangential_force_n(self) -> Floats:
        """Magnitude of what remains of the force, shape (N,)."""
        return tangential_force(self.force_n, self.normal)


@dataclass(frozen=True)
class WorkpieceFrames:
    """What touches the meshes at F steps.

    Attributes
    ----------
    step : (F,) ndarray of int64
        The steps.
    opening : (F,) ndarray of bool
        Whether the forces may have been evaluated anew; see `Frame`.
    workpiece, bowl : WallContacts
        Contacts on the workpiece and, if the bowl is a mesh, on the bowl, step by step.
    workpiece_at : (N,) ndarray of int64
        Row in `step` of each contact on the workpiece.
    unplaced_n, unplaced_at : (K, 3) and (K,) ndarray
        Forces applied to particles for which no contact was written, and their rows in `step`.
    """

    step: Ints
    opening: NDArray[np.bool_]
    workpiece: WallContacts
    bowl: WallContacts
    workpiece_at: Ints
    unplaced_n: Floats
    unplaced_at: Ints


def tangential_force(force_n: Floats, normal: Floats) -> Floats:
    """Magnitude of the part of (N, 3) forces that is normal to (N, 3) unit vectors."""
    along = np.einsum("ij,ij->i", force_n, normal)[:, None] * normal
    return np.asarray(np.linalg.norm(force_n - along, axis=1))


def join_workpiece_frames(
    particles: Sequence[Frame],
    contacts: Sequence[Frame],
    friction: tuple[FrictionLimit, FrictionLimit],
    meshes: Meshes = _ONE_WORKPIECE,
    *,
    merge: bool = True,
) -> WorkpieceFrames:
    """Give every contact the force that its particle received.

    The evaluated forces are cut to the limit of friction, and the contacts of a particle within
    one contact patch become one. The force of a particle with one contact is that contact's. A
    particle with k contacts received A in all while E_1 ... E_k were evaluated for output:
    contact i gets E_i + (A - sum of E) / k, so that the contacts of a particle add
    up to what moved it.

    Parameters
    ----------
    particles, contacts : sequence of Frame
        ``workpiece_particles`` and ``workpiece_contacts`` of the same steps.
    friction : (FrictionLimit, FrictionLimit)
        Of particles on workpiece and bowl.
    meshes : Meshes
        Whose contacts are asked for; those on other workpieces are left out.
    merge : bool
        False for the contacts as LIGGGHTS counts them.

    Returns
    -------
    WorkpieceFrames
        The contacts, sorted by step, particle and facet.

    Raises
    ------
    TableError
        If the frames are of different steps, or a particle comes twice in one.
    """
    for particle, other in zip(particles, contacts, strict=True):
        if particle.step != other.step:
            raise TableError(
                f"the next step of workpiece_particles is {particle.step}, but that of "
                f"workpiece_contacts is {other.step}: both must be written with the same period"
            )
    frames = (*particles, *contacts)
    above = 1 + max(int(frame.ids("particle_id").max(initial=0)) for frame in frames)
    moved, touching = _one_frame(particles, above), _one_frame(contacts, above)
    pushed = moved.take(np.flatnonzero((moved.vectors(*FORCES) != 0.0).any(axis=1))).by_particle()
    known = pushed.ids("particle_id")
    twice = known[1:][np.diff(known) == 0]
    if twice.size:
        raise TableError(
            f"step {particles[twice[0] // above].step}: workpiece_particles contains a particle "
            "more than once"
        )
    touching = _within_friction(touching, pushed, friction, meshes.bowl, above)
    if merge:
        touching = _merged(touching, pushed)
    touching = touching.take(np.lexsort((touching.ids("facet_id"), touching.ids("particle_id"))))
    unplaced = np.ones(len(known), dtype=np.bool_)
    unplaced[_rows_of(touching, pushed)[1]] = False
    placed, mesh = _place(touching, pushed, above), _on(touching)
    facing = mesh == meshes.workpiece
    return WorkpieceFrames(
        np.array([frame.step for frame in particles]),
        np.array([frame.opening for frame in particles]),
        placed.select(facing),
        placed.select(mesh == meshes.bowl),
        touching.ids("particle_id")[facing] // above,
        pushed.vectors(*FORCES)[unplaced],
        known[unplaced] // above,
    )


def _one_frame(frames: Sequence[Frame], above: int) -> Frame:
    """The rows of all frames; `above` times a frame's place is added to its particles' ids."""
    columns: Columns = {
        name: np.concatenate([frame.columns[name] for frame in frames])
        for name in frames[0].columns
    }
    ids = [place * above + frame.ids("particle_id") for place, frame in enumerate(frames)]
    return Frame(frames[0].step, columns | {"particle_id": np.concatenate(ids)})


def _on(contacts: Frame) -> Ints:
    """Mesh of each contact; 0 if it was not written because there is one mesh only."""
    mesh = contacts.columns.get("mesh_id", np.zeros(contacts.rows))
    return np.asarray(mesh, dtype=np.int64)


def _rows_of(contacts: Frame, particles: Frame) -> tuple[NDArray[np.bool_], Ints]:
    """Which contacts (N,) are of particles that received a force, and the rows of those."""
    at = places(contacts.ids("particle_id"), particles.ids("particle_id"))
    return at >= 0, at[at >= 0]


def _within_friction(
    contacts: Frame,
    particles: Frame,
    friction: tuple[FrictionLimit, FrictionLimit],
    bowl: int,
    above: int,
) -> Frame:
    """Add the normals, and cut the evaluated forces on particles that received one."""
    loud, at = _rows_of(contacts, particles)
    forces, points = contacts.vectors(*FORCES), contacts.vectors(*POINT)
    normal = np.zeros_like(points)
    normal[loud] = _unit(particles.vectors(*CENTRE)[at] - points[loud])
    radius = np.asarray(particles.columns["radius_m"][at], dtype=np.float64)
    overlap = np.asarray(contacts.columns["overlap_m"][loud], dtype=np.float64)
    on_bowl = _on(contacts)[loud] == bowl
    ids = contacts.ids("particle_id")[loud] % above
    of_class = [class_limit.at(ids, ids) for class_limit in friction]
    limit = np.where(on_bowl, of_class[1].friction, of_class[0].friction)
    attraction = np.zeros(contacts.rows)
    both = (class_limit.attraction_n(radius, overlap) for class_limit in of_class)
    attraction[loud] = np.where(~on_bowl, *both)
    forces[loud], _ = within_friction(forces[loud], normal[loud], limit, attraction[loud])
    added = (*FORCES, *_NORMAL, ATTRACTION)
    return contacts.replaced(added, np.column_stack([forces, normal, attraction]))


def _merged(contacts: Frame, particles: Frame) -> Frame:
    """Make one contact of those of a particle that lie within one contact patch.

    A sphere of radius R that overlaps a plane by d meets it in a circle of radius sqrt(2 R d).
    Over a convex edge LIGGGHTS finds a second contact in this circle: the point of the edge next
    to the sphere. The deepest contact keeps point, facet and overlap and gets the sum of the
    forces. Its normal is the mean of the normals, weighted by d^(3/2) as Hertz's forces are.
    Contacts farther apart, as in a groove, stay separate.
    """
    depth, body = contacts.columns["overlap_m"], _on(contacts)
    contacts = contacts.take(np.lexsort((-depth, body, contacts.ids("particle_id"))))
    loud, at = _rows_of(contacts, particles)
    overlap = np.maximum(contacts.columns["overlap_m"], 0.0)
    patch = np.full(contacts.rows, -1.0)
    patch[loud] = 2.0 * particles.columns["radius_m"][at] * overlap[loud]
    points = contacts.vectors(*POINT)
    head = _heads(contacts.ids("particle_id"), _on(contacts), points, patch)
    kept, slot = np.unique(head, return_inverse=True)
    shared = np.bincount(slot) > 1
    forces, normals = contacts.vectors(*FORCES), contacts.vectors(*_NORMAL)
    mean = sums(slot, overlap[:, None] ** 1.5 * normals, len(kept))
    normal = normals[kept]
    normal[shared] = _unit(mean[shared])
    attraction = np.bincount(slot, contacts.columns[ATTRACTION], len(kept))
    joined = np.column_stack([sums(slot, forces, len(kept)), normal, attraction])
    return contacts.take(kept).replaced((*FORCES, *_NORMAL, ATTRACTION), joined)


def _heads(particle_id: Ints, body: Ints, points: Floats, patch_m2: Floats) -> Ints:
    """The contact whose patch each of (N,) contacts lies in, itself if in none.

    The contacts of a particle with a body follow each other, deepest first.
    """
    positions = np.arange(len(points))
    new = np.r_[True, (np.diff(particle_id) != 0) | np.diff(body)][: len(points)]
    rank = positions - np.maximum.accumulate(np.where(new, positions, 0))
    head = positions.copy()
    for place in range(1, rank.max(initial=0) + 1):
        for ahead in range(place, 0, -1):
            rows = np.flatnonzero((rank == place) & (head == positions))
            others = rows - ahead
            apart = np.square(points[rows] - points[others]).sum(axis=1)
            inside = (head[others] == others) & (apart <= patch_m2[others])
            head[rows[inside]] = others[inside]
    return head


def _place(contacts: Frame, particles: Frame, above: int) -> WallContacts:
    """Join contacts with the particles that received a force, sorted by their ids."""
    loud, at = _rows_of(contacts, particles)
    evaluated, points = contacts.vectors(*FORCES), contacts.vectors(*POINT)
    force = np.zeros_like(evaluated)
    surface = np.full_like(evaluated, np.nan)
    centre = particles.vectors(*CENTRE)[at]
    force[loud] = _fraction(evaluated[loud], at, particles.vectors(*FORCES))
    if {*VELOCITY, *SPIN} <= particles.columns.keys():
        turning = np.cross(particles.vectors(*SPIN)[at], points[loud] - centre)
        surface[loud] = particles.vectors(*VELOCITY)[at] + turning
    return WallContacts(
        particle_id=contacts.ids("particle_id") % above,
        facet_id=contacts.ids("facet_id"),
        point_m=points,
        force_n=force,
        normal=contacts.vectors(*_NORMAL),
        surface_m_s=surface,
        overlap_m=np.asarray(contacts.columns["overlap_m"], dtype=np.float64),
        attraction_n=np.asarray(contacts.columns[ATTRACTION], dtype=np.float64),
        silent=~loud,
    )


def sums(at: Ints, vectors: Floats, count: int) -> Floats:
    """Sums of (N, 3) vectors by row, (count, 3)."""
    return np.array([np.bincount(at, column, count) for column in vectors.T]).T.copy()


def _fraction(evaluated: Floats, at: Ints, applied: Floats) -> Floats:
    """Correct (N, 3) evaluated forces to add up to (K, 3) applied ones, particle by particle."""
    count = np.bincount(at, minlength=len(applied))
    total = sums(at, evaluated, len(applied))
    missing = (applied - total)[at] / count[at][:, None]
    return np.where(count[at][:, None] == 1, applied[at], evaluated + missing)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if (length == 0.0).any():
        raise TableError("a contact point on the workpiece coincides with a particle's centre")
    return np.asarray(vectors / length)

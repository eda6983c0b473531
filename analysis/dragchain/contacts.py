"""All contacts of a network frame in one form: point, force on body a, normal part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dragchain.errors import TableError
from dragchain.formats import Frame
from dragchain.frames import places
from dragchain.rod import WallContacts, tangential_force

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KINDS = ("ball-ball", "ball-rod", "ball-floor", "ball-side")
"""Kinds of contact; their position is the code in `ContactRows.kind`."""

BODY = {"ball-rod": 0, "ball-floor": -1, "ball-side": -2}
"""``b_id`` of the bodies that are not balls."""

_CENTRE = ("x_m", "y_m", "z_m")
_FORCE = ("force_x_n", "force_y_n", "force_z_n")
_FLOOR = ("floor_force_x_n", "floor_force_y_n", "floor_force_z_n")
_SIDE = ("side_force_x_n", "side_force_y_n", "side_force_z_n")


@dataclass(frozen=True)
class ContactRows:
    """N contacts, forces on body a.

    Attributes
    ----------
    kind : (N,) ndarray of int8
        Index into `KINDS`.
    a_id, b_id : (N,) ndarray of int64
        Body a, a ball, and body b, a ball or one of `BODY`.
    point_m, force_n : (N, 3) ndarray
        Contact point and force on body a.
    normal_force_n, tangential_force_n, overlap_m : (N,) ndarray
        Normal part of the force, positive in compression; magnitude of the
        rest; overlap.
    """

    kind: NDArray[np.int8]
    a_id: Ints
    b_id: Ints
    point_m: Floats
    force_n: Floats
    normal_force_n: Floats
    tangential_force_n: Floats
    overlap_m: Floats


@dataclass(frozen=True)
class _Balls:
    """The balls of a frame in the order of their ids."""

    step: int
    ids: Ints
    centres: Floats
    radii: Floats

    def rows_of(self, ids: Ints) -> Ints:
        """Row of each ball; an error names the first that is not there."""
        rows = places(ids, self.ids)
        lost = np.flatnonzero(rows < 0)
        if lost.size:
            raise TableError(
                f"step {self.step}: ball {int(ids[lost[0]])} is in a contact but not in balls"
            )
        return rows


def contact_rows(
    balls: Frame,
    contacts: Frame,
    rod: WallContacts,
    bowl: WallContacts,
    bowl_radius_m: float,
) -> ContactRows:
    """Bring the contacts of one step into one form.

    A contact with floor, side or tool is one that carries force; overlaps
    without force (`WallContacts.silent`) are left out.

    Parameters
    ----------
    balls, contacts : Frame
        ``balls`` and ``contacts`` of one step.
    rod, bowl : WallContacts
        Contacts on the tool and on a meshed bowl at the same step.
    bowl_radius_m : float
        Inner radius of the bowl, about the z axis.

    Returns
    -------
    ContactRows
        Sorted by kind, body a and body b.

    Raises
    ------
    TableError
        If the frames are of different steps, a ball is there twice, or a contact names an
        unknown one.
    """
    if balls.step != contacts.step:
        raise TableError(f"contacts has step {contacts.step} where balls has step {balls.step}")
    order = np.argsort(balls.columns["ball_id"])
    known = _Balls(
        balls.step,
        np.asarray(balls.columns["ball_id"][order], dtype=np.int64),
        balls.vectors(*_CENTRE)[order],
        np.asarray(balls.columns["radius_m"][order], dtype=np.float64),
    )
    twice = np.flatnonzero(np.diff(known.ids) == 0)
    if twice.size:
        raise TableError(f"step {balls.step}: balls has ball {int(known.ids[twice[0]])} twice")
    smallest = float(known.radii.min(initial=np.inf))
    groups = [
        _ball_ball(known, contacts),
        _mesh(rod.select(~rod.silent), "ball-rod"),
        *_meshed_bowl(bowl.select(~bowl.silent), smallest),
    ]
    if _FLOOR[0] in balls.columns:
        groups.append(_floor(known, balls.vectors(*_FLOOR)[order]))
    if _SIDE[0] in balls.columns:
        groups.append(_side(known, balls.vectors(*_SIDE)[order], bowl_radius_m))
    return _joined(groups)


def _ball_ball(balls: _Balls, contacts: Frame) -> ContactRows:
    """Contact point: centre 1 + (R1 - overlap / 2) n, with n from ball 1 to ball 2."""
    first = np.asarray(contacts.columns["ball1_id"], dtype=np.int64)
    second = np.asarray(contacts.columns["ball2_id"], dtype=np.int64)
    at_first, at_second = balls.rows_of(first), balls.rows_of(second)
    centre = balls.centres[at_first]
    between = balls.centres[at_second] - centre
    away = between / np.linalg.norm(between, axis=1, keepdims=True)
    overlap = np.asarray(contacts.columns["overlap_m"], dtype=np.float64)
    point = centre + (balls.radii[at_first] - 0.5 * overlap)[:, None] * away
    return _rows("ball-ball", first, second, point, contacts.vectors(*_FORCE), -away, overlap)


def _floor(balls: _Balls, force_n: Floats) -> ContactRows:
    touching = (force_n != 0.0).any(axis=1)
    normal = np.tile([0.0, 0.0, 1.0], (int(touching.sum()), 1))
    overlap = balls.radii[touching] - balls.centres[touching, 2]
    return _wall("ball-floor", balls, touching, force_n[touching], normal, overlap)


def _side(balls: _Balls, force_n: Floats, bowl_radius_m: float) -> ContactRows:
    touching = (force_n != 0.0).any(axis=1)
    across = balls.centres[touching, :2]
    distance = np.linalg.norm(across, axis=1)
    normal = np.column_stack([-across / distance[:, None], np.zeros(len(across))])
    overlap = balls.radii[touching] - (bowl_radius_m - distance)
    return _wall("ball-side", balls, touching, force_n[touching], normal, overlap)


def _wall(
    kind: str,
    balls: _Balls,
    touching: NDArray[np.bool_],
    force_n: Floats,
    normal: Floats,
    overlap_m: Floats,
) -> ContactRows:
    """Contact point where the engine has friction act: R - overlap / 2 from the centre."""
    ids = balls.ids[touching]
    reach = balls.radii[touching] - 0.5 * overlap_m
    point = balls.centres[touching] - reach[:, None] * normal
    others = np.full(len(ids), BODY[kind])
    return _rows(kind, ids, others, point, force_n, normal, overlap_m)


def _mesh(wall: WallContacts, kind: str) -> ContactRows:
    others = np.full(len(wall.ball_id), BODY[kind])
    return _rows(
        kind, wall.ball_id, others, wall.point_m, wall.force_n, wall.normal, wall.overlap_m
    )


def _meshed_bowl(bowl: WallContacts, smallest_radius_m: float) -> list[ContactRows]:
    """Contacts with a meshed bowl: a side contact lies as high as a ball's centre, or higher."""
    low = bowl.point_m[:, 2] < 0.5 * smallest_radius_m
    return [_mesh(bowl.select(low), "ball-floor"), _mesh(bowl.select(~low), "ball-side")]


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
    )


def _joined(groups: list[ContactRows]) -> ContactRows:
    names = ContactRows.__dataclass_fields__
    parts = [np.concatenate([getattr(group, name) for group in groups]) for name in names]
    rows = ContactRows(*parts)
    order = np.lexsort((rows.b_id, rows.a_id, rows.kind))
    return ContactRows(*(getattr(rows, name)[order] for name in names))

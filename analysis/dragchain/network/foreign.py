"""Contact network and force chains of a run of another script, from its dumps."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dragchain.arrays import Columns, Floats, Ints, places
from dragchain.errors import TableError
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, frame_of
from dragchain.network.statistics import frame_clusters, frame_statistics
from dragchain.network.write import chain_table
from dragchain.tables.columns import CENTRE, FORCES, POINT
from dragdeck.dumps.frame import Frame

_WALLS = {"workpiece": WORKPIECE, "floor": FLOOR, "side": SIDE}
_NEEDED = ("a_id", "b_id", *FORCES)
_ACROSS = 1.5
"""Distance of the centres of a contact, in sums of radii, beyond which it is across a border."""


class NetworkOfDump(NamedTuple):
    """What `network_of_dump` returns.

    Attributes
    ----------
    network : dict of str to float
        The row of the table ``network``.
    chains : DataFrame
        The rows of the table ``chains``.
    missing : tuple of str
        What the dumps do not have, and what is not known without it.
    """

    network: Mapping[str, float]
    chains: pd.DataFrame
    missing: tuple[str, ...]


def network_of_dump(
    particles: Frame,
    contacts: Frame,
    columns: Mapping[str, str],
    walls: Mapping[str, tuple[Frame, Mapping[str, str]]] | None = None,
    *,
    time_s: float = math.nan,
    direction_rad: float = 0.0,
) -> NetworkOfDump:
    """Statistics of the contact network and force chains of a frame that any script wrote.

    Parameters
    ----------
    particles : Frame
        With ``id``, ``x``, ``y``, ``z``, and ``radius`` or ``diameter``; SI units.
    contacts : Frame
        One row per contact of two particles.
    columns : mapping of str to str
        Columns of `contacts`: for ``a_id`` and ``b_id`` the ids of the particles, for
        ``force_x_n``, ``force_y_n`` and ``force_z_n`` the force on one of them, and, if there,
        for ``point_x_m``, ``point_y_m`` and ``point_z_m`` the contact point.
    walls : mapping of str to (Frame, mapping), optional
        Contacts with the ``workpiece``, ``floor`` and ``side``: frames, and their columns, without
        ``b_id`` and with contact points; forces on the particle.
    time_s, direction_rad : float
        Time of the frame, s, and direction of motion, from which azimuths count.

    Raises
    ------
    TableError
        A column is not there, steps differ, or a contact names a particle that is not there.
    """
    missing = list[str]()
    radius = _radius(particles, missing)
    order = np.argsort(particles.columns["id"])
    ids, radius = particles.columns["id"].astype(np.int64)[order], radius[order]
    centre = np.column_stack([_column(particles, axis) for axis in "xyz"])[order]
    pairs = _between(contacts, columns, (ids, centre, radius), missing)
    every = [pairs]
    for name, (frame, names) in (walls or {}).items():
        every.append(_with_wall(frame, names, name, ids, centre))
    absent = [name for name in _WALLS if name not in (walls or {})]
    if absent:
        missing.append(
            f"contacts with {', '.join(absent)}: coordination numbers do not include them"
            + ("" if walls and "workpiece" in walls and len(absent) < len(_WALLS) - 1
               else "; there are no paths from the workpiece to the bowl")
        )  # fmt: skip
    for frame in [contacts, *(frame for frame, _ in (walls or {}).values())]:
        if frame.step != particles.step:
            raise TableError(f"contacts of step {frame.step}, particles of step {particles.step}")
    rows = {name: np.concatenate([part[name] for part in every]) for name in pairs}
    known = np.nan_to_num(radius, nan=1.0)
    there: Columns = {"particle_id": ids, "radius_m": known, **_vectors(CENTRE, centre)}
    network = frame_of(rows, there, particles.step, time_s, direction_rad)
    chains = chain_table(network)
    if np.isnan(radius).any():
        chains = chains[chains["definition"] != "peters"].reset_index(drop=True)
    statistics = frame_statistics(network, frame_clusters(network))
    return NetworkOfDump(statistics, chains, tuple(missing))


def _radius(particles: Frame, missing: list[str]) -> Floats:
    for name, factor in (("radius", 1.0), ("diameter", 0.5)):
        if name in particles.columns:
            return factor * particles.columns[name].astype(np.float64)
    missing.append("radius: stresses, and with them the chains of Peters et al., are not known")
    return np.full(particles.rows, np.nan)


def _between(
    contacts: Frame,
    columns: Mapping[str, str],
    bodies: tuple[Ints, Floats, Floats],
    missing: list[str],
) -> dict[str, Any]:
    """Contacts of two particles, forces on the first; those across a border are left out."""
    ids, centre, radius = bodies
    pair = [_column(contacts, columns.get(name, name)).astype(np.int64) for name in _NEEDED[:2]]
    a, b = (_rows(number, ids) for number in pair)
    force = np.column_stack([_column(contacts, columns.get(name, name)) for name in FORCES])
    line = centre[a] - centre[b]
    distance = np.linalg.norm(line, axis=1)
    near = ~(distance > _ACROSS * (radius[a] + radius[b]))
    if not near.all():
        missing.append(
            f"{np.count_nonzero(~near)} of {len(near)} contacts are across a periodic border: "
            "left out"
        )
    normal = line / distance[:, None]
    pressing = np.einsum("kc,kc->k", force, normal)
    if pressing[near].sum() < 0.0:
        missing.append("forces on a_id: those in the dump are forces on b_id, and were turned")
        force, pressing = -force, -pressing
    if all(columns.get(name, name) in contacts.columns for name in POINT):
        point = np.column_stack([_column(contacts, columns.get(name, name)) for name in POINT])
    else:
        missing.append("contact points: they lie on the line of centres, divided by the radii")
        share = np.nan_to_num(radius[b] / (radius[a] + radius[b]), nan=0.5)
        point = centre[b] + share[:, None] * line
    return {
        "a_id": pair[0][near],
        "b_id": pair[1][near],
        **_vectors(POINT, point[near]),
        **_vectors(FORCES, force[near]),
        "normal_force_n": pressing[near],
    }


def _with_wall(
    frame: Frame, columns: Mapping[str, str], name: str, ids: Ints, centre: Floats
) -> dict[str, Any]:
    """Contacts of particles with a wall."""
    if name not in _WALLS:
        raise TableError(f"no such wall {name!r}: one of {', '.join(_WALLS)}")
    number = _column(frame, columns.get("a_id", "a_id")).astype(np.int64)
    force, point = (
        np.column_stack([_column(frame, columns.get(axis, axis)) for axis in axes])
        for axes in (FORCES, POINT)
    )
    normal = centre[_rows(number, ids)] - point
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return {
        "a_id": number,
        "b_id": np.full(len(number), _WALLS[name]),
        **_vectors(POINT, point),
        **_vectors(FORCES, force),
        "normal_force_n": np.einsum("kc,kc->k", force, normal),
    }


def _rows(numbers: Ints, ids: Ints) -> Ints:
    rows = places(numbers, ids)
    if (rows < 0).any():
        raise TableError(f"particle {numbers[rows < 0][0]} is in a contact, but not in the dump")
    return rows


def _column(frame: Frame, name: str) -> Floats:
    if name not in frame.columns:
        names = ", ".join(frame.columns)
        raise TableError(f"step {frame.step} of the dump has no column {name!r}; it has {names}")
    return np.asarray(frame.columns[name], dtype=np.float64)


def _vectors(names: Sequence[str], values: Floats) -> dict[str, Floats]:
    return dict(zip(names, values.T, strict=True))

"""Force chains of one network frame, by two definitions.

``peters``
    Quasi-linear chains of highly stressed particles (Peters, Muthuswamy, Wibowo and Tordesillas
    2005, Phys. Rev. E 72, 041307), see `peters_rows`.
``widest_path``
    For each strong workpiece contact the path through strong contacts to the bowl whose weakest
    contact is strongest, see `widest_paths`.

As long as no two contacts bear the same force, no result depends on the numbering of the particles
or on the order of the contacts. Where equal forces leave a choice, the contact counts that comes
first in the frame, which in ``contacts.parquet`` is the one with the lower ids.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.network import graph_kernels as kernels
from dragchain.network.frame import WORKPIECE, NetworkFrame
from dragchain.tables.workpiece_contacts import sums

ALPHA_RAD = np.pi / 4
"""Largest angle between a particle's principal direction and the line to the next particle of a
chain."""

LEAST_PARTICLES = 3
"""Fewer particles are no chain (Peters et al. 2005)."""


@dataclass(frozen=True)
class WidestPath:
    """A path from a workpiece contact to the bowl.

    Attributes
    ----------
    particles : sequence of int
        Rows of the frame's particles, from the workpiece on; only the particle on the workpiece if
        `end` is None.
    contacts : sequence of int
        Rows of the frame's contacts in the same order, the workpiece's first and the bowl's last.
    end : int or None
        `FLOOR` or `SIDE`, None if no path of strong contacts leads to the bowl.
    """

    particles: tuple[int, ...]
    contacts: tuple[int, ...]
    end: int | None


@dataclass(frozen=True)
class ChainRows:
    """C chains, one after another, as rows of a frame.

    Attributes
    ----------
    particles, contacts : (K,) and (L,) ndarray of int64
        Rows of the particles and of the contacts, in the order of each chain.
    particle_starts, contact_starts : (C + 1,) ndarray of int64
        Where each chain begins in `particles` and in `contacts`, and where the last one ends.
    """

    particles: Ints
    contacts: Ints
    particle_starts: Ints
    contact_starts: Ints

    def __len__(self) -> int:
        return len(self.particle_starts) - 1

    def particle_lists(self) -> list[list[int]]:
        """The rows of each chain's particles."""
        return split_chains(self.particles, self.particle_starts)


def split_chains(values: Ints, starts: Ints) -> list[list[int]]:
    """Values from each start to the next."""
    flat, at = values.tolist(), starts.tolist()
    return [flat[begin:end] for begin, end in pairwise(at)]


# --- stress and Peters' chains ---------------------------------------------------------------


def particle_stress(frame: NetworkFrame) -> Floats:
    """Each particle's mean stress tensor in Pa, compression positive, (N, 3, 3).

    The sum over the particle's contacts of branch vector (centre to contact point) times force on
    the particle, over the particle's volume, made symmetric (Weber 1966; Peters et al. 2005, eq.
    1). Contacts with workpiece and bowl count too.
    """
    inner = np.flatnonzero(frame.between_particles())
    particle = np.concatenate([frame.a, frame.b[inner]])
    contact = np.concatenate([np.arange(len(frame.a)), inner])
    force = np.concatenate([-frame.force, frame.force[inner]])
    branch = frame.point[contact] - frame.centre[particle]
    moments = (branch[:, :, None] * force[:, None, :]).reshape(-1, 9)
    total = sums(particle, moments, len(frame.centre)).reshape(-1, 3, 3)
    volume = 4.0 / 3.0 * np.pi * frame.radius**3
    return (total + total.transpose(0, 2, 1)) / (2.0 * volume[:, None, None])


def major_stress(stress: Floats) -> tuple[Floats, Floats]:
    """The major compressive principal stress in Pa, (N,), and its axis, (N, 3)."""
    values, vectors = np.linalg.eigh(stress)
    return values[:, -1], vectors[:, :, -1]


def peters_rows(frame: NetworkFrame, major: tuple[Floats, Floats] | None = None) -> ChainRows:
    """The quasi-linear force chains, with the contacts between their particles.

    A particle is highly stressed when its major compressive principal stress is above the mean of
    all particles. Two highly stressed particles in contact are linked when the line of their
    centres is within `ALPHA_RAD` of the principal axis of both; at least `LEAST_PARTICLES` linked
    particles are a chain (Peters et al. 2005). Ours is the rule for more than one candidate at the
    same end of a particle: candidates are taken by falling normal force (of equal ones the first
    of the frame), each end of an axis holds one link, and no link closes a ring, so that every
    chain is a path and no particle is in two chains. A chain starts at its higher end, and the
    chains come by the height of their starts.
    `major` is what `major_stress` returns for the frame, if it is known already.
    """
    stress, axis = major_stress(particle_stress(frame)) if major is None else major
    high = stress > stress.mean() if stress.size else stress > 0.0
    candidates, end = _candidates(frame, high, axis)
    near, by = kernels.link_particles(
        frame.particle_id.size, frame.a[candidates], frame.b[candidates], end[0], end[1]
    )
    ends = np.flatnonzero((near >= 0).sum(axis=1) == 1)
    ends = ends[np.lexsort(-frame.centre[ends].T)]
    particles, pairs, starts = kernels.walk_links(near, by, ends, LEAST_PARTICLES)
    return ChainRows(particles, candidates[pairs], starts, starts - np.arange(len(starts)))


def _candidates(
    frame: NetworkFrame, high: NDArray[np.bool_], axis: Floats
) -> tuple[Ints, NDArray[np.bool_]]:
    """The linkable contacts by falling force, and at which end of either axis they link."""
    inner = np.flatnonzero(frame.between_particles())
    inner = inner[high[frame.a[inner]] & high[frame.b[inner]]]
    first, second = frame.a[inner], frame.b[inner]
    line = frame.centre[second] - frame.centre[first]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    cosine = np.stack(
        [np.einsum("ci,ci->c", axis[first], line), -np.einsum("ci,ci->c", axis[second], line)]
    )
    aligned = np.flatnonzero((np.abs(cosine) >= np.cos(ALPHA_RAD)).all(axis=0))
    aligned = aligned[np.argsort(-frame.normal_force[inner[aligned]], kind="stable")]
    return inner[aligned], cosine[:, aligned] > 0


# --- paths from the workpiece to the bowl ----------------------------------------------------


def widest_paths(frame: NetworkFrame) -> list[WidestPath]:
    """Return one path for each strong workpiece contact, by falling force of that contact.

    Contacts whose normal force is above the mean of all the frame's contacts are strong. A path
    leads from the workpiece contact through strong contacts between particles to a strong contact
    with floor or side. Of all such paths the widest counts: the one whose weakest contact (its
    bottleneck, workpiece and bowl contacts included) is strongest; among several the
    one with the fewest contacts, then the one with the largest sum of forces, then the one that is
    found first from the workpiece on, level by level, where contacts are taken in the order of the
    frame. The widest path of a graph runs along its maximum spanning tree (Hu 1961, Oper. Res. 9,
    898-900); the tie rule is ours.
    """
    rows = path_rows(frame)
    pairs = zip(
        rows.particle_lists(), split_chains(rows.contacts, rows.contact_starts), strict=True
    )
    paths = []
    for particles, links in pairs:
        end = int(frame.other[links[-1]]) if len(links) > 1 else None
        paths.append(WidestPath(tuple(particles), tuple(links), end))
    return paths


def path_rows(frame: NetworkFrame) -> ChainRows:
    """The paths of `widest_paths`; one that leads nowhere has the workpiece contact alone."""
    force = frame.normal_force
    strong = np.flatnonzero(force > frame.mean_force_n())
    workpieces = strong[frame.other[strong] == WORKPIECE]
    workpieces = workpieces[np.argsort(-force[workpieces], kind="stable")]
    links = strong[frame.other[strong] != WORKPIECE]
    bowl = frame.particle_id.size
    ends = frame.a[links], np.where(frame.between_particles()[links], frame.b[links], bowl)
    strength, start = force[links], frame.a[workpieces]
    width = kernels.widths(*ends, strength, np.argsort(-strength), bowl + 1, bowl)[start]
    least = np.minimum(width, force[workpieces])
    net, space = adjacency(*ends, bowl + 1), kernels.search_space(bowl + 1)
    particles, contacts = [], []
    for number in range(len(workpieces)):
        particle, link = start[number : number + 1], links[:0]
        if width[number] > -np.inf:
            particle, link = kernels.shortest_path(
                net, strength, start[number], bowl, least[number], number, space
            )
        particles.append(particle)
        contacts.append(np.append(workpieces[number], links[link]))
    return ChainRows(_joined(particles), _joined(contacts), _starts(particles), _starts(contacts))


def adjacency(a: Ints, b: Ints, nodes: int) -> tuple[Ints, NDArray[np.int32], NDArray[np.int32]]:
    """List the edges of every node in their order.

    Parameters
    ----------
    a, b : (M,) ndarray
        The nodes that each edge joins.
    nodes : int
        Number of nodes.

    Returns
    -------
    starts : (nodes + 1,) ndarray
        Where each node's edges begin in the other two, and where the last one's end.
    near, edge : (2 M,) ndarray
        The node on the other side, and the edge.
    """
    ends, others = np.column_stack([a, b]).ravel(), np.column_stack([b, a]).ravel()
    order = np.argsort(ends, kind="stable")
    starts = np.append(0, np.cumsum(np.bincount(ends, minlength=nodes)))
    return starts, others[order].astype(np.int32), (order // 2).astype(np.int32)


def _joined(parts: list[Ints]) -> Ints:
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def _starts(parts: list[Ints]) -> Ints:
    return np.cumsum([0, *map(len, parts)])


def dominant_path(frame: NetworkFrame, paths: Iterable[WidestPath]) -> WidestPath | None:
    """The path to the bowl with the largest bottleneck, or None if no path leads there."""

    def strength(path: WidestPath) -> tuple[float, float]:
        forces = frame.normal_force[list(path.contacts)]
        return float(forces.min()), float(forces.mean())

    whole = [path for path in paths if path.end is not None]
    return max(whole, key=strength) if whole else None

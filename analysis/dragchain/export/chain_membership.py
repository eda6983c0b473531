"""Which particles and contacts of a network frame are in the chains that its tables list."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Ints
from dragchain.errors import TableError
from dragchain.network.frame import KINDS, WORKPIECE, NetworkFrame

_BODY = {name: body for body, name in KINDS.items()}


@dataclass(frozen=True)
class Membership:
    """Chains of a frame with N particles and M contacts.

    Attributes
    ----------
    particle_peters, contact_peters : (N,) and (M,) int
        Number of the chain by Peters et al. within the frame, from 1; 0: in none.
    particle_paths, contact_paths : (N,) and (M,) int
        Through how many workpiece paths to the bowl a particle or contact carries load.
    particle_dominant, contact_dominant : (N,) and (M,) int
        1 on the frame's dominant workpiece path, else 0.
    """

    particle_peters: Ints
    contact_peters: Ints
    particle_paths: Ints
    contact_paths: Ints
    particle_dominant: Ints
    contact_dominant: Ints


def chain_membership(frame: NetworkFrame, chains: pd.DataFrame) -> Membership:
    """Which particles and contacts are in the chains of a frame.

    Parameters
    ----------
    frame : NetworkFrame
        The frame.
    chains : DataFrame
        Its rows of ``chains.parquet``, in the order of the table.

    Raises
    ------
    TableError
        If a chain names a particle or a contact that the frame does not have.
    """
    found = Membership(
        *(np.zeros(size, dtype=np.int64) for _ in range(3) for size in _sizes(frame))
    )
    links = _Links(frame)
    peters = chains[chains["definition"] == "peters"]
    for number, ids in enumerate(peters["particle_ids"], start=1):
        particles = links.particles(ids)
        found.particle_peters[particles] = number
        found.contact_peters[links.between(particles)] = number
    for particles, contacts, dominant in _paths(
        links, chains[chains["definition"] == "widest_path"]
    ):
        found.particle_paths[particles] += 1
        found.contact_paths[contacts] += 1
        if dominant:
            found.particle_dominant[particles] = 1
            found.contact_dominant[contacts] = 1
    return found


def _sizes(frame: NetworkFrame) -> tuple[int, int]:
    return frame.particle_id.size, frame.normal_force.size


def _paths(links: "_Links", paths: pd.DataFrame) -> Iterator[tuple[Ints, Ints, bool]]:
    """Yield particles and contacts of every workpiece path that reaches the bowl.

    A path has a row for each strong workpiece contact, by falling force: of several rows that
    begin at one particle, the n-th belongs to its n-th strongest contact with the workpiece. At the
    bowl a path ends in the particle's strongest contact of its kind.
    """
    begun: dict[int, int] = {}
    columns = [paths[name] for name in ("particle_ids", "reaches_bowl", "end_kind", "dominant")]
    for ids, reaches_bowl, end_kind, dominant in zip(*columns, strict=True):
        particles = links.particles(ids)
        first, last = int(particles[0]), int(particles[-1])
        rank = begun.get(first, 0)
        begun[first] = rank + 1
        if reaches_bowl:
            workpiece = links.with_body(first, WORKPIECE, rank)
            bowl = links.with_body(last, _BODY[end_kind], 0)
            yield particles, np.array([workpiece, *links.between(particles), bowl]), bool(dominant)


class _Links:
    """Finds the contacts of a frame by what they are between."""

    def __init__(self, frame: NetworkFrame) -> None:
        self._frame = frame
        inner = np.flatnonzero(frame.between_particles())
        keys = self._keys(frame.a[inner], frame.b[inner])
        order = np.argsort(keys)
        self._inner, self._sorted = inner[order], keys[order]
        self._walls = np.flatnonzero(~frame.between_particles())

    def _keys(self, first: Ints, second: Ints) -> Ints:
        size = self._frame.particle_id.size
        return np.minimum(first, second) * size + np.maximum(first, second)

    def particles(self, ids: NDArray[np.int64]) -> Ints:
        """Rows of particles by their ids."""
        return self._found(self._frame.particle_id, np.asarray(ids, dtype=np.int64), "particle")

    def between(self, particles: Ints) -> Ints:
        """Contacts of each particle of a chain with the next."""
        return self._inner[
            self._found(self._sorted, self._keys(particles[:-1], particles[1:]), "contact")
        ]

    def _found(self, known: Ints, wanted: Ints, what: str) -> Ints:
        at = np.minimum(np.searchsorted(known, wanted), max(known.size - 1, 0))
        if wanted.size and (not known.size or (known[at] != wanted).any()):
            raise self._missing(what)
        return at

    def with_body(self, particle: int, body: int, rank: int) -> int:
        """Contact of a particle with workpiece, floor or side; `rank` 0 is the strongest."""
        frame, walls = self._frame, self._walls
        rows = walls[(frame.a[walls] == particle) & (frame.other[walls] == body)]
        if rank >= rows.size:
            raise self._missing("contact")
        return int(rows[np.argsort(-frame.normal_force[rows], kind="stable")[rank]])

    def _missing(self, what: str) -> TableError:
        return TableError(
            f"a chain of step {self._frame.step} has a {what} that is missing in "
            "particles.parquet or"
            " contacts.parquet\n  remedy: make the chains again with `dragchain chains`"
        )

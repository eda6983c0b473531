"""Which balls and contacts of a network frame are in the chains that its tables list."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.errors import TableError
from dragchain.frames import KINDS, ROD, Ints, NetworkFrame

_BODY = {name: body for body, name in KINDS.items()}


@dataclass(frozen=True)
class Membership:
    """Chains of a frame with N balls and M contacts.

    Attributes
    ----------
    ball_peters, contact_peters : (N,) and (M,) int
        Number of the chain by Peters et al. within the frame, from 1; 0: in none.
    ball_paths, contact_paths : (N,) and (M,) int
        Through how many rod paths to the bowl a ball or contact carries load.
    ball_dominant, contact_dominant : (N,) and (M,) int
        1 on the frame's dominant rod path, else 0.
    """

    ball_peters: Ints
    contact_peters: Ints
    ball_paths: Ints
    contact_paths: Ints
    ball_dominant: Ints
    contact_dominant: Ints


def chain_membership(frame: NetworkFrame, chains: pd.DataFrame) -> Membership:
    """Tell which balls and contacts are in the chains of a frame.

    Parameters
    ----------
    frame : NetworkFrame
        The frame.
    chains : DataFrame
        Its rows of ``chains.parquet``, in the order of the table.

    Raises
    ------
    TableError
        If a chain names a ball or a contact that the frame does not have.
    """
    found = Membership(
        *(np.zeros(size, dtype=np.int64) for _ in range(3) for size in _sizes(frame))
    )
    links = _Links(frame)
    peters = chains[chains["definition"] == "peters"]
    for number, ids in enumerate(peters["ball_ids"], start=1):
        balls = links.balls(ids)
        found.ball_peters[balls] = number
        found.contact_peters[links.between(balls)] = number
    for balls, contacts, dominant in _paths(links, chains[chains["definition"] == "rod_path"]):
        found.ball_paths[balls] += 1
        found.contact_paths[contacts] += 1
        if dominant:
            found.ball_dominant[balls] = 1
            found.contact_dominant[contacts] = 1
    return found


def _sizes(frame: NetworkFrame) -> tuple[int, int]:
    return frame.ball_id.size, frame.normal_force.size


def _paths(links: _Links, paths: pd.DataFrame) -> Iterator[tuple[Ints, Ints, bool]]:
    """Yield balls and contacts of every rod path that reaches the bowl.

    A path has a row for each strong rod contact, by falling force: of several rows that
    begin at one ball, the n-th belongs to its n-th strongest contact with the rod. At the
    bowl a path ends in the ball's strongest contact of its kind.
    """
    begun: dict[int, int] = {}
    columns = [paths[name] for name in ("ball_ids", "reaches_bowl", "end_kind", "dominant")]
    for ids, reaches_bowl, end_kind, dominant in zip(*columns, strict=True):
        balls = links.balls(ids)
        first, last = int(balls[0]), int(balls[-1])
        rank = begun.get(first, 0)
        begun[first] = rank + 1
        if reaches_bowl:
            rod = links.with_body(first, ROD, rank)
            bowl = links.with_body(last, _BODY[end_kind], 0)
            yield balls, np.array([rod, *links.between(balls), bowl]), bool(dominant)


class _Links:
    """Finds the contacts of a frame by what they are between."""

    def __init__(self, frame: NetworkFrame) -> None:
        self._frame = frame
        inner = np.flatnonzero(frame.between_balls())
        keys = self._keys(frame.a[inner], frame.b[inner])
        order = np.argsort(keys)
        self._inner, self._sorted = inner[order], keys[order]
        self._walls = np.flatnonzero(~frame.between_balls())

    def _keys(self, first: Ints, second: Ints) -> Ints:
        size = self._frame.ball_id.size
        return np.minimum(first, second) * size + np.maximum(first, second)

    def balls(self, ids: NDArray[np.int64]) -> Ints:
        """Rows of balls by their ids."""
        return self._found(self._frame.ball_id, np.asarray(ids, dtype=np.int64), "ball")

    def between(self, balls: Ints) -> Ints:
        """Contacts of each ball of a chain with the next."""
        return self._inner[self._found(self._sorted, self._keys(balls[:-1], balls[1:]), "contact")]

    def _found(self, known: Ints, wanted: Ints, what: str) -> Ints:
        at = np.minimum(np.searchsorted(known, wanted), max(known.size - 1, 0))
        if wanted.size and (not known.size or (known[at] != wanted).any()):
            raise self._missing(what)
        return at

    def with_body(self, ball: int, body: int, rank: int) -> int:
        """Contact of a ball with tool, floor or side; `rank` 0 is the strongest."""
        frame, walls = self._frame, self._walls
        rows = walls[(frame.a[walls] == ball) & (frame.other[walls] == body)]
        if rank >= rows.size:
            raise self._missing("contact")
        return int(rows[np.argsort(-frame.normal_force[rows], kind="stable")[rank]])

    def _missing(self, what: str) -> TableError:
        return TableError(
            f"a chain of step {self._frame.step} has a {what} that balls.parquet and"
            " contacts.parquet do not have\n  remedy: make the chains again with `dragchain chains`"
        )

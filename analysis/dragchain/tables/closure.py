"""Whether the contacts on the workpiece add up to the force on the workpiece."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.tables.workpiece_contacts import WorkpieceFrames, sums
from dragdeck.documents import Document

LIMIT = 1e-6
"""Largest relative error that passes: far above rounding, far below physics."""

SHARED_LIMIT = 0.05
"""The same where one wall serves workpiece and bowl (``mesh_id`` in workpiece_contacts): a
particle that touches both has one force, which is shared out by estimate."""

_FLOOR_N = 1e-3
"""Smaller forces on the workpiece do not serve as the scale of the error."""


_COLUMNS = ["step", "gap_n", "relative", "opening"]
"""How far the forces of a step miss the force on the workpiece, and what kind of step it is."""


class ClosureRecord(Document):
    """``closure.json``: whether the forces on the workpiece close, and what else was seen.

    Attributes
    ----------
    frames, worst_step, max_relative, max_n
        Frames that were checked, and the worst of them: its step, its error relative to the
        force and in N.
    opening_frames
        Frames that open a file (see `Frame`).
    unplaced_forces, unplaced_max_n
        Forces on particles without a contact.
    silent_contacts
        Contacts that carry no force.
    """

    remedy = "make it with: ./run dragchain tables"

    verdict: Literal["pass", "fail"]
    problem: str | None
    limit: float
    frames: int
    worst_step: int | None
    max_relative: float
    max_n: float
    opening_frames: int
    contacts: int
    unplaced_forces: int
    unplaced_max_n: float
    silent_contacts: int


@dataclass
class Closure:
    """Collects how far the contacts on the workpiece add up to its total force.

    By Newton's third law the forces on the particles and the force on the workpiece add up to zero
    at every step. The error of a step is ``|sum of forces on the particles + force on the
    workpiece| / max(|force on the workpiece|, 1 mN)``. The acceptance check looks at all frames
    but those that open a file (see `Frame`): their error is noted apart.

    Parameters
    ----------
    limit : float
        Largest error that passes.
    """

    limit: float = LIMIT
    contacts: int = 0
    silent: int = 0
    unplaced: int = 0
    unplaced_max_n: float = 0.0
    _parts: list[Floats] = field(default_factory=list)

    def add(self, frames: WorkpieceFrames, workpiece_force_n: Floats) -> NDArray[np.bool_]:
        """Take in the contacts of F steps.

        Parameters
        ----------
        frames : WorkpieceFrames
            The contacts.
        workpiece_force_n : (F, 3) ndarray
            Force on the workpiece at each step; NaN if it was not written.

        Returns
        -------
        (F,) ndarray of bool
            False for a frame that opens a file and whose forces are not the
            applied ones.
        """
        contacts = frames.workpiece
        self.contacts += len(contacts)
        self.silent += int(contacts.silent.sum())
        self.unplaced += len(frames.unplaced_n)
        self.unplaced_max_n = max(self.unplaced_max_n, _largest(frames.unplaced_n))
        errors = _errors(frames, workpiece_force_n)
        self._parts.append(errors[~np.isnan(workpiece_force_n).any(axis=1)])
        return ~(frames.opening & (errors[:, _COLUMNS.index("relative")] > self.limit))

    def _steps(self, *, opening: bool) -> pd.DataFrame:
        """Errors of the steps that open a file, or of all others."""
        rows = np.concatenate([np.empty((0, len(_COLUMNS))), *self._parts])
        errors = pd.DataFrame(rows, columns=_COLUMNS)
        return errors[errors["opening"] == opening]

    def problem(self) -> str | None:
        """What is wrong, or None if the acceptance check passes."""
        errors = self._steps(opening=False)
        if errors.empty:
            return (
                "no step has both workpiece_force and workpiece_particles, so closure "
                "cannot be tested"
            )
        worst = errors.iloc[int(errors["relative"].argmax())]
        if worst["relative"] > self.limit:
            return (
                f"at step {worst['step']:.0f} the forces on the particles miss the force on the "
                f"workpiece by {worst['gap_n']:.3g} N, {worst['relative']:.3g} of it (limit "
                f"{self.limit:g})"
            )
        if self.unplaced_max_n > _FLOOR_N:
            return (
                f"{self.unplaced} forces on particles have no contact in workpiece_contacts,"
                f" the largest {self.unplaced_max_n:.3g} N (limit {_FLOOR_N:g} N)"
            )
        return None

    def record(self) -> ClosureRecord:
        """The content of ``closure.json``."""
        problem, errors = self.problem(), self._steps(opening=False)
        worst = errors.iloc[int(errors["relative"].argmax())] if len(errors) else None
        return ClosureRecord(
            verdict="pass" if problem is None else "fail",
            problem=problem,
            limit=self.limit,
            frames=len(errors),
            worst_step=None if worst is None else int(worst["step"]),
            max_relative=0.0 if worst is None else worst["relative"],
            max_n=0.0 if worst is None else worst["gap_n"],
            opening_frames=len(self._steps(opening=True)),
            contacts=self.contacts,
            unplaced_forces=self.unplaced,
            unplaced_max_n=self.unplaced_max_n,
            silent_contacts=self.silent,
        )


def _errors(frames: WorkpieceFrames, workpiece_force_n: Floats) -> Floats:
    """The `_COLUMNS` of F frames, (F, 4); NaN where the force on the workpiece was not written."""
    count = len(frames.step)
    placed = sums(frames.workpiece_at, frames.workpiece.force_n, count)
    applied = placed + sums(frames.unplaced_at, frames.unplaced_n, count)
    gap = _lengths(applied + workpiece_force_n)
    relative = gap / np.maximum(_lengths(workpiece_force_n), _FLOOR_N)
    return np.column_stack([frames.step, gap, relative, frames.opening])


def _lengths(vectors: Floats) -> Floats:
    return np.array([np.linalg.norm(vector) for vector in vectors], dtype=np.float64)


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max()) if len(vectors) else 0.0

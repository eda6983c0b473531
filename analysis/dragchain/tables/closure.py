"""Whether the contacts on the workpiece add up to the force on the workpiece."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
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


class ClosureRecord(Document):
    """``closure.json``: whether the forces on the workpiece close, and what else was seen.

    Attributes
    ----------
    frames, worst_step, max_relative, max_n
        Frames that were checked, and the worst of them: its step, its error relative to the
        force and in N.
    opening_frames, opening_max_relative
        The same of frames that open a file (see `Frame`).
    unplaced_forces, unplaced_max_n
        Forces on particles without a contact.
    silent_contacts, silent_evaluated_max_n
        Contacts that carry no force, and the largest force that LIGGGHTS evaluated for one.
    evaluated_max_n, evaluated_counted_max_relative, evaluated_counted_mean_relative
        Error of the forces that LIGGGHTS evaluated for output; relative in the frames that
        statistics use, None without any.
    """

    remedy = "make it with: dragchain tables"

    verdict: Literal["pass", "fail"]
    problem: str | None
    limit: float
    force_floor_n: float
    frames: int
    worst_step: int | None
    max_relative: float
    max_n: float
    opening_frames: int
    opening_max_relative: float
    contacts: int
    unplaced_forces: int
    unplaced_max_n: float
    silent_contacts: int
    silent_evaluated_max_n: float
    evaluated_max_n: float
    evaluated_counted_max_relative: float | None
    evaluated_counted_mean_relative: float | None


@dataclass(frozen=True)
class _Error:
    """How far the forces of one step miss the force on the workpiece."""

    step: int
    gap_n: float
    relative: float
    evaluated_n: float
    evaluated_relative: float
    counted: bool


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
    silent_max_n: float = 0.0
    unplaced: int = 0
    unplaced_max_n: float = 0.0
    _errors: list[_Error] = field(default_factory=list)
    _opening: list[_Error] = field(default_factory=list)

    def add(
        self,
        frames: WorkpieceFrames,
        workpiece_force_n: Sequence[Floats | None],
        counted: NDArray[np.bool_],
    ) -> NDArray[np.bool_]:
        """Take in the contacts of F steps.

        Parameters
        ----------
        frames : WorkpieceFrames
            The contacts.
        workpiece_force_n : sequence of (3,) ndarray or None
            Force on the workpiece at each step; None if it was not written.
        counted : (F,) ndarray of bool
            Whether statistics use a step.

        Returns
        -------
        (F,) ndarray of bool
            False for a frame that opens a file and whose forces are not the
            applied ones.
        """
        contacts = frames.workpiece
        silent_n = contacts.evaluated_n[contacts.silent]
        self.contacts += len(contacts)
        self.silent += len(silent_n)
        self.silent_max_n = max(self.silent_max_n, _largest(silent_n))
        self.unplaced += len(frames.unplaced_n)
        self.unplaced_max_n = max(self.unplaced_max_n, _largest(frames.unplaced_n))
        as_applied = np.ones(len(frames.step), dtype=np.bool_)
        errors = _errors(frames, workpiece_force_n, counted.tolist())
        for place, (error, opening) in enumerate(zip(errors, frames.opening, strict=True)):
            if error is not None:
                (self._opening if opening else self._errors).append(error)
                as_applied[place] = not opening or error.relative <= self.limit
        return as_applied

    def problem(self) -> str | None:
        """What is wrong, or None if the acceptance check passes."""
        if not self._errors:
            return (
                "no step has both workpiece_force and workpiece_particles, so closure "
                "cannot be tested"
            )
        worst = _worst(self._errors)
        if worst.relative > self.limit:
            return (
                f"at step {worst.step} the forces on the particles miss the force on the workpiece"
                f" by {worst.gap_n:.3g} N, {worst.relative:.3g} of it (limit {self.limit:g})"
            )
        if self.unplaced_max_n > _FLOOR_N:
            return (
                f"{self.unplaced} forces on particles have no contact in workpiece_contacts,"
                f" the largest {self.unplaced_max_n:.3g} N (limit {_FLOOR_N:g} N)"
            )
        return None

    def record(self) -> ClosureRecord:
        """The content of ``closure.json``."""
        problem, worst = self.problem(), _worst(self._errors) if self._errors else None
        evaluated = np.array([one.evaluated_relative for one in self._errors if one.counted])
        return ClosureRecord(
            verdict="pass" if problem is None else "fail",
            problem=problem,
            limit=self.limit,
            force_floor_n=_FLOOR_N,
            frames=len(self._errors),
            worst_step=worst.step if worst else None,
            max_relative=worst.relative if worst else 0.0,
            max_n=worst.gap_n if worst else 0.0,
            opening_frames=len(self._opening),
            opening_max_relative=max((one.relative for one in self._opening), default=0.0),
            contacts=self.contacts,
            unplaced_forces=self.unplaced,
            unplaced_max_n=self.unplaced_max_n,
            silent_contacts=self.silent,
            silent_evaluated_max_n=self.silent_max_n,
            evaluated_max_n=max((one.evaluated_n for one in self._errors), default=0.0),
            evaluated_counted_max_relative=float(evaluated.max()) if evaluated.size else None,
            evaluated_counted_mean_relative=float(evaluated.mean()) if evaluated.size else None,
        )


def _errors(
    frames: WorkpieceFrames, workpiece_force_n: Sequence[Floats | None], counted: list[bool]
) -> Iterator[_Error | None]:
    """The error of each frame; None where the force on the workpiece was not written."""
    count, at = len(frames.step), frames.workpiece_at
    placed = sums(at, frames.workpiece.force_n, count)
    applied = placed + sums(frames.unplaced_at, frames.unplaced_n, count)
    evaluated = sums(at, frames.workpiece.evaluated_n, count)
    for step, force, *totals, used in zip(
        frames.step.tolist(), workpiece_force_n, applied, evaluated, counted, strict=True
    ):
        if force is None:
            yield None
            continue
        scale = max(float(np.linalg.norm(force)), _FLOOR_N)
        gap, evaluated_gap = (float(np.linalg.norm(total + force)) for total in totals)
        yield _Error(step, gap, gap / scale, evaluated_gap, evaluated_gap / scale, used)


def _worst(errors: list[_Error]) -> _Error:
    return max(errors, key=lambda error: error.relative)


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max()) if len(vectors) else 0.0

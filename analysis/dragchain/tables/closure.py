"""The force closure acceptance check.

The forces on the particles must add up to the force on the workpiece.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dragchain.arrays import Floats
from dragchain.tables.workpiece_contacts import WorkpieceFrame

LIMIT = 1e-6
"""Largest relative error that passes: far above rounding, far below physics."""

SHARED_LIMIT = 0.05
"""The same where one wall serves workpiece and bowl (``mesh_id`` in workpiece_contacts): a
particle that touches both has one force, which is shared out by estimate."""

FLOOR_N = 1e-3
"""Smaller forces on the workpiece do not serve as the scale of the error."""


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
    frames: int = 0
    contacts: int = 0
    opening: int = 0
    opening_worst: float = 0.0
    silent: int = 0
    unplaced: int = 0
    worst_step: int | None = None
    worst: float = 0.0
    worst_n: float = 0.0
    unplaced_max_n: float = 0.0
    silent_max_n: float = 0.0
    evaluated_max_n: float = 0.0
    _evaluated: list[float] = field(default_factory=list)

    def add(
        self, frame: WorkpieceFrame, workpiece_force_n: Floats | None, *, counted: bool
    ) -> bool:
        """Take in the contacts of one step.

        Parameters
        ----------
        frame : RodFrame
            The contacts.
        workpiece_force_n : (3,) ndarray or None
            Force on the workpiece at this step; None if it was not written.
        counted : bool
            Whether statistics use this step.

        Returns
        -------
        bool
            False for a frame that opens a file and whose forces are not the
            applied ones.
        """
        self._add_contacts(frame)
        if workpiece_force_n is None:
            return True
        scale = max(float(np.linalg.norm(workpiece_force_n)), FLOOR_N)
        applied = frame.workpiece.force_n.sum(axis=0) + frame.unplaced_n.sum(axis=0)
        gap_n = float(np.linalg.norm(applied + workpiece_force_n))
        if frame.opening:
            self.opening += 1
            self.opening_worst = max(self.opening_worst, gap_n / scale)
            return gap_n / scale <= self.limit
        self.frames += 1
        if self.worst_step is None or gap_n / scale > self.worst:
            self.worst_step, self.worst, self.worst_n = frame.step, gap_n / scale, gap_n
        evaluated_n = float(
            np.linalg.norm(frame.workpiece.evaluated_n.sum(axis=0) + workpiece_force_n)
        )
        self.evaluated_max_n = max(self.evaluated_max_n, evaluated_n)
        if counted:
            self._evaluated.append(evaluated_n / scale)
        return True

    def _add_contacts(self, frame: WorkpieceFrame) -> None:
        workpiece = frame.workpiece
        self.contacts += len(workpiece)
        self.silent += int(workpiece.silent.sum())
        self.silent_max_n = max(
            self.silent_max_n, _largest(workpiece.evaluated_n[workpiece.silent])
        )
        self.unplaced += len(frame.unplaced_n)
        self.unplaced_max_n = max(self.unplaced_max_n, _largest(frame.unplaced_n))

    def problem(self) -> str | None:
        """What is wrong, or None if the acceptance check holds."""
        if self.frames == 0:
            return (
                "no step has both workpiece_force and workpiece_particles, so closure "
                "cannot be tested"
            )
        if self.worst > self.limit:
            return (
                f"at step {self.worst_step} the forces on the particles miss the force on "
                f"the workpiece"
                f" by {self.worst_n:.3g} N, {self.worst:.3g} of it (limit {self.limit:g})"
            )
        if self.unplaced_max_n > FLOOR_N:
            return (
                f"{self.unplaced} forces on particles have no contact in workpiece_contacts,"
                f" the largest {self.unplaced_max_n:.3g} N (limit {FLOOR_N:g} N)"
            )
        return None

    def content(self) -> dict[str, object]:
        """What ``closure.json`` holds."""
        problem = self.problem()
        relative = np.array(self._evaluated)
        return {
            "verdict": "pass" if problem is None else "fail",
            "problem": problem,
            "limit": self.limit,
            "force_floor_n": FLOOR_N,
            "frames": self.frames,
            "worst_step": self.worst_step,
            "max_relative": self.worst,
            "max_n": self.worst_n,
            "opening_frames": self.opening,
            "opening_max_relative": self.opening_worst,
            "contacts": self.contacts,
            "unplaced_forces": self.unplaced,
            "unplaced_max_n": self.unplaced_max_n,
            "silent_contacts": self.silent,
            "silent_evaluated_max_n": self.silent_max_n,
            "evaluated_max_n": self.evaluated_max_n,
            "evaluated_counted_max_relative": float(relative.max()) if relative.size else None,
            "evaluated_counted_mean_relative": float(relative.mean()) if relative.size else None,
        }


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max()) if len(vectors) else 0.0

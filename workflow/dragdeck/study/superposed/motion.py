"""What every kind of superposed motion knows of itself: fields, poses, and the engine's motion."""

from abc import abstractmethod
from typing import ClassVar, Self

import numpy as np
from pydantic import JsonValue

from dragdeck.arrays import Floats
from dragdeck.study.base import Model, NonNegative
from dragdeck.study.drive import Drive, EngineMotion, SmoothStart
from dragdeck.study.rotations import Orientations
from dragdeck.study.stages import StepCounts


class SuperposedMotion(Model):
    """Block of a study: a motion that is superposed on the path during the whole drag.

    Steps are counted from the start of the drag.

    Attributes
    ----------
    kind : str
        What ``case.json`` calls it.
    turns : bool
        Whether it turns the workpiece.
    """

    kind: ClassVar[str]
    turns: ClassVar[bool] = False

    ramp_s: NonNegative = 0.1
    """duration of the start from rest, s, with `speed_factor` 1; excluded from all statistics"""

    @abstractmethod
    def faster(self, factor: float) -> Self:
        """The same motion with every speed multiplied."""

    @abstractmethod
    def surface_speed_m_s(self, radius_m: float) -> float:
        """What it adds at most to the speed of a surface point of a workpiece of this radius."""

    @property
    def vertical_reach_m(self) -> float:
        """How far it takes the workpiece below, and above, its path."""
        return 0.0

    # --- as a run drives it, with every speed multiplied ---------------------------------------

    def begin(self, drive: Drive) -> SmoothStart:
        """How it starts from rest."""
        return SmoothStart(round(self.ramp_s / drive.timestep_s))

    def shift(self, drive: Drive, since: StepCounts) -> Floats:
        """How far it has taken the workpiece from its path after (N,) steps, (N, 3) in m."""
        return np.zeros((len(since), 3))

    def turn(self, drive: Drive, since: StepCounts) -> Floats:
        """By which angle it has turned the workpiece about its axis after (N,) steps, rad."""
        return np.zeros(len(since))

    def rotated(self, drive: Drive, since: StepCounts, before: Orientations) -> Orientations:
        """The orientation after (N,) steps, with that which the workpiece has without it."""
        return before

    def velocity(
        self, drive: Drive, since: StepCounts, arm_m: Floats, before: Orientations
    ) -> Floats:
        """What it adds to the velocity of points that are fixed to the workpiece.

        Parameters
        ----------
        drive : Drive
        since : (N,) ndarray of int
        arm_m : (N, 3) ndarray
            From the reference point to the points, m.
        before : Orientations
            As for `rotated`.

        Returns
        -------
        (N, 3) ndarray
            Velocities, m/s.
        """
        return np.zeros_like(arm_m)

    @abstractmethod
    def on_engine(self, drive: Drive, heading: str | float) -> EngineMotion:
        """Its part of the input script.

        Parameters
        ----------
        drive : Drive
        heading : str or float
            Direction of the workpiece's front by its path, at the engine's ``step``; a number if
            it does not turn.
        """

    def entry(self, drive: Drive) -> dict[str, JsonValue]:
        """Its entry in ``case.json``, in whole steps; ``ramp_steps`` is absent if it has none."""
        ramp = self.begin(drive).steps
        return {"kind": self.kind, **({"ramp_steps": ramp} if ramp else {})}

"""What every kind of motion of the bowl knows of itself: fields, poses, LIGGGHTS' motion."""

from abc import abstractmethod
from typing import TYPE_CHECKING, Self

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.study.base import Model
from dragdeck.study.drive import EngineMotion
from dragdeck.study.stages import StepCounts


class BowlMotion(Model):
    """Block of a study: how the bowl moves during the whole process.

    Steps are counted from the start of the process, before the plunge.
    """

    if TYPE_CHECKING:
        kind: str

    @abstractmethod
    def faster(self, factor: float) -> Self:
        """The same motion with every speed multiplied."""

    @abstractmethod
    def words(self) -> str:
        """What ``check`` says of it."""

    @property
    def rad_s(self) -> float:
        """Angular speed about +z of a bowl of revolution, whose mesh stays where it is."""
        return 0.0

    @property
    def sideways_m_s2(self) -> tuple[float, float]:
        """Acceleration of the particles along x and y, relative to a bowl that stands still."""
        return 0.0, 0.0

    @property
    def reach_m(self) -> tuple[float, float, float]:
        """How far it takes the bowl along x, y and z to either side, m."""
        return 0.0, 0.0, 0.0

    @property
    def displacement_speed_m_s(self) -> float:
        """Highest speed of its displacement, m/s."""
        return 0.0

    def shift(self, steps: StepCounts, timestep_s: float) -> Floats:
        """How far it has taken the bowl after (N,) steps, (N, 3) in m."""
        return np.zeros((len(steps), 3))

    def on_engine(self, timestep_s: float) -> EngineMotion:
        """What moves the mesh of the bowl; nothing if only its surface moves."""
        return EngineMotion({})

"""A vertical oscillation of the workpiece about its immersion depth."""

import math
from typing import ClassVar, Self

import numpy as np
from pydantic import JsonValue

from dragdeck.arrays import Floats
from dragdeck.study.base import Positive
from dragdeck.study.drive import Drive, EngineMotion
from dragdeck.study.rotations import Orientations
from dragdeck.study.stages import StepCounts
from dragdeck.study.superposed.motion import SuperposedMotion


class Oscillation(SuperposedMotion):
    """A vertical sine, upwards first: ``z = amplitude sin(rate t)``, t the time at full speed."""

    kind: ClassVar[str] = "oscillation"

    amplitude_m: Positive
    """amplitude about the immersion depth, m"""
    frequency_hz: Positive
    """frequency, Hz"""

    def faster(self, factor: float) -> Self:
        """A higher frequency at the same amplitude."""
        faster = {"frequency_hz": factor * self.frequency_hz, "ramp_s": self.ramp_s / factor}
        return self.model_copy(update=faster)

    @property
    def _rate_rad_s(self) -> float:
        return 2 * math.pi * self.frequency_hz

    def surface_speed_m_s(self, radius_m: float) -> float:
        """The speed with which it passes the immersion depth."""
        return self.amplitude_m * self._rate_rad_s

    @property
    def vertical_reach_m(self) -> float:
        """The amplitude."""
        return self.amplitude_m

    def shift(self, drive: Drive, since: StepCounts) -> Floats:
        """The sine."""
        height = self.amplitude_m * np.sin(self._angle(drive, since))
        return np.column_stack([np.zeros((len(since), 2)), height])

    def velocity(
        self, drive: Drive, since: StepCounts, arm_m: Floats, before: Orientations
    ) -> Floats:
        """Of the whole workpiece, up and down."""
        velocity, pace = np.zeros_like(arm_m), self.begin(drive).pace(since)
        most = self.amplitude_m * self._rate_rad_s
        velocity[:, 2] = most * np.cos(self._angle(drive, since)) * pace
        return velocity

    def _angle(self, drive: Drive, since: StepCounts) -> Floats:
        return self._rate_rad_s * drive.timestep_s * self.begin(drive).advance(since)

    def on_engine(self, drive: Drive, heading: str | float) -> EngineMotion:
        """The mean velocity of each step: the places add up to the sine, also after a restart."""
        angle, begin = f"{self._rate_rad_s!r}*dt", self.begin(drive)
        now, before = (f"sin({angle}*{begin.formula(drive.start + late)})" for late in (0, 1))
        speed = f"{self.amplitude_m!r}*({now}-{before})/dt"
        return EngineMotion(
            {"": "linear/variable v_oscillation_zero v_oscillation_zero v_oscillation_vz"},
            {"oscillation_zero": "0.0", "oscillation_vz": speed},
        )

    def entry(self, drive: Drive) -> dict[str, JsonValue]:
        """Amplitude and rate."""
        rate = {"amplitude_m": self.amplitude_m, "rate_rad_s": self._rate_rad_s}
        return super().entry(drive) | rate

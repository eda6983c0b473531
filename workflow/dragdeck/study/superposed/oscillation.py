"""A vertical oscillation of the workpiece about its immersion depth."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field

from dragdeck.study.base import Model, NonNegative, Positive
from dragdeck.study.superposed.kind import (
    RAMP,
    DragSteps,
    EngineMotion,
    SuperposedMotion,
    SuperposedOfRun,
)


class OscillationOfRun(SuperposedOfRun):
    """An oscillation as simulated: ``z = amplitude sin(rate t)``, t the time at full speed.

    Attributes
    ----------
    rate_rad_s : float
        2 pi times the frequency.
    ramp_steps : int
        Steps in which it starts from rest; absent if it starts at full speed.
    """

    kind: Literal["oscillation"] = "oscillation"
    amplitude_m: float
    rate_rad_s: float

    def lift_m(self, steps: float, timestep_s: float) -> float:
        """The sine."""
        return self.amplitude_m * math.sin(self.rate_rad_s * timestep_s * self.advance(steps))

    def on_engine(self, start_step: int) -> EngineMotion:
        """The mean velocity of each step: the places add up to the sine, also after a restart."""
        angle = f"{self.rate_rad_s!r}*dt"
        now, before = (f"sin({angle}*{self.advance_formula(start_step + late)})" for late in (0, 1))
        speed = f"{self.amplitude_m!r}*({now}-{before})/dt"
        return EngineMotion(
            {"oscillation_zero": "0.0", "oscillation_vz": speed},
            "linear/variable v_oscillation_zero v_oscillation_zero v_oscillation_vz",
        )


class Oscillation(Model, SuperposedMotion):
    """A vertical sine, upwards first."""

    part: ClassVar[type[SuperposedOfRun]] = OscillationOfRun

    ramp_s: NonNegative = RAMP

    amplitude_m: Positive = Field(
        description="amplitude of the vertical oscillation about the immersion depth, m"
    )
    frequency_hz: Positive = Field(description="frequency of the vertical oscillation, Hz")

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

    def of_run(self, drag: DragSteps) -> OscillationOfRun:
        """Amplitude and rate."""
        return OscillationOfRun(
            amplitude_m=self.amplitude_m,
            rate_rad_s=self._rate_rad_s,
            ramp_steps=self.ramp_steps(drag),
        )

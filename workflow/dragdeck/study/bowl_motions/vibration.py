"""A bowl that vibrates without turning, on a line or an ellipse."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dragdeck.arrays import Floats
from dragdeck.study.base import NonNegative, Number, Positive
from dragdeck.study.bowl_motions.bowl_motion import BowlMotion
from dragdeck.study.drive import EngineMotion, SmoothStart
from dragdeck.study.stages import StepCounts

_AXES = "xyz"


class Vibration(BowlMotion):
    """A sine along each axis, ``amplitude sin(2 pi frequency t + phase)``.

    The amplitude rises from zero as ``3 x^2 - 2 x^3``, so that the bowl starts at rest in its
    middle place.
    """

    kind: Literal["vibration"]
    """vibration without turning"""
    amplitude_m: tuple[NonNegative, NonNegative, NonNegative]
    """amplitudes along x, y and z, m"""
    phase_deg: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    """phases along x, y and z, degrees; 0 and 90 along two axes: an ellipse"""
    frequency_hz: Positive
    """frequency, Hz"""
    ramp_s: Annotated[Number, Field(gt=0)] = 0.1
    """time in which the amplitudes rise from zero, s, with `speed_factor` 1; it begins before the
    plunge"""

    @model_validator(mode="after")
    def _vibrates(self) -> Self:
        if not any(self.amplitude_m):
            raise ValueError("all amplitudes are zero: leave motion.bowl out if it stands still")
        return self

    @property
    def reach_m(self) -> tuple[float, float, float]:
        """The amplitudes."""
        return self.amplitude_m

    @property
    def displacement_speed_m_s(self) -> float:
        """With all axes at their highest speed at once, and the rise of the amplitudes."""
        size = math.hypot(*self.amplitude_m)
        return size * (math.tau * self.frequency_hz + 1.5 / self.ramp_s)

    def faster(self, factor: float) -> Self:
        """A higher frequency at the same amplitudes."""
        faster = {"frequency_hz": factor * self.frequency_hz, "ramp_s": self.ramp_s / factor}
        return self.model_copy(update=faster)

    def words(self) -> str:
        """Amplitudes, frequency, and the largest acceleration."""
        sizes = ", ".join(f"{1e3 * size:.3g}" for size in self.amplitude_m)
        rate = math.tau * self.frequency_hz
        acceleration = max(self.amplitude_m) * rate**2
        return (
            f"amplitudes {sizes} mm along x, y, z at {self.frequency_hz:.4g} Hz, "
            f"acceleration up to {acceleration:.3g} m/s2 along an axis"
        )

    def shift(self, steps: StepCounts, timestep_s: float) -> Floats:
        """The sines, as large as the amplitudes have become."""
        angle = math.tau * self.frequency_hz * timestep_s * np.asarray(steps, dtype=np.float64)
        sines = np.sin(angle[:, None] + np.radians(self.phase_deg))
        size = self._begin(timestep_s).pace(steps)[:, None] * self.amplitude_m
        return np.asarray(size * sines)

    def on_engine(self, timestep_s: float) -> EngineMotion:
        """The mean velocity of each step: the places add up to the sines, also after a restart."""
        rate, begin = math.tau * self.frequency_hz, self._begin(timestep_s)
        variables = {}
        for when, late in (("now", 0), ("before", 1)):
            variables[f"bowl_size_{when}"] = begin.pace_formula(late)
            variables[f"bowl_angle_{when}"] = f"{rate!r}*dt*(step-{late})"
        for axis, size, phase in zip(_AXES, self.amplitude_m, self.phase_deg, strict=True):
            now, before = (
                f"v_bowl_size_{when}*sin(v_bowl_angle_{when}+({math.radians(phase)!r}))"
                for when in ("now", "before")
            )
            variables[f"bowl_v{axis}"] = f"{size!r}*({now}-{before})/dt"
        return EngineMotion(
            {"": "linear/variable v_bowl_vx v_bowl_vy v_bowl_vz"},
            variables,
            "vibration of the bowl, as the mean velocity of each step",
        )

    def _begin(self, timestep_s: float) -> SmoothStart:
        return SmoothStart(max(1, round(self.ramp_s / timestep_s)))

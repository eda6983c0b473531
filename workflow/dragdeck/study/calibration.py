"""Measurements from which coefficients of the contact law are found: drop test, angles of heaps."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from dragdeck.errors import InputError
from dragdeck.parts import omitted
from dragdeck.physics.estimates import SOLID_FRACTION_ESTIMATE
from dragdeck.study.base import Line, Model, Number, Positive, Whole

NARROWEST = 5
"""Least diameter of a cylinder or drum, over that of a particle: narrower ones jam."""

FASTEST = 0.1
"""Largest Froude number of a drum, centrifugal acceleration over gravity: an assumption; the
surface of a faster one is not plane."""

MOST_FREE, MOST_GLUED = 20_000, 100_000
"""Particles of a heap or drum, of which dozens are simulated, and of its glued layer."""

Rig = Literal["repose", "drum"]
Measured = Annotated[Number, Field(gt=0, lt=90)]


class Repose(Model):
    """A cylinder of the bowl's material, lifted slowly off a plate with a glued layer of media."""

    angle_deg: Measured
    """angle of the heap to the horizontal, degrees"""
    angle_std_deg: Positive
    """its standard uncertainty, degrees"""
    cylinder_radius_m: Positive
    """inner radius of the cylinder, m"""
    count: Annotated[Whole, Field(ge=300, le=MOST_FREE)]
    """number of particles"""


class Drum(Model):
    """A drum with a glued layer of media and end plates of the bowl's material.

    It turns about its horizontal axis.
    """

    angle_deg: Measured
    """angle of the moving surface to the horizontal, degrees"""
    angle_std_deg: Positive
    """its standard uncertainty, degrees"""
    radius_m: Positive
    """inner radius of the drum, under the glued layer, m"""
    width_m: Positive
    """distance between its end plates, m"""
    fill_fraction: Annotated[Number, Field(ge=0.1, le=0.4)]
    """volume of the bed / volume of the drum inside the glued layer"""
    rpm: Positive
    """rotational speed of the drum, 1/min"""

    def count(self, radius_m: float, volume_m3: float) -> int:
        """Number of particles of a mean radius, of the glued layer too, and of a mean volume."""
        section = math.pi * max(self.radius_m - 2 * radius_m, 0.0) ** 2
        solid = SOLID_FRACTION_ESTIMATE * self.fill_fraction * section * self.width_m
        return round(solid / volume_m3)

    @property
    def rad_s(self) -> float:
        """Angular speed, rad/s."""
        return self.rpm * math.pi / 30


class Angles(Model):
    """Measured angles, from which friction and rolling friction of the media are found."""

    friction: tuple[Positive, Positive] = (0.05, 1.0)
    """range of the friction coefficient, with equal probability"""
    rolling_friction: tuple[Positive, Positive] = (0.005, 0.4)
    """range of the coefficient of rolling friction, with equal probability"""
    repose: Repose | None = None
    drum: Drum | None = None

    @property
    def rigs(self) -> Mapping[Rig, Repose | Drum]:
        """The measurements that there are."""
        every: Mapping[Rig, Repose | Drum | None] = {"repose": self.repose, "drum": self.drum}
        return {name: rig for name, rig in every.items() if rig is not None}

    def problems(
        self, radius_m: float, volume_m3: float, gravity_m_s2: float
    ) -> Iterator[tuple[str, str, str]]:
        """What cannot work with particles of this radius and volume: field, problem and limit."""
        sizes = {"repose.cylinder_radius_m": (self.repose and self.repose.cylinder_radius_m, 0)}
        if self.drum:
            sizes["drum.radius_m"] = self.drum.radius_m, 2
            sizes["drum.width_m"] = self.drum.width_m, 0
            most = math.sqrt(FASTEST * gravity_m_s2 / self.drum.radius_m) * 30 / math.pi
            if self.drum.rpm > most:
                limit = f"at most {most:.3g}, a Froude number of {FASTEST:g}"
                yield "drum.rpm", "the drum is too fast for a plane surface", limit
            if (count := self.drum.count(radius_m, volume_m3)) > MOST_FREE:
                problem = f"the drum has {count:.3g} particles, too many for dozens of runs"
                yield "drum.fill_fraction", problem, f"{MOST_FREE} particles, in a smaller drum"
        across = {name: (size or 0.0) / (2 * radius_m) for name, (size, _) in sizes.items()}
        layers = {"repose.cylinder_radius_m": math.pi * across["repose.cylinder_radius_m"] ** 2}
        if self.drum:
            width = across["drum.width_m"]
            layers["drum.radius_m"] = math.tau * across["drum.radius_m"] * width
        for field, glued in layers.items():
            if glued > MOST_GLUED:
                problem = f"a glued layer of {glued:.3g} particles, too many for dozens of runs"
                yield field, problem, f"{MOST_GLUED} particles, on a smaller surface"
        for field, (size, more) in sizes.items():
            least = (NARROWEST + more) * radius_m
            if size and size < least:
                problem = f"less room than {NARROWEST} particle diameters, in which media jam"
                yield field, problem, f"at least {least:.4g} m"

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if not self.rigs:
            raise ValueError("give repose, drum or both")
        for low, high in (self.friction, self.rolling_friction):
            if low >= high:
                raise ValueError(f"a range must increase, but goes from {low:g} to {high:g}")
        return self


class Calibration(Model):
    """Measurements that `./run calibrate` fits coefficients to: a drop test, angles, or both."""

    record: Line | None = Field(default=None, pattern=r"^[^{}]*$")
    """CSV file of force against time in a drop test; relative to the study"""
    height_std_m: Positive = 1e-4
    """standard uncertainty of `drop_test.height_m`, m"""
    peaks: Literal["auto", "yes", "no"] = "auto"
    """whether ratios of peak forces are fitted, too; auto: if the sensor is fast enough"""
    angles: Angles | None = omitted(None)

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.record is None and self.angles is None:
            raise ValueError("give record, angles or both")
        return self


def measurements(calibration: Calibration | None, file: Path) -> Calibration:
    """The measurements of a study.

    Raises
    ------
    InputError
        It has none.
    """
    if calibration is None:
        raise InputError(
            "the study has no measured drop test and no measured angle",
            file=file,
            field="calibration",
            remedy="add calibration: {record: FILE.csv}, see docs/howto/calibration.md",
        )
    return calibration

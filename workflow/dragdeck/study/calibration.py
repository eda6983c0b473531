"""Measurements from which coefficients of the contact law are found: drop test, angles of heaps."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from dragdeck.study.base import Line, Model, Number, Positive, Whole
from dragdeck.study.media import SOLID_FRACTION_ESTIMATE, Media

NARROWEST = 5
"""Least diameter of a cylinder or drum, over that of a particle: narrower ones jam."""

FEWEST, MOST = 100, 20_000
"""Particles of a heap or drum: fewer have no slope, more take hours."""

FASTEST = 0.1
"""Largest Froude number of a drum, centrifugal acceleration over gravity: an assumption; the
surface of a faster one is not plane."""

Rig = Literal["repose", "drum"]

_Found = Iterator[tuple[str, str, str]]


def _none(value: object) -> bool:
    return value is None


class MeasuredAngle(Model):
    """An angle of the media, and the walls that were used beside the glued layer."""

    angle_deg: Annotated[Number, Field(gt=0, lt=90)] = Field(
        description="measured angle of the surface to the horizontal, degrees"
    )
    angle_std_deg: Positive = Field(description="its standard uncertainty, degrees")
    material: str | None = Field(
        default=None,
        description="material of the cylinder, or of the end plates of the drum: a name under "
        "`materials`; none: that of the bowl",
    )


class Repose(MeasuredAngle):
    """A cylinder filled with media and lifted slowly off a plate with a glued layer of media."""

    cylinder_radius_m: Positive = Field(description="inner radius of the cylinder, m")
    count: Annotated[Whole, Field(ge=1)] | None = Field(
        default=None, description="number of particles"
    )
    mass_kg: Positive | None = Field(default=None, description="total mass, kg, instead of count")
    lift_speed_m_s: Positive = Field(
        default=0.02, description="speed at which the cylinder is lifted, m/s"
    )

    @model_validator(mode="after")
    def _total(self) -> Self:
        if (self.count is None) == (self.mass_kg is None):
            raise ValueError("give one of count and mass_kg")
        return self

    def filled(self, media: Media) -> Media:
        """The media with the total of the heap."""
        total = {"count": self.count, "mass_kg": self.mass_kg, "fill_height_m": None}
        return media.model_copy(update=total)

    def problems(self, radius_m: float, gravity_m_s2: float) -> _Found:
        """What cannot work with particles of this radius."""
        least = NARROWEST * radius_m
        if self.cylinder_radius_m < least:
            problem = f"the cylinder is narrower than {NARROWEST} particle diameters and would jam"
            yield "cylinder_radius_m", problem, f"at least {least:.4g} m"


class Drum(MeasuredAngle):
    """A drum that turns about its horizontal axis, with a glued layer of media inside."""

    radius_m: Positive = Field(description="inner radius of the drum, under the glued layer, m")
    width_m: Positive = Field(description="distance between its end plates, m")
    fill_fraction: Annotated[Number, Field(ge=0.1, le=0.5)] = Field(
        description="fraction of the drum's volume inside the glued layer that the bed takes up"
    )
    rpm: Positive = Field(description="rotational speed of the drum, 1/min")

    @property
    def rad_s(self) -> float:
        """Angular speed, rad/s."""
        return self.rpm * math.pi / 30

    def filled(self, media: Media) -> Media:
        """The media with the total that fills the drum, with the solid fraction of a poured bed."""
        section = math.pi * (self.radius_m - 2 * media.typical_radius_m) ** 2
        solid = SOLID_FRACTION_ESTIMATE * self.fill_fraction * section * self.width_m
        count = max(1, round(solid / media.mean_volume_m3))
        return media.model_copy(update={"count": count, "mass_kg": None, "fill_height_m": None})

    def problems(self, radius_m: float, gravity_m_s2: float) -> _Found:
        """What cannot work with particles of this radius."""
        free, least = self.radius_m - 2 * radius_m, NARROWEST * radius_m
        if free < least:
            problem = f"the drum is narrower than {NARROWEST} particle diameters inside its layer"
            yield "radius_m", problem, f"at least {least + 2 * radius_m:.4g} m"
        if self.width_m < least:
            problem = f"the drum is narrower than {NARROWEST / 2:g} particle diameters"
            yield "width_m", problem, f"at least {least:.4g} m"
        fastest = math.sqrt(FASTEST * gravity_m_s2 / self.radius_m) * 30 / math.pi
        if self.rpm > fastest:
            problem = "the drum is too fast for a plane surface"
            yield "rpm", problem, f"at most {fastest:.3g}, a Froude number of {FASTEST:g}"


class Angles(Model):
    """Measured angles, from which friction and rolling friction of the media are found."""

    friction: tuple[Positive, Positive] = Field(
        default=(0.05, 1.0),
        description="range of the friction coefficient: it is equally likely everywhere in it",
    )
    rolling_friction: tuple[Positive, Positive] = Field(
        default=(0.005, 0.4), description="range of the coefficient of rolling friction, likewise"
    )
    points: Annotated[Whole, Field(ge=8, le=200)] = Field(
        default=20, description="pairs of coefficients at which each measurement is simulated"
    )
    repose: Repose | None = None
    drum: Drum | None = None

    @property
    def rigs(self) -> Mapping[Rig, Repose | Drum]:
        """The measurements that there are."""
        every: Mapping[Rig, Repose | Drum | None] = {"repose": self.repose, "drum": self.drum}
        return {name: rig for name, rig in every.items() if rig is not None}

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        if not self.rigs:
            raise ValueError("give repose, drum or both")
        for name in ("friction", "rolling_friction"):
            low, high = getattr(self, name)
            if not low < high <= 10:
                raise ValueError(f"{name} must increase, up to 10 at most: {low:g} to {high:g}")
        return self


class Calibration(Model):
    """Measurements that `./run calibrate` fits coefficients to: a drop test, angles, or both."""

    record: Line | None = Field(
        default=None,
        pattern=r"^[^{}]*$",
        description="CSV file of force against time in a drop test; relative to the study",
    )
    height_std_m: Positive = Field(
        default=1e-4, description="standard uncertainty of drop_test.height_m in the test, m"
    )
    peaks: Literal["auto", "yes", "no"] = Field(
        default="auto",
        description="whether to fit the ratios of the peak forces too; auto: if the "
        "sensor is fast enough",
    )
    angles: Angles | None = Field(default=None, exclude_if=_none)

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.record is None and self.angles is None:
            raise ValueError("give record, angles or both")
        return self

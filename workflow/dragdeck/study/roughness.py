"""Roughness of the workpiece before the process, and what is known of it later."""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from dragdeck.arrays import Floats
from dragdeck.study.base import Model, Number, Positive

MOST_HEIGHTS = 20_000
"""Of a profile, which stands in the case of each run."""

_UNEVEN = 0.01
"""Largest relative deviation of a spacing from the mean one."""

_LEVEL = 0.8
"""Ra of a profile without its inclination over that with it, below which a warning is given."""

_PHASES = (np.arange(4000) + 0.5) / 4000
"""Places in half a period of a form, from 0 to 1."""

SAMPLING_LENGTHS = 5
"""Of equal length, in which a measured profile is divided (ISO 4287)."""


class Height(NamedTuple):
    """A point of a measured profile, without form and waviness."""

    x_m: Number
    z_m: Number


class Turned(Model):
    """Grooves of a turning tool: arcs of its nose, a feed apart."""

    feed_m: Positive
    """feed per revolution, m"""
    nose_radius_m: Positive
    """radius of the tool's nose, m"""

    @model_validator(mode="after")
    def _arcs_meet(self) -> "Turned":
        if self.feed_m >= 2 * self.nose_radius_m:
            raise ValueError("feed_m is twice the nose_radius_m or more: the arcs do not meet")
        return self


class Form(Model):
    """A periodic profile of a stated form."""

    shape: Literal["sine", "triangle"]
    """form of a period"""
    ra_m: Positive
    """arithmetic mean deviation Ra, m"""


class MeasuredRa(Model):
    """A roughness that was measured during the process."""

    time_s: Positive
    """process time, s"""
    ra_m: Positive
    """arithmetic mean deviation Ra, m"""


class Roughness(Model):
    """What the roughness is before the process; no run depends on it."""

    profile: Annotated[list[Height], Field(min_length=100, max_length=MOST_HEIGHTS)] | None = None
    """measured profile without form and waviness: a CSV file with columns x_m and z_m, evenly
    spaced along x"""
    turned: Turned | None = None
    form: Form | None = None
    steady_ra_m: Positive | None = None
    """Ra that the process does not go below, m; none: not known"""
    target_ra_m: Positive | None = None
    """Ra for which the time is reported, m"""
    measured: Annotated[list[MeasuredRa], Field(max_length=100)] = Field(default_factory=list)
    """Ra measured at other times: they fit the depth per time, and the steady Ra unless it is
    given"""

    @model_validator(mode="after")
    def _whole(self) -> "Roughness":
        if sum(start is not None for start in (self.profile, self.turned, self.form)) != 1:
            raise ValueError("give either profile, turned, or form")
        steps = np.diff([height.x_m for height in self.profile or ()])
        if len(steps) and not (steps.all() and np.allclose(steps, steps.mean(), rtol=_UNEVEN)):
            raise ValueError("the profile is not evenly spaced along x_m: resample it")
        start_ra_m = self.start_ra_m
        if not start_ra_m:
            raise ValueError("the profile is flat: its Ra is 0")
        for name, ra in {"steady_ra_m": self.steady_ra_m, "target_ra_m": self.target_ra_m}.items():
            if ra and ra >= start_ra_m:
                before = f"that before the process, {start_ra_m:.3g} m"
                raise ValueError(f"{name} is {ra:g}, not below {before}")
        fewest = 2 if self.steady_ra_m else 3
        if 0 < len(self.measured) < fewest:
            raise ValueError(f"{len(self.measured)} measured Ra fit nothing: give {fewest} or more")
        if self.target_ra_m and self.steady_ra_m and self.target_ra_m <= self.steady_ra_m:
            raise ValueError("target_ra_m is not above steady_ra_m: the process does not reach it")
        return self

    @property
    def heights_m(self) -> Floats:
        """Heights of the surface before the process, (N,), m; of a form, in half a period."""
        if self.profile:
            return np.array([height.z_m for height in self.profile])
        if self.turned:
            radius, x = self.turned.nose_radius_m, _PHASES * self.turned.feed_m / 2
            return np.asarray(radius - np.sqrt(radius**2 - x**2))
        assert self.form is not None
        if self.form.shape == "triangle":
            return np.asarray(4.0 * self.form.ra_m * _PHASES)
        return np.asarray(-math.pi / 2 * self.form.ra_m * np.cos(np.pi * _PHASES))

    @property
    def start_ra_m(self) -> float:
        """Ra before the process, m."""
        z = self.heights_m
        return float(np.abs(z - z.mean()).mean())

    def doubts(self) -> Iterator[str]:
        """What a profile or measured Ra contradict, a line each."""
        z, start = self.heights_m, self.start_ra_m
        x = np.arange(len(z))
        level = float(np.abs(z - np.polyval(np.polyfit(x, z, 1), x)).mean())
        if self.profile and level < _LEVEL * start:
            problem = f"roughness.profile is inclined: Ra {start:.3g} m, {level:.3g} m without that"
            yield f"{problem}; remove form and waviness from it"
        series = [row.ra_m for row in sorted(self.measured, key=lambda row: row.time_s)]
        rises = sum(later > earlier for earlier, later in combinations(series, 2))
        if 2 * rises > math.comb(len(series), 2):
            yield "roughness.measured: Ra mostly rises with time, and no removal explains it"
        if any(not (self.steady_ra_m or 0.0) <= ra <= start for ra in series):
            yield f"roughness.measured has Ra beyond that before ({start:.3g} m) or steady_ra_m"

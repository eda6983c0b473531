"""Impacts of single particles on a plane, or of pairs of particles, side by side in a run."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from dragdeck.physics.rounding import round_to
from dragdeck.study.base import Model, Number, Positive, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.material import Material
from evidence.verification.collide import Body, Experiment, Wall
from evidence.verification.lab import (
    APPROACH_STEPS,
    LONGEST_CONTACTS,
    RIGID,
    Lab,
    Test,
    contact_time,
    experiment,
)

Kind = Literal["angle_deg", "tangential_m_s", "spin_m_s", "restitution"]


class Series(Model):
    """One curve of a test: a particle's material and its partner's, none: the same or rigid."""

    material: str
    against: str | None = None


class Impacts(Test):
    """Impacts of single particles on a plane, or of pairs of particles."""

    partner: Literal["plane", "particle"]
    radius_m: Positive
    partner_radius_m: Positive | None = None
    speed_m_s: Positive = Field(description="of approach; of the particle if the angle varies, m/s")
    partner_speed_m_s: Number = Field(default=0.0, description="of a partner particle, m/s")
    partner_spin: Number = Field(default=0.0, description="spin of a partner over the particle's")
    restitution: Number | None = Field(default=None, description="none: the study's")
    friction: Number | None = Field(default=None, description="none: the study's")
    vary: dict[Kind, list[Number]]
    limit_force: tuple[bool, ...] = (True,)
    series: list[Series]
    steps_per_contact: tuple[Annotated[Whole, Field(ge=10)], ...] = ()

    @model_validator(mode="after")
    def _one_variable(self) -> "Impacts":
        if len(self.vary) != 1:
            raise ValueError("vary names exactly one quantity")
        return self

    @property
    def kind(self) -> Kind:
        """What varies."""
        return next(iter(self.vary))

    @property
    def values(self) -> list[float]:
        """Its values."""
        return self.vary[self.kind]

    @property
    def struck_radius_m(self) -> float | None:
        """Radius of the partner; None for a plane."""
        return None if self.partner == "plane" else self.partner_radius_m or self.radius_m

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """A run for each series, contact option and number of steps."""
        for series in self.series:
            for limit_force in self.limit_force:
                for steps in self.steps_per_contact or (lab.steps_per_contact,):
                    yield self._rack(name, lab, series, limit_force, steps)

    def _rack(
        self, name: str, lab: Lab, series: Series, limit_force: bool, steps: int
    ) -> Experiment:
        """All impacts of a series side by side, far from each other."""
        particle, (partner_name, partner) = (
            lab.material(series.material),
            self.partner_of(series, lab),
        )
        pairs = [self._pair(lab, series, value) for value in self.values]
        distinct = list(dict.fromkeys(pairs))
        same = self.partner == "particle" and partner_name == series.material
        types = [(series.material, particle)] * len(distinct)
        if not same:
            types.append((partner_name, partner))
        last = len(types)
        times = self._times(particle, partner)
        dt = round_to(min(times) / steps, 4)
        own_types = [distinct.index(pair) + 1 for pair in pairs]
        bodies = [
            body
            for at, own in enumerate(own_types)
            for body in self._bodies(at, own, own if same else last, dt)
        ]
        each = len(bodies) // len(self.values)
        rows = [
            (each * at + 1, each * at + 2 if each == 2 else "plane", value)
            for at, value in enumerate(self.values)
        ]
        words = lab.series(series.material, partner_name)
        option = "limited" if limit_force else "unlimited"
        of_steps = [f"{steps}-steps"] if self.steps_per_contact else []
        return experiment(
            name,
            self,
            [series.material, partner_name, option, *of_steps],
            series=words,
            vary=self.kind,
            steps_per_contact=steps,
            contacts=rows,
            title=f"{self.title}: {words}",
            types=types,
            pairs={(at, at if same else last): pair for at, pair in enumerate(distinct, start=1)},
            bodies=bodies,
            walls=[Wall("plane", last, "zplane 0.0")] if self.partner == "plane" else [],
            limit_force=limit_force,
            timestep_s=dt,
            steps=math.ceil(LONGEST_CONTACTS * max(times) / dt + 4 * APPROACH_STEPS),
        )

    def partner_of(self, series: Series, lab: Lab) -> tuple[str, Material]:
        """Name and material of the partner of a series."""
        rigid = self.partner == "plane" and series.against is None
        if series.against == RIGID or rigid:
            return RIGID, lab.stiffened(series.material)
        name = series.against or series.material
        return name, lab.material(name)

    def _pair(self, lab: Lab, series: Series, value: float) -> Pair:
        """Restitution and friction of one impact."""
        known = {"restitution": self.restitution, "friction": self.friction}
        if self.kind == "restitution":
            known["restitution"] = value
        if None in known.values():
            own = lab.pair(series.material, series.against or series.material).model_dump()
            known = {key: own[key] if known[key] is None else known[key] for key in known}
        return Pair.model_validate(known)

    def _times(self, particle: Material, partner: Material) -> list[float]:
        """Hertz time of each impact, s."""
        struck = None if self.partner == "plane" else partner
        radius, struck_radius = self.radius_m, self.struck_radius_m
        return [
            contact_time(particle, radius, struck, struck_radius, partner, self._closing(value))
            for value in self.values
        ]

    def _normal_speed(self, value: float) -> float:
        """Normal speed of the particle, m/s."""
        return self.speed_m_s * (math.cos(math.radians(value)) if self.kind == "angle_deg" else 1.0)

    def _closing(self, value: float) -> float:
        """Normal speed of particle and partner towards each other, m/s."""
        return self._normal_speed(value) + self.partner_speed_m_s

    def _bodies(
        self, at: int, own_type: int, partner_type: int, timestep_s: float
    ) -> Iterator[Body]:
        """The particle above its partner, moving down and along +x, and the partner.

        Spin moves the particle's underside along +x.
        """
        value, struck = self.values[at], self.struck_radius_m
        y = at * 6 * max(self.radius_m, struck or 0.0)
        gap = APPROACH_STEPS * timestep_s * self._closing(value)
        along = {
            "angle_deg": self.speed_m_s * math.sin(math.radians(value)),
            "tangential_m_s": value,
        }.get(self.kind, 0.0)
        spin = -value / self.radius_m if self.kind == "spin_m_s" else 0.0
        yield Body(
            type=own_type,
            radius_m=self.radius_m,
            position_m=(0.0, y, (struck or 0.0) + gap + self.radius_m),
            velocity_m_s=(along, 0.0, -self._normal_speed(value)),
            spin_rad_s=(0.0, spin, 0.0),
        )
        if struck is not None:
            yield Body(
                type=partner_type,
                radius_m=struck,
                position_m=(0.0, y, 0.0),
                velocity_m_s=(0.0, 0.0, self.partner_speed_m_s),
                spin_rad_s=(0.0, spin * self.partner_spin, 0.0),
            )

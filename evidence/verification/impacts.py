"""Impacts of the verification suite, many in a run, and where its experiments are made."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, model_validator

from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.rounding import round_to
from dragdeck.study.base import Model, Number, Positive, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.model import Study
from dragdeck.study.workpiece import Material
from evidence.placed import ExactPlane
from evidence.verification.experiment import ContactFacts, Experiment, PlacedSphere

RIGID = "rigid"
_RIGID_FACTOR = 1e6
"""Stiffness of a rigid partner over the particle's: its own deformation is below 1 ppm.
LIGGGHTS has no rigid material. The density of a rigid particle is 1,000-fold."""

APPROACH_STEPS = 10.4
"""Free flight before the first contact, in steps: not a whole number, so that
contact begins within a step, as it does in use."""

LONGEST_CONTACTS = 3.0
"""Length of an impact run over the Hertz time of its slowest impact."""


def hertz_time(
    particle: Material,
    radius_m: float,
    partner: Material,
    partner_radius_m: float | None,
    speed_m_s: float,
) -> float:
    """Hertz time of an impact on another particle, or on a plane, which has no radius, s."""
    mass, radius = mechanics.particle_mass(particle, radius_m), radius_m
    if partner_radius_m is not None:
        second = mechanics.particle_mass(partner, partner_radius_m)
        mass = mass * second / (mass + second)
        radius = radius_m * partner_radius_m / (radius_m + partner_radius_m)
    modulus = mechanics.effective_modulus(particle, partner)
    return mechanics.hertz_contact_time(mass, radius, modulus, speed_m_s)


class Substance(Material):
    """A material and where its constants come from."""

    source: str = "the study"


@dataclass(frozen=True)
class Lab:
    """Where experiments are made: the suite's materials and those of a study.

    Attributes
    ----------
    substances : mapping of str to Substance
        The suite's materials.
    study : Study
        Gives ``media`` and ``workpiece`` and what they do to each other.
    steps_per_contact : int
        Of the experiments that do not say it.
    """

    substances: Mapping[str, Substance]
    study: Study
    steps_per_contact: int

    @property
    def _own(self) -> Mapping[str, str]:
        return {"media": self.study.media.main_material, "workpiece": self.study.workpiece.material}

    def material(self, name: str) -> Material:
        """A material by the suite's name."""
        if name in self._own:
            return self.study.materials[self._own[name]]
        return Material(**self.substances[name].model_dump(exclude={"source"}))

    def stiffened(self, name: str) -> Material:
        """A rigid partner of a material."""
        material = self.material(name)
        stiff = {
            "youngs_modulus_pa": _RIGID_FACTOR * material.youngs_modulus_pa,
            "density_kg_m3": 1e3 * material.density_kg_m3,
        }
        return material.model_copy(update=stiff)

    def pair(self, first: str, second: str) -> Pair:
        """What two of the study's materials do to each other."""
        return self.study.pair(self._own[first], self._own[second])

    def series(self, first: str, second: str) -> str:
        """Name of a series: the study's materials by their own names."""
        return f"{self._own.get(first, first)} on {self._own.get(second, second)}"


Make = Callable[..., Experiment]
"""`experiment` of a test: its further arguments."""


class Test(Model):
    """A test of the suite: its number, what a reader calls it, and paragraphs (HTML) about it."""

    number: Whole
    title: str
    text: tuple[str, ...]


# --- impacts, many in a run -----------------------------------------------------------------


class Series(Model):
    """One curve of a test: a particle's material and its partner's, none: the same or rigid."""

    material: str
    against: str | None = None


class Impacts(Test):
    """Impacts of single particles on a plane, or of pairs of particles; one field varies."""

    partner: Literal["plane", "particle"]
    radius_m: Positive
    partner_radius_m: Positive | None = None
    speed_m_s: Positive = Field(description="of approach, along the angle of incidence, m/s")
    angle_deg: Number = Field(default=0.0, description="of incidence, from the normal")
    tangential_m_s: Number = 0.0
    spin_m_s: Number = Field(default=0.0, description="speed of the particle's surface, m/s")
    partner_speed_m_s: Number = Field(default=0.0, description="of a partner particle, m/s")
    partner_spin: Number = Field(default=0.0, description="spin of a partner over the particle's")
    restitution: Number | None = Field(default=None, description="none: the study's")
    friction: Number | None = Field(default=None, description="none: the study's")
    vary: dict[Literal["angle_deg", "tangential_m_s", "spin_m_s", "restitution"], list[Number]]
    limit_force: tuple[bool, ...] = (True,)
    series: list[Series]
    steps_per_contact: tuple[Annotated[Whole, Field(ge=10)], ...] = ()

    @model_validator(mode="after")
    def _one_variable(self) -> "Impacts":
        if len(self.vary) != 1:
            raise ValueError("vary names exactly one quantity")
        return self

    @property
    def struck_radius_m(self) -> float | None:
        """Radius of the partner; None for a plane."""
        return None if self.partner == "plane" else self.partner_radius_m or self.radius_m

    @property
    def closing_m_s(self) -> float:
        """Normal speed of particle and partner towards each other, m/s."""
        return self.speed_m_s * math.cos(math.radians(self.angle_deg)) + self.partner_speed_m_s

    def racks(self, lab: Lab, made: Make) -> Iterator[Experiment]:
        """A run for each series, contact option and number of steps."""
        for series in self.series:
            for limit_force in self.limit_force:
                for steps in self.steps_per_contact or (lab.steps_per_contact,):
                    yield self._rack(made, lab, series, limit_force, steps)

    def _rack(
        self, made: Make, lab: Lab, series: Series, limit_force: bool, steps: int
    ) -> Experiment:
        """All impacts of a series side by side, far from each other."""
        ((kind, values),) = self.vary.items()
        impacts = [self.model_copy(update={kind: value}) for value in values]
        particle, (struck, partner) = lab.material(series.material), self.partner_of(series, lab)
        pairs = [impact.pair(lab, series) for impact in impacts]
        distinct = list(dict.fromkeys(pairs))
        same = self.partner == "particle" and struck == series.material
        types = [(series.material, particle)] * len(distinct)
        types += [] if same else [(struck, partner)]
        times = [
            hertz_time(
                particle, self.radius_m, partner, self.struck_radius_m, collision.closing_m_s
            )
            for collision in impacts
        ]
        dt = round_to(min(times) / steps, 4)
        bodies: list[PlacedSphere] = []
        contacts: list[ContactFacts] = []
        for value, impact, pair in zip(values, impacts, pairs, strict=True):
            first, row = len(bodies) + 1, distinct.index(pair) + 1
            bodies += impact.bodies(len(contacts), row, row if same else len(types), dt)
            met = first + 1 if self.partner == "particle" else "plane"
            contacts.append(ContactFacts(first, met, value))
        words = lab.series(series.material, struck)
        slug = [series.material, struck, "limited" if limit_force else "unlimited"]
        return made(
            [*slug, f"{steps}-steps"] if self.steps_per_contact else slug,
            series=words,
            vary=kind,
            steps_per_contact=steps,
            contacts=contacts,
            title=f"{self.title}: {words}",
            types=types,
            pairs={(at, at if same else len(types)): pair for at, pair in enumerate(distinct, 1)},
            bodies=bodies,
            walls=[ExactPlane("plane", len(types), "zplane 0.0")]
            if self.partner == "plane"
            else [],
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

    def pair(self, lab: Lab, series: Series) -> Pair:
        """What the two do to each other."""
        known = {"restitution": self.restitution, "friction": self.friction}
        if None in known.values():
            coefficients = lab.pair(series.material, series.against or series.material).model_dump()
            known = {key: coefficients[key] if known[key] is None else known[key] for key in known}
        return Pair.model_validate(known)

    def bodies(
        self, at: int, own_type: int, struck_type: int, timestep_s: float
    ) -> Iterator[PlacedSphere]:
        """The particle above its partner, moving down and along +x, and the partner.

        Spin moves the particle's underside along +x.
        """
        struck, angle = self.struck_radius_m, math.radians(self.angle_deg)
        y = at * 6 * max(self.radius_m, struck or 0.0)
        gap = APPROACH_STEPS * timestep_s * self.closing_m_s
        place = (0.0, y, (struck or 0.0) + gap + self.radius_m)
        along = self.tangential_m_s + self.speed_m_s * math.sin(angle)
        velocity = (along, 0.0, -self.speed_m_s * math.cos(angle))
        spin = 0.0 - self.spin_m_s / self.radius_m
        yield PlacedSphere(own_type, self.radius_m, place, velocity, (0.0, spin, 0.0))
        if struck is not None:
            velocity, spin = (0.0, 0.0, self.partner_speed_m_s), spin * self.partner_spin
            yield PlacedSphere(struck_type, struck, (0.0, y, 0.0), velocity, (0.0, spin, 0.0))

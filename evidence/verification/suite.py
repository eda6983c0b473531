"""The verification suite: what each test of ``suite.yaml`` asks LIGGGHTS for."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, model_validator

from dragdeck.decks.deck import Vector
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.rounding import round_to
from dragdeck.study.base import Model, Number, Positive, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.model import Study
from dragdeck.study.workpiece import Material
from evidence.verification.experiment import (
    ContactFacts,
    Experiment,
    PlacedSphere,
    Wall,
    experiment,
)

RIGID = "rigid"
_RIGID_FACTOR = 1e6
"""Stiffness of a rigid partner over the particle's: its own deformation is below 1 ppm.
LIGGGHTS has no rigid material. The density of a rigid particle is 1,000-fold."""

_APPROACH_STEPS = 10.4
"""Free flight before the first contact, in steps: not a whole number, so that
contact begins within a step, as it does in use."""

_LONGEST_CONTACTS = 3.0
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
        own = self.material(name)
        stiff = {
            "youngs_modulus_pa": _RIGID_FACTOR * own.youngs_modulus_pa,
            "density_kg_m3": 1e3 * own.density_kg_m3,
        }
        return own.model_copy(update=stiff)

    def pair(self, first: str, second: str) -> Pair:
        """What two of the study's materials do to each other."""
        return self.study.pair(self._own[first], self._own[second])

    def series(self, first: str, second: str) -> str:
        """Name of a series: the study's materials by their own names."""
        return f"{self._own.get(first, first)} on {self._own.get(second, second)}"


class Test(Model):
    """A test of the suite: its number, what a reader calls it, and paragraphs (HTML) about it."""

    number: Whole
    title: str
    text: tuple[str, ...]

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """The runs of the test of that name."""
        raise NotImplementedError

    def made(self, name: str, *slug: str, **own: Any) -> Experiment:
        """A run of this test, see `experiment`."""
        return experiment(name, self.number, self.title, slug, **own)


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
        ((kind, values),) = self.vary.items()
        impacts = [self.model_copy(update={kind: value}) for value in values]
        particle, (struck, partner) = lab.material(series.material), self.partner_of(series, lab)
        pairs = [impact.pair(lab, series) for impact in impacts]
        distinct = list(dict.fromkeys(pairs))
        same = self.partner == "particle" and struck == series.material
        types = [(series.material, particle)] * len(distinct)
        types += [] if same else [(struck, partner)]
        times = [
            hertz_time(particle, self.radius_m, partner, self.struck_radius_m, one.closing_m_s)
            for one in impacts
        ]
        dt = round_to(min(times) / steps, 4)
        bodies: list[PlacedSphere] = []
        contacts: list[ContactFacts] = []
        for value, impact, pair in zip(values, impacts, pairs, strict=True):
            first, own = len(bodies) + 1, distinct.index(pair) + 1
            bodies += impact.bodies(len(contacts), own, own if same else len(types), dt)
            met = first + 1 if self.partner == "particle" else "plane"
            contacts.append(ContactFacts(first, met, value))
        words = lab.series(series.material, struck)
        return self.made(
            name,
            *(series.material, struck, "limited" if limit_force else "unlimited"),
            *([f"{steps}-steps"] if self.steps_per_contact else []),
            series=words,
            vary=kind,
            steps_per_contact=steps,
            contacts=contacts,
            title=f"{self.title}: {words}",
            types=types,
            pairs={(at, at if same else len(types)): pair for at, pair in enumerate(distinct, 1)},
            bodies=bodies,
            walls=[Wall("plane", len(types), "zplane 0.0")] if self.partner == "plane" else [],
            limit_force=limit_force,
            timestep_s=dt,
            steps=math.ceil(_LONGEST_CONTACTS * max(times) / dt + 4 * _APPROACH_STEPS),
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
            own = lab.pair(series.material, series.against or series.material).model_dump()
            known = {key: own[key] if known[key] is None else known[key] for key in known}
        return Pair.model_validate(known)

    def bodies(
        self, at: int, own: int, struck_type: int, timestep_s: float
    ) -> Iterator[PlacedSphere]:
        """The particle above its partner, moving down and along +x, and the partner.

        Spin moves the particle's underside along +x.
        """
        struck, angle = self.struck_radius_m, math.radians(self.angle_deg)
        y = at * 6 * max(self.radius_m, struck or 0.0)
        gap = _APPROACH_STEPS * timestep_s * self.closing_m_s
        place = (0.0, y, (struck or 0.0) + gap + self.radius_m)
        along = self.tangential_m_s + self.speed_m_s * math.sin(angle)
        velocity = (along, 0.0, -self.speed_m_s * math.cos(angle))
        spin = 0.0 - self.spin_m_s / self.radius_m
        yield PlacedSphere(own, self.radius_m, place, velocity, (0.0, spin, 0.0))
        if struck is not None:
            velocity, spin = (0.0, 0.0, self.partner_speed_m_s), spin * self.partner_spin
            yield PlacedSphere(struck_type, struck, (0.0, y, 0.0), velocity, (0.0, spin, 0.0))


# --- tests that the suite has once each -----------------------------------------------------


class OnWall(Test):
    """Particles of a material and walls of another."""

    material: str
    against: str
    radius_m: Positive
    steps_per_contact: list[Whole]


class Bounce(OnWall):
    """One elastic particle between two walls: what many impacts do to its energy."""

    speed_m_s: Positive
    impacts: Whole
    flight_contacts: Positive = Field(description="flight between impacts over the contact time")

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """A run for each number of steps."""
        particle, wall = lab.material(self.material), lab.material(self.against)
        time = hertz_time(particle, self.radius_m, wall, None, self.speed_m_s)
        flight = self.flight_contacts * time
        top = 2 * self.radius_m + self.speed_m_s * flight
        for steps in self.steps_per_contact:
            dt = round_to(time / steps, 4)
            yield self.made(
                name,
                f"{steps}-steps",
                series=lab.series(self.material, self.against),
                vary="impact",
                steps_per_contact=steps,
                contacts=[ContactFacts(1, "floor", 0)],
                impacts=self.impacts,
                types=[(self.material, particle), (self.against, wall)],
                pairs={(1, 2): Pair(restitution=1, friction=0)},
                bodies=[PlacedSphere(1, self.radius_m, (0, 0, top / 2), (0, 0, -self.speed_m_s))],
                walls=[Wall("floor", 2, "zplane 0.0"), Wall("ceiling", 2, f"zplane {top!r}")],
                timestep_s=dt,
                steps=math.ceil(self.impacts * (flight + 1.03 * time) / dt),
                period=max(1, steps // 5),
            )


class Collision(Model):
    """A closed collision of two particles."""

    axis: tuple[Number, Number, Number]
    velocity_m_s: tuple[Number, Number, Number]
    spin_rad_s: tuple[Number, Number, Number]
    partner_spin_rad_s: tuple[Number, Number, Number]

    @property
    def direction(self) -> Vector:
        """Unit vector from the partner to the first particle."""
        size = math.hypot(*self.axis)
        x, y, z = (component / size for component in self.axis)
        return (x, y, z)

    @property
    def closing_m_s(self) -> float:
        """Speed at which the first particle comes down its line of centres, m/s."""
        return -sum(v * x for v, x in zip(self.velocity_m_s, self.direction, strict=True))


class Momentum(Test):
    """Closed collisions in any direction: momentum is kept."""

    material: str
    radii_m: tuple[Positive, Positive]
    collisions: list[Collision]

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """All collisions in one run."""
        particle, (first, second) = lab.material(self.material), self.radii_m
        times = [
            hertz_time(particle, first, particle, second, collision.closing_m_s)
            for collision in self.collisions
        ]
        dt = round_to(min(times) / lab.steps_per_contact, 4)
        bodies = [
            body
            for at, collision in enumerate(self.collisions)
            for body in self._bodies(at, collision, dt)
        ]
        yield self.made(
            name,
            self.material,
            series=lab.series(self.material, self.material),
            vary="collision",
            steps_per_contact=lab.steps_per_contact,
            contacts=[ContactFacts(at, at + 1, (at + 1) / 2) for at in range(1, len(bodies), 2)],
            types=[(self.material, particle)],
            pairs={(1, 1): lab.pair(self.material, self.material)},
            bodies=bodies,
            timestep_s=dt,
            steps=math.ceil(_LONGEST_CONTACTS * max(times) / dt),
        )

    def _bodies(self, at: int, collision: Collision, timestep_s: float) -> Iterator[PlacedSphere]:
        first, second = self.radii_m
        distance = first + second + _APPROACH_STEPS * timestep_s * collision.closing_m_s
        centre = (0.0, at * 8 * second, 0.0)
        x, y, z = (c + distance * n for c, n in zip(centre, collision.direction, strict=True))
        yield PlacedSphere(1, first, (x, y, z), collision.velocity_m_s, collision.spin_rad_s)
        yield PlacedSphere(1, second, centre, spin_rad_s=collision.partner_spin_rad_s)


class Resting(OnWall):
    """Particles on a plane."""

    duration_s: Positive

    def resting(
        self,
        name: str,
        lab: Lab,
        slug: str,
        bodies: Sequence[PlacedSphere],
        frames: int,
        **more: Any,
    ) -> Experiment:
        """The run; its plane is the last type, and its particles have one each or share one."""
        particle, floor = lab.material(self.material), lab.material(self.against)
        steps, last = self.steps_per_contact[0], max(body.type for body in bodies) + 1
        fallen = mechanics.fall_speed(self.radius_m, lab.study.gravity_m_s2)
        dt = round_to(hertz_time(particle, self.radius_m, floor, None, fallen) / steps, 4)
        return self.made(
            name,
            slug,
            series=lab.series(self.material, self.against),
            steps_per_contact=steps,
            types=[*[(self.material, particle)] * (last - 1), (self.against, floor)],
            bodies=bodies,
            walls=[Wall("plane", last, "zplane 0.0")],
            timestep_s=dt,
            steps=math.ceil(self.duration_s / dt),
            period=max(1, round(self.duration_s / dt / frames)),
            **more,
        )


class StandingColumn(Resting):
    """Particles that stand on each other: what they do at rest."""

    particles: Whole

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run."""
        own, radius, numbers = self.material, self.radius_m, range(1, self.particles + 1)
        yield self.resting(
            name,
            lab,
            f"{self.particles}-particles",
            vary="particle",
            contacts=[ContactFacts(at, at - 1 or "plane", at) for at in numbers],
            pairs={(1, 2): lab.pair(own, self.against), (1, 1): lab.pair(own, own)},
            bodies=[PlacedSphere(1, radius, (0, 0, (2 * at - 1) * radius)) for at in numbers],
            gravity_m_s2=(0.0, 0.0, -lab.study.gravity_m_s2),
            frames=1000,
        )


class Incline(Resting):
    """Particles in steady motion on an incline; the friction differs from particle to particle."""

    angle_deg: Positive
    slip_ratio: list[Positive]
    restitution: Number

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run. Below a friction of 2/7 tan(angle), 1 / ratio of it, a sphere slips."""
        angle, size = math.radians(self.angle_deg), lab.study.gravity_m_s2
        ratios = dict(enumerate(self.slip_ratio, start=1))
        radius, last = self.radius_m, len(ratios) + 1
        pairs = {
            (at, last): Pair(restitution=self.restitution, friction=math.tan(angle) / 3.5 / ratio)
            for at, ratio in ratios.items()
        }
        yield self.resting(
            name,
            lab,
            f"{self.angle_deg:g}-degrees",
            vary="slip_ratio",
            contacts=[ContactFacts(at, "plane", ratio) for at, ratio in ratios.items()],
            angle_deg=self.angle_deg,
            pairs=pairs,
            bodies=[PlacedSphere(at, radius, (0, 6 * at * radius, radius)) for at in ratios],
            gravity_m_s2=(size * math.sin(angle), 0.0, -size * math.cos(angle)),
            frames=500,
        )


# --- the suite as a whole -------------------------------------------------------------------


class SuiteFile(Model):
    """The content of ``suite.yaml``: materials, tests and what the page says of them."""

    materials: dict[str, Substance]
    steps_per_contact: Whole
    notes: dict[str, str]
    axes: dict[str, dict[str, str | tuple[float, float]]]
    impacts: dict[str, Impacts]
    bounce: Bounce
    momentum: Momentum
    column: StandingColumn
    incline: Incline

    def tests(self) -> Mapping[str, Test]:
        """Every test by its name, in the order of the page."""
        single = ("bounce", "momentum", "column", "incline")
        return {**self.impacts, **{name: getattr(self, name) for name in single}}

    def lab(self, study: Study) -> Lab:
        """Where the experiments for a study are made."""
        return Lab(self.materials, study, self.steps_per_contact)


@cache
def suite_file() -> SuiteFile:
    """The suite that comes with the package."""
    file = Path(__file__).with_name("suite.yaml")
    return SuiteFile.model_validate(yaml.safe_load(file.read_text(encoding="utf-8")))


def suite_of(study: Study) -> Mapping[str, Experiment]:
    """The experiments of the suite for a study, by run id."""
    file = suite_file()
    lab = file.lab(study)
    every = (one for name, test in file.tests().items() for one in test.experiments(name, lab))
    return {experiment.case.run: experiment for experiment in every}

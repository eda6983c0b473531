"""The verification suite: what each test of ``suite.yaml`` asks LIGGGHTS for."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
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
    ExactPlane,
    Experiment,
    PlacedSphere,
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
        gap = _APPROACH_STEPS * timestep_s * self.closing_m_s
        place = (0.0, y, (struck or 0.0) + gap + self.radius_m)
        along = self.tangential_m_s + self.speed_m_s * math.sin(angle)
        velocity = (along, 0.0, -self.speed_m_s * math.cos(angle))
        spin = 0.0 - self.spin_m_s / self.radius_m
        yield PlacedSphere(own_type, self.radius_m, place, velocity, (0.0, spin, 0.0))
        if struck is not None:
            velocity, spin = (0.0, 0.0, self.partner_speed_m_s), spin * self.partner_spin
            yield PlacedSphere(struck_type, struck, (0.0, y, 0.0), velocity, (0.0, spin, 0.0))


# --- tests that the suite has once each -----------------------------------------------------

_RADIUS_M = 0.0025
"""Of the particles on walls, which are of the study's media, m; the walls are of its workpiece."""


def _bounces(lab: Lab, made: Make) -> Iterator[Experiment]:
    """One elastic particle between two walls: what many impacts do to its energy."""
    particle, wall = lab.material("media"), lab.material("workpiece")
    speed, impacts = 0.4429, 1000
    time = hertz_time(particle, _RADIUS_M, wall, None, speed)
    flight = 1.37 * time
    top = 2 * _RADIUS_M + speed * flight
    for steps in (20, 100):
        dt = round_to(time / steps, 4)
        yield made(
            [f"{steps}-steps"],
            series=lab.series("media", "workpiece"),
            vary="impact",
            steps_per_contact=steps,
            contacts=[ContactFacts(1, "floor", 0)],
            impacts=impacts,
            types=[("media", particle), ("workpiece", wall)],
            pairs={(1, 2): Pair(restitution=1, friction=0)},
            bodies=[PlacedSphere(1, _RADIUS_M, (0, 0, top / 2), (0, 0, -speed))],
            walls=[
                ExactPlane("floor", 2, "zplane 0.0"),
                ExactPlane("ceiling", 2, f"zplane {top!r}"),
            ],
            timestep_s=dt,
            steps=math.ceil(impacts * (flight + 1.03 * time) / dt),
            period=max(1, steps // 5),
        )


_COLLISIONS: tuple[tuple[Vector, Vector, Vector, Vector], ...] = (
    ((0, 0, 1), (0.3, 0.1, -0.5), (50, -20, 30), (0, 0, 0)),
    ((1, 2, 2), (-0.4, -0.1, -0.3), (-80, 10, 0), (30, 40, -10)),
    ((-3, 1, 1), (0.6, 0.2, -0.1), (0, 0, 200), (0, 150, 0)),
)
"""Closed collisions of two particles: line of centres, velocity of the first in m/s, spins of both
in rad/s."""


def _collisions(lab: Lab, made: Make) -> Iterator[Experiment]:
    """Closed collisions in any direction, all in one run: momentum is kept."""
    particle, first, second = lab.material("media"), 0.003, 0.0042
    lines = [np.array(axis) / math.hypot(*axis) for axis, *_ in _COLLISIONS]
    closing = [-float(np.dot(v, line)) for line, (_, v, *_) in zip(lines, _COLLISIONS, strict=True)]
    times = [hertz_time(particle, first, particle, second, speed) for speed in closing]
    dt = round_to(min(times) / lab.steps_per_contact, 4)
    bodies = []
    for at, (_, velocity, spin, partner_spin) in enumerate(_COLLISIONS):
        distance = first + second + _APPROACH_STEPS * dt * closing[at]
        centre = (0.0, at * 8 * second, 0.0)
        x, y, z = (centre + distance * lines[at]).tolist()
        bodies.append(PlacedSphere(1, first, (x, y, z), velocity, spin))
        bodies.append(PlacedSphere(1, second, centre, spin_rad_s=partner_spin))
    yield made(
        ["media"],
        series=lab.series("media", "media"),
        vary="collision",
        steps_per_contact=lab.steps_per_contact,
        contacts=[ContactFacts(at, at + 1, (at + 1) / 2) for at in range(1, len(bodies), 2)],
        types=[("media", particle)],
        pairs={(1, 1): lab.pair("media", "media")},
        bodies=bodies,
        timestep_s=dt,
        steps=math.ceil(_LONGEST_CONTACTS * max(times) / dt),
    )


def _on_plane(
    lab: Lab, make: Make, steps: int, duration_s: float, frames: int, bodies: Sequence[PlacedSphere]
) -> Make:
    """Particles on a plane, which is the last type; the particles have one each or share one."""
    particle, floor = lab.material("media"), lab.material("workpiece")
    last = max(body.type for body in bodies) + 1
    fallen = mechanics.fall_speed(_RADIUS_M, lab.study.gravity_m_s2)
    dt = round_to(hertz_time(particle, _RADIUS_M, floor, None, fallen) / steps, 4)
    return partial(
        make,
        series=lab.series("media", "workpiece"),
        steps_per_contact=steps,
        types=[*[("media", particle)] * (last - 1), ("workpiece", floor)],
        bodies=bodies,
        walls=[ExactPlane("plane", last, "zplane 0.0")],
        timestep_s=dt,
        steps=math.ceil(duration_s / dt),
        period=max(1, round(duration_s / dt / frames)),
    )


def _column(lab: Lab, made: Make) -> Iterator[Experiment]:
    """Particles that stand on each other: what they do at rest."""
    numbers = range(1, 6)
    bodies = [PlacedSphere(1, _RADIUS_M, (0, 0, (2 * at - 1) * _RADIUS_M)) for at in numbers]
    yield _on_plane(lab, made, 25, 0.12, 1000, bodies)(
        [f"{len(bodies)}-particles"],
        vary="particle",
        contacts=[ContactFacts(at, at - 1 or "plane", at) for at in numbers],
        pairs={(1, 2): lab.pair("media", "workpiece"), (1, 1): lab.pair("media", "media")},
        gravity_m_s2=(0.0, 0.0, -lab.study.gravity_m_s2),
    )


def _incline(lab: Lab, made: Make) -> Iterator[Experiment]:
    """Particles in steady motion on an incline.

    Below a friction of 2/7 tan(angle), 1 / ratio of it, a sphere slips.
    """
    degrees, ratios = 30.0, dict(enumerate((0.2, 0.5, 0.9, 1.0, 1.1, 1.5, 3.0, 10.0), start=1))
    angle, size, last = math.radians(degrees), lab.study.gravity_m_s2, len(ratios) + 1
    pairs = {
        (at, last): Pair(restitution=0.3, friction=math.tan(angle) / 3.5 / ratio)
        for at, ratio in ratios.items()
    }
    bodies = [PlacedSphere(at, _RADIUS_M, (0, 6 * at * _RADIUS_M, _RADIUS_M)) for at in ratios]
    yield _on_plane(lab, made, 100, 0.03, 500, bodies)(
        [f"{degrees:g}-degrees"],
        vary="slip_ratio",
        contacts=[ContactFacts(at, "plane", ratio) for at, ratio in ratios.items()],
        angle_deg=degrees,
        pairs=pairs,
        gravity_m_s2=(size * math.sin(angle), 0.0, -size * math.cos(angle)),
    )


_OTHERS: Mapping[str, Callable[[Lab, Make], Iterator[Experiment]]] = {
    "bounce": _bounces,
    "momentum": _collisions,
    "column": _column,
    "incline": _incline,
}


# --- the suite as a whole -------------------------------------------------------------------


class SuiteFile(Model):
    """The content of ``suite.yaml``: materials, tests and what the page says of them."""

    materials: dict[str, Substance]
    steps_per_contact: Whole
    notes: dict[str, str]
    impacts: dict[str, Impacts]
    others: dict[str, Test]

    def tests(self) -> Mapping[str, Test]:
        """Every test by its name, in the order of the page."""
        return {**self.impacts, **self.others}

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
    lab, experiments = file.lab(study), list[Experiment]()
    for name, test in file.tests().items():
        made = partial(experiment, name, test.number, test.title)
        experiments += (
            test.racks(lab, made) if isinstance(test, Impacts) else _OTHERS[name](lab, made)
        )
    return {experiment.case.run: experiment for experiment in experiments}

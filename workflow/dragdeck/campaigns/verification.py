"""The verification suite: its file, and the experiments that it stands for.

``verification.yaml`` says what is run; this module turns each entry into
experiments of the `collide` scene. What they must show is the business of
``dragchain.verification``, which sees the run folders alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, model_validator

from dragdeck.cases.case import digest
from dragdeck.decks.data_file import Vector
from dragdeck.decks.render import environment, write_run
from dragdeck.physics.contact_mechanics import (
    effective_modulus,
    hertz_contact_time,
    particle_mass,
    rayleigh_time,
)
from dragdeck.physics.rounding import round_to
from dragdeck.project import find_project, study_templates
from dragdeck.scenes.collide import (
    Body,
    Experiment,
    ExperimentFacts,
    Wall,
    collide_scene,
)
from dragdeck.study.base import Model, Number, Positive, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.model import Material, Study

GROUP = "verification"
"""Folder below ``results/``."""

RIGID = "rigid"
RIGID_FACTOR = 1e6
"""Stiffness of a rigid partner over the particle's: its own deformation is below 1 ppm.
The engine has no rigid material. The density of a rigid particle is 1,000-fold."""

APPROACH_STEPS = 10.4
"""Free flight before the first contact, in steps: not a whole number, so that
contact begins within a step, as it does in use."""

LONGEST_CONTACTS = 3.0
"""Length of an impact run over the Hertz time of its slowest impact."""

Kind = Literal["angle_deg", "tangential_m_s", "spin_m_s", "restitution"]


class Substance(Material):
    """A material and where its constants come from."""

    source: str = "the study"


class Series(Model):
    """One curve of a test: a particle's material and its partner's, none: the same or rigid."""

    material: str
    against: str | None = None


class Impacts(Model):
    """Impacts of single particles on a plane, or of pairs of particles."""

    number: Whole
    title: str
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
    def _one_variable(self) -> Impacts:
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


class Bounce(Model):
    """One elastic particle between two walls."""

    number: Whole
    title: str
    material: str
    against: str
    radius_m: Positive
    speed_m_s: Positive
    impacts: Whole
    flight_contacts: Positive = Field(description="flight between impacts over the contact time")
    steps_per_contact: list[Whole]


class Collision(Model):
    """A closed collision of two particles."""

    axis: tuple[Number, Number, Number]
    velocity_m_s: tuple[Number, Number, Number]
    spin_rad_s: tuple[Number, Number, Number]
    partner_spin_rad_s: tuple[Number, Number, Number]


class Momentum(Model):
    """Closed collisions in any direction."""

    number: Whole
    title: str
    material: str
    radii_m: tuple[Positive, Positive]
    collisions: list[Collision]


class Column(Model):
    """Particles that stand on each other."""

    number: Whole
    title: str
    material: str
    against: str
    radius_m: Positive
    particles: Whole
    duration_s: Positive
    steps_per_contact: list[Whole]


class Incline(Model):
    """Particles on an incline; the friction differs from particle to particle."""

    number: Whole
    title: str
    material: str
    against: str
    radius_m: Positive
    angle_deg: Positive
    slip_ratio: list[Positive]
    restitution: Number
    duration_s: Positive
    steps_per_contact: list[Whole]


class SuiteFile(Model):
    """The content of ``verification.yaml``."""

    materials: dict[str, Substance]
    steps_per_contact: Whole
    impacts: dict[str, Impacts]
    bounce: Bounce
    momentum: Momentum
    column: Column
    incline: Incline


def suite_file() -> SuiteFile:
    """Read the suite that comes with the package."""
    text = (
        resources.files("dragdeck.campaigns")
        .joinpath("verification.yaml")
        .read_text(encoding="utf-8")
    )
    return SuiteFile.model_validate(yaml.safe_load(text))


class Suite:
    """The experiments of a suite, for the materials of a study.

    Parameters
    ----------
    file : SuiteFile
    study : Study
        Gives ``media`` and ``workpiece`` and what they do to each other.
    """

    def __init__(self, file: SuiteFile, study: Study) -> None:
        self.file = file
        self.study = study
        particle, workpiece = study.media.material, study.workpiece.material
        self._own = {"media": particle, "workpiece": workpiece}
        own = {name: study.materials[real] for name, real in self._own.items()}
        self.materials: dict[str, Material] = {
            name: Material(**material.model_dump(exclude={"source"}))
            for name, material in {**file.materials, **own}.items()
        }

    @cached_property
    def experiments(self) -> dict[str, Experiment]:
        """Every experiment by its run id."""
        return {experiment.run: experiment for experiment in self._all()}

    def _all(self) -> Iterator[Experiment]:
        for name, test in self.file.impacts.items():
            yield from self._impacts(name, test)
        for steps in self.file.bounce.steps_per_contact:
            yield self._bounce(self.file.bounce, steps)
        yield self._momentum(self.file.momentum)
        yield self._column(self.file.column)
        yield self._incline(self.file.incline)

    # --- what the experiments share -------------------------------------------------------

    def partner(self, series: Series, plane: bool) -> tuple[str, Material]:
        """Name and material of the partner of a series."""
        own = self.materials[series.material]
        if series.against == RIGID or (plane and series.against is None):
            stiff = own.model_copy(
                update={
                    "youngs_modulus_pa": RIGID_FACTOR * own.youngs_modulus_pa,
                    "density_kg_m3": 1e3 * own.density_kg_m3,
                }
            )
            return RIGID, stiff
        name = series.against or series.material
        return name, self.materials[name]

    def pair(self, first: str, second: str) -> Pair:
        """What two of the study's materials do to each other."""
        return self.study.pair(self._own[first], self._own[second])

    def series(self, first: str, second: str) -> str:
        """Name of a series: the study's materials by their own names."""
        return f"{self._own.get(first, first)} on {self._own.get(second, second)}"

    def _experiment(self, name: str, number: int, slug: Sequence[str], **fields: Any) -> Experiment:
        """An experiment with its run id: a slug and 8 hex digits of all it depends on."""
        facts = ExperimentFacts(test=name, number=number, **fields.pop("facts"))
        experiment = Experiment(group=GROUP, run="", facts=facts, **fields)
        unnamed = collide_scene(experiment).case.model_dump(
            mode="json", by_alias=True, exclude={"title", "heading", "versions"}
        )
        run = "-".join([name, *slug, digest({**unnamed, "steps": experiment.steps})])
        return replace(experiment, run=run)

    # --- impacts --------------------------------------------------------------------------

    def _impacts(self, name: str, test: Impacts) -> Iterator[Experiment]:
        for series in test.series:
            for limit_force in test.limit_force:
                for steps in test.steps_per_contact or (self.file.steps_per_contact,):
                    yield self._rack(name, test, series, limit_force, steps)

    def _rack(
        self, name: str, test: Impacts, series: Series, limit_force: bool, steps: int
    ) -> Experiment:
        """All impacts of a series side by side, far from each other."""
        plane = test.partner == "plane"
        particle = self.materials[series.material]
        partner_name, partner = self.partner(series, plane)
        pairs = [self._pair_of(test, series, value) for value in test.values]
        distinct = list(dict.fromkeys(pairs))
        same = not plane and partner_name == series.material
        types = [(series.material, particle)] * len(distinct)
        if not same:
            types.append((partner_name, partner))
        normal = [_normal_speed(test, value) + test.partner_speed_m_s for value in test.values]
        second = None if plane else test.partner_radius_m or test.radius_m
        times = [
            contact_time(
                particle, test.radius_m, None if plane else partner, second, partner, speed
            )
            for speed in normal
        ]
        dt = round_to(min(times) / steps, 4)
        bodies: list[Body] = []
        contacts: list[dict[str, Any]] = []
        for at, value in enumerate(test.values):
            own_type = distinct.index(pairs[at]) + 1
            y = at * 6 * max(test.radius_m, second or 0.0)
            gap = APPROACH_STEPS * dt * normal[at]
            bodies.append(_particle(test, value, own_type, y, (second or 0.0) + gap))
            particle_id = len(bodies)
            if second is not None:
                partner_type = own_type if same else len(types)
                bodies.append(_partner(test, value, partner_type, y, second))
            contacts.append(
                {
                    "particle": particle_id,
                    "partner": len(bodies) if second is not None else "plane",
                    "value": value,
                }
            )
        last = len(types)
        slug = [series.material, partner_name, "limited" if limit_force else "unlimited"]
        return self._experiment(
            name,
            test.number,
            [*slug, *([f"{steps}-steps"] if test.steps_per_contact else [])],
            title=f"{test.title}: {self.series(series.material, partner_name)}",
            types=types,
            pairs={(at, at if same else last): pair for at, pair in enumerate(distinct, start=1)},
            bodies=bodies,
            walls=[Wall("plane", last, "zplane 0.0")] if plane else [],
            limit_force=limit_force,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, test.radius_m),
            steps=math.ceil(LONGEST_CONTACTS * max(times) / dt + 4 * APPROACH_STEPS),
            facts={
                "heading": test.title,
                "series": self.series(series.material, partner_name),
                "vary": test.kind,
                "steps_per_contact": steps,
                "contacts": contacts,
            },
        )

    def _pair_of(self, test: Impacts, series: Series, value: float) -> Pair:
        """Restitution and friction of one impact."""
        known = {"restitution": test.restitution, "friction": test.friction}
        if test.kind == "restitution":
            known["restitution"] = value
        if None in known.values():
            own = self.pair(series.material, series.against or series.material).model_dump()
            known = {key: own[key] if known[key] is None else known[key] for key in known}
        return Pair.model_validate(known)

    # --- the other experiments --------------------------------------------------------------

    def _bounce(self, test: Bounce, steps: int) -> Experiment:
        particle, wall = self.materials[test.material], self.materials[test.against]
        time = contact_time(particle, test.radius_m, None, None, wall, test.speed_m_s)
        dt = round_to(time / steps, 4)
        flight = test.flight_contacts * time
        top = 2 * test.radius_m + test.speed_m_s * flight
        return self._experiment(
            "bounce",
            test.number,
            [f"{steps}-steps"],
            title=test.title,
            types=[(test.material, particle), (test.against, wall)],
            pairs={(1, 2): Pair(restitution=1, friction=0)},
            bodies=[
                Body(
                    type=1,
                    radius_m=test.radius_m,
                    position_m=(0, 0, top / 2),
                    velocity_m_s=(0, 0, -test.speed_m_s),
                ),
            ],
            walls=[Wall("floor", 2, "zplane 0.0"), Wall("ceiling", 2, f"zplane {top!r}")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, test.radius_m),
            steps=math.ceil(test.impacts * (flight + 1.03 * time) / dt),
            period=max(1, steps // 5),
            facts={
                "heading": test.title,
                "series": self.series(test.material, test.against),
                "vary": "impact",
                "steps_per_contact": steps,
                "impacts": test.impacts,
                "contacts": [{"particle": 1, "partner": "floor", "value": 0}],
            },
        )

    def _momentum(self, test: Momentum) -> Experiment:
        particle = self.materials[test.material]
        first, second = test.radii_m
        speeds = [_approach(collision) for collision in test.collisions]
        times = [
            contact_time(particle, first, particle, second, particle, speed) for speed in speeds
        ]
        dt = round_to(min(times) / self.file.steps_per_contact, 4)
        bodies: list[Body] = []
        for at, (collision, speed) in enumerate(zip(test.collisions, speeds, strict=True)):
            n = _unit(collision.axis)
            distance = first + second + APPROACH_STEPS * dt * speed
            centre = (0.0, at * 8 * second, 0.0)
            place = tuple(c + distance * x for c, x in zip(centre, n, strict=True))
            bodies += [
                Body(type=1, radius_m=first, position_m=(place[0], place[1], place[2]),
                     velocity_m_s=collision.velocity_m_s, spin_rad_s=collision.spin_rad_s),
                Body(type=1, radius_m=second, position_m=centre, spin_rad_s=collision.partner_spin_rad_s),
            ]  # fmt: skip
        return self._experiment(
            "momentum",
            test.number,
            [test.material],
            title=test.title,
            types=[(test.material, particle)],
            pairs={(1, 1): self.pair(test.material, test.material)},
            bodies=bodies,
            walls=[],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, first),
            steps=math.ceil(LONGEST_CONTACTS * max(times) / dt),
            facts={
                "heading": test.title,
                "series": self.series(test.material, test.material),
                "vary": "collision",
                "steps_per_contact": self.file.steps_per_contact,
                "contacts": [
                    {"particle": 2 * at + 1, "partner": 2 * at + 2, "value": at + 1}
                    for at in range(len(test.collisions))
                ],
            },
        )

    def _column(self, test: Column) -> Experiment:
        particle, floor = self.materials[test.material], self.materials[test.against]
        radius, gravity = test.radius_m, self.study.gravity_m_s2
        dt = self._step_at_rest(test, gravity)
        return self._experiment(
            "column",
            test.number,
            [f"{test.particles}-particles"],
            title=test.title,
            types=[(test.material, particle), (test.against, floor)],
            pairs={
                (1, 2): self.pair(test.material, test.against),
                (1, 1): self.pair(test.material, test.material),
            },
            bodies=[
                Body(type=1, radius_m=radius, position_m=(0, 0, (2 * at + 1) * radius))
                for at in range(test.particles)
            ],
            walls=[Wall("plane", 2, "zplane 0.0")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, radius),
            steps=math.ceil(test.duration_s / dt),
            period=max(1, round(test.duration_s / dt / 1000)),
            gravity_m_s2=(0.0, 0.0, -gravity),
            facts={
                "heading": test.title,
                "series": self.series(test.material, test.against),
                "vary": "particle",
                "steps_per_contact": test.steps_per_contact[0],
                "contacts": [
                    {"particle": at + 1, "partner": at or "plane", "value": at + 1}
                    for at in range(test.particles)
                ],
            },
        )

    def _incline(self, test: Incline) -> Experiment:
        particle, floor = self.materials[test.material], self.materials[test.against]
        angle, size = math.radians(test.angle_deg), self.study.gravity_m_s2
        dt = self._step_at_rest(test, size)
        types = [(test.material, particle)] * len(test.slip_ratio)
        bodies = [
            Body(
                type=at,
                radius_m=test.radius_m,
                position_m=(0, 6 * at * test.radius_m, test.radius_m),
            )
            for at in range(1, len(types) + 1)
        ]
        last = len(types) + 1
        return self._experiment(
            "incline",
            test.number,
            [f"{test.angle_deg:g}-degrees"],
            title=test.title,
            types=[*types, (test.against, floor)],
            pairs={
                (at, last): Pair(
                    restitution=test.restitution, friction=math.tan(angle) / 3.5 / ratio
                )
                for at, ratio in enumerate(test.slip_ratio, start=1)
            },
            bodies=bodies,
            walls=[Wall("plane", last, "zplane 0.0")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, test.radius_m),
            steps=math.ceil(test.duration_s / dt),
            period=max(1, round(test.duration_s / dt / 500)),
            gravity_m_s2=(size * math.sin(angle), 0.0, -size * math.cos(angle)),
            facts={
                "heading": test.title,
                "series": self.series(test.material, test.against),
                "vary": "slip_ratio",
                "angle_deg": test.angle_deg,
                "steps_per_contact": test.steps_per_contact[0],
                "contacts": [
                    {"particle": at, "partner": "plane", "value": ratio}
                    for at, ratio in enumerate(test.slip_ratio, start=1)
                ],
            },
        )

    def _step_at_rest(self, test: Column | Incline, gravity_m_s2: float) -> float:
        """Time step for a particle at rest: its contact time at the speed of falling its radius."""
        particle, wall = self.materials[test.material], self.materials[test.against]
        speed = math.sqrt(2 * gravity_m_s2 * test.radius_m)
        time = contact_time(particle, test.radius_m, None, None, wall, speed)
        return round_to(time / test.steps_per_contact[0], 4)


def contact_time(
    particle: Material,
    radius_m: float,
    other: Material | None,
    other_radius_m: float | None,
    surface: Material,
    speed_m_s: float,
) -> float:
    """Hertz time of an impact on a plane (no other particle) or on another particle, s."""
    mass, radius = particle_mass(particle, radius_m), radius_m
    if other is not None and other_radius_m is not None:
        second = particle_mass(other, other_radius_m)
        mass = mass * second / (mass + second)
        radius = radius_m * other_radius_m / (radius_m + other_radius_m)
    return hertz_contact_time(mass, radius, effective_modulus(particle, surface), speed_m_s)


def _normal_speed(test: Impacts, value: float) -> float:
    """Normal speed of the particle, m/s."""
    return test.speed_m_s * (math.cos(math.radians(value)) if test.kind == "angle_deg" else 1.0)


def _particle(test: Impacts, value: float, type_: int, y_m: float, height_m: float) -> Body:
    """The particle above its partner, moving down and along +x.

    Spin moves its underside along +x.
    """
    along = {
        "angle_deg": test.speed_m_s * math.sin(math.radians(value)),
        "tangential_m_s": value,
    }.get(test.kind, 0.0)
    spin = -value / test.radius_m if test.kind == "spin_m_s" else 0.0
    return Body(
        type=type_,
        radius_m=test.radius_m,
        position_m=(0.0, y_m, height_m + test.radius_m),
        velocity_m_s=(along, 0.0, -_normal_speed(test, value)),
        spin_rad_s=(0.0, spin, 0.0),
    )


def _partner(test: Impacts, value: float, type_: int, y_m: float, radius_m: float) -> Body:
    spin = -value / test.radius_m * test.partner_spin if test.kind == "spin_m_s" else 0.0
    velocity: Vector = (0.0, 0.0, test.partner_speed_m_s)
    return Body(
        type=type_,
        radius_m=radius_m,
        position_m=(0.0, y_m, 0.0),
        velocity_m_s=velocity,
        spin_rad_s=(0.0, spin, 0.0),
    )


def _unit(vector: Vector) -> Vector:
    size = math.hypot(*vector)
    x, y, z = (component / size for component in vector)
    return (x, y, z)


def _approach(collision: Collision) -> float:
    """Speed at which the first particle comes down its line of centres, m/s."""
    n = _unit(collision.axis)
    return -sum(v * x for v, x in zip(collision.velocity_m_s, n, strict=True))


def suite_of(study: Study) -> Mapping[str, Experiment]:
    """The experiments of the suite for a study, by run id."""
    return Suite(suite_file(), study).experiments


def render_suite(study: str, fidelity: str | None) -> None:
    """Write the input files of the suite for the materials of a study."""
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]
    templates = environment(project.templates, study_templates(case))
    for run, experiment in suite_of(case.study).items():
        folder = project.experiment_folder(experiment.group, run)
        write_run(collide_scene(experiment), folder, templates)

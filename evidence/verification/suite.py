"""The verification suite: what each test of ``suite.yaml`` asks LIGGGHTS for."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path

import numpy as np
import yaml

from dragdeck.decks.deck import Vector
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.rounding import round_to
from dragdeck.study.base import Model, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.model import Study
from evidence.placed import ExactPlane
from evidence.verification.experiment import ContactFacts, Experiment, PlacedSphere, experiment
from evidence.verification.impacts import (
    APPROACH_STEPS,
    LONGEST_CONTACTS,
    Impacts,
    Lab,
    Make,
    Substance,
    Test,
    hertz_time,
)

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
        distance = first + second + APPROACH_STEPS * dt * closing[at]
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
        steps=math.ceil(LONGEST_CONTACTS * max(times) / dt),
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

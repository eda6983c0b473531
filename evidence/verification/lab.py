"""What the experiments of the verification suite share: materials, times, names."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from dragdeck.cases.case import digest
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.study.base import Model, Whole
from dragdeck.study.contact_law import Pair
from dragdeck.study.material import Material
from dragdeck.study.model import Study
from evidence.verification.collide import Body, ContactFacts, Experiment, collide_case

_GROUP = "verification"
"""Folder below ``results/``."""

RIGID = "rigid"
_RIGID_FACTOR = 1e6
"""Stiffness of a rigid partner over the particle's: its own deformation is below 1 ppm.
LIGGGHTS has no rigid material. The density of a rigid particle is 1,000-fold."""

APPROACH_STEPS = 10.4
"""Free flight before the first contact, in steps: not a whole number, so that
contact begins within a step, as it does in use."""

LONGEST_CONTACTS = 3.0
"""Length of an impact run over the Hertz time of its slowest impact."""


class Test(Model):
    """A test of the suite: its number and what a reader calls it."""

    number: Whole
    title: str


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

    @cached_property
    def _own(self) -> dict[str, str]:
        return {"media": self.study.media.material, "workpiece": self.study.workpiece.material}

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

    def time_at_rest(self, particle: str, wall: str, radius_m: float) -> float:
        """Contact time at the speed of falling a radius: the scale of a particle at rest, s."""
        speed = math.sqrt(2 * self.study.gravity_m_s2 * radius_m)
        materials = self.material(particle), self.material(wall)
        return contact_time(materials[0], radius_m, None, None, materials[1], speed)


Rows = Sequence[tuple[int, int | str, float]]
"""Contacts of an experiment: particle, partner and the value that is varied."""


def experiment(
    name: str,
    test: Test,
    slug: Sequence[str],
    *,
    types: Sequence[tuple[str, Material]],
    pairs: Mapping[tuple[int, int], Pair],
    bodies: Sequence[Body],
    contacts: Rows,
    steps: int,
    period: int | None = None,
    **more: Any,
) -> Experiment:
    """An experiment with its run id: a slug and 8 hex digits of all it depends on.

    Parameters
    ----------
    name : str
        Of the test.
    test : Test
    slug : sequence of str
        The readable part of the run id, after the name.
    types, pairs, bodies
        As `collide_case` has them; the first body sets the Rayleigh time.
    contacts : sequence of (int, int or str, float)
        Particle, partner and the value that is varied.
    steps, period : int
    **more
        Further fields of `CollideCase`.
    """
    given = {
        "title": test.title,
        "test": name,
        "number": test.number,
        "heading": test.title,
        "contacts": [ContactFacts(particle=a, partner=b, value=v) for a, b, v in contacts],
        "rayleigh_time_s": mechanics.rayleigh_time(types[0][1], bodies[0].radius_m),
    }
    case = collide_case(types, pairs, bodies, study=_GROUP, run="", **{**given, **more})
    content = case.model_dump(mode="json", by_alias=True, exclude={"title", "heading", "versions"})
    run = "-".join([name, *slug, digest({**content, "steps": steps})])
    return Experiment(case.model_copy(update={"run": run}), steps, period)


def contact_time(
    particle: Material,
    radius_m: float,
    other: Material | None,
    other_radius_m: float | None,
    surface: Material,
    speed_m_s: float,
) -> float:
    """Hertz time of an impact on a plane (no other particle) or on another particle, s."""
    mass, radius = mechanics.particle_mass(particle, radius_m), radius_m
    if other is not None and other_radius_m is not None:
        second = mechanics.particle_mass(other, other_radius_m)
        mass = mass * second / (mass + second)
        radius = radius_m * other_radius_m / (radius_m + other_radius_m)
    return mechanics.hertz_contact_time(
        mass, radius, mechanics.effective_modulus(particle, surface), speed_m_s
    )

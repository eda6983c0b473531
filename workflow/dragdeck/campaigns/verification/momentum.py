"""Closed collisions of two particles in any direction: momentum and energy are kept."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dragdeck.campaigns.verification.lab import (
    APPROACH_STEPS,
    GROUP,
    LONGEST_CONTACTS,
    Lab,
    Test,
    contact_time,
    facts,
    named,
)
from dragdeck.decks.data_file import Vector
from dragdeck.physics.contact_mechanics import rayleigh_time
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.collide import Body, Experiment
from dragdeck.study.base import Model, Number, Positive


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
    """Closed collisions in any direction."""

    material: str
    radii_m: tuple[Positive, Positive]
    collisions: list[Collision]

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """All collisions in one run."""
        particle, (first, second) = lab.material(self.material), self.radii_m
        times = [
            contact_time(particle, first, particle, second, particle, collision.closing_m_s)
            for collision in self.collisions
        ]
        dt = round_to(min(times) / lab.steps_per_contact, 4)
        words = lab.series(self.material, self.material)
        rows = [(2 * at - 1, 2 * at, at) for at in range(1, len(self.collisions) + 1)]
        experiment = Experiment(
            group=GROUP,
            run="",
            title=self.title,
            types=[(self.material, particle)],
            pairs={(1, 1): lab.pair(self.material, self.material)},
            bodies=[
                body
                for at, collision in enumerate(self.collisions)
                for body in self._bodies(at, collision, dt)
            ],
            walls=[],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, first),
            steps=math.ceil(LONGEST_CONTACTS * max(times) / dt),
            facts=facts(name, self, "collision", words, lab.steps_per_contact, rows),
        )
        yield named(experiment, [self.material])

    def _bodies(self, at: int, collision: Collision, timestep_s: float) -> Iterator[Body]:
        first, second = self.radii_m
        distance = first + second + APPROACH_STEPS * timestep_s * collision.closing_m_s
        centre = (0.0, at * 8 * second, 0.0)
        x, y, z = (c + distance * n for c, n in zip(centre, collision.direction, strict=True))
        yield Body(
            type=1,
            radius_m=first,
            position_m=(x, y, z),
            velocity_m_s=collision.velocity_m_s,
            spin_rad_s=collision.spin_rad_s,
        )
        spin = collision.partner_spin_rad_s
        yield Body(type=1, radius_m=second, position_m=centre, spin_rad_s=spin)

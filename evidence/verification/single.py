"""Tests that the suite has once each.

An elastic particle between two walls shows what many impacts do to its energy, closed collisions
of two particles in any direction that momentum is kept, and a column and an incline what particles
do at rest and in steady motion on a plane.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from pydantic import Field

from dragdeck.decks.data_file import Vector
from dragdeck.physics.rounding import round_to
from dragdeck.study.base import Model, Number, Positive, Whole
from dragdeck.study.contact_law import Pair
from evidence.verification.collide import Body, Experiment, Wall
from evidence.verification.lab import (
    APPROACH_STEPS,
    LONGEST_CONTACTS,
    Lab,
    Test,
    contact_time,
    experiment,
)


class Bounce(Test):
    """One elastic particle between two walls."""

    material: str
    against: str
    radius_m: Positive
    speed_m_s: Positive
    impacts: Whole
    flight_contacts: Positive = Field(description="flight between impacts over the contact time")
    steps_per_contact: list[Whole]

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """A run for each number of steps."""
        for steps in self.steps_per_contact:
            yield self._experiment(name, lab, steps)

    def _experiment(self, name: str, lab: Lab, steps: int) -> Experiment:
        particle, wall = lab.material(self.material), lab.material(self.against)
        time = contact_time(particle, self.radius_m, None, None, wall, self.speed_m_s)
        dt = round_to(time / steps, 4)
        flight = self.flight_contacts * time
        top = 2 * self.radius_m + self.speed_m_s * flight
        falling = Body(
            type=1,
            radius_m=self.radius_m,
            position_m=(0, 0, top / 2),
            velocity_m_s=(0, 0, -self.speed_m_s),
        )
        return experiment(
            name,
            self,
            [f"{steps}-steps"],
            series=lab.series(self.material, self.against),
            vary="impact",
            steps_per_contact=steps,
            contacts=[(1, "floor", 0)],
            impacts=self.impacts,
            types=[(self.material, particle), (self.against, wall)],
            pairs={(1, 2): Pair(restitution=1, friction=0)},
            bodies=[falling],
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
        yield experiment(
            name,
            self,
            [self.material],
            series=lab.series(self.material, self.material),
            vary="collision",
            steps_per_contact=lab.steps_per_contact,
            contacts=[(2 * at - 1, 2 * at, at) for at in range(1, len(self.collisions) + 1)],
            types=[(self.material, particle)],
            pairs={(1, 1): lab.pair(self.material, self.material)},
            bodies=[
                body
                for at, collision in enumerate(self.collisions)
                for body in self._bodies(at, collision, dt)
            ],
            timestep_s=dt,
            steps=math.ceil(LONGEST_CONTACTS * max(times) / dt),
        )

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


class _Resting(Test):
    """Particles on a plane."""

    material: str
    against: str
    radius_m: Positive
    duration_s: Positive
    steps_per_contact: list[Whole]

    def resting(
        self,
        name: str,
        lab: Lab,
        slug: str,
        bodies: Sequence[Body],
        frames: int,
        **more: Any,
    ) -> Experiment:
        """The run; its plane is the last type, and its particles have one each or share one."""
        particle, floor = lab.material(self.material), lab.material(self.against)
        steps, last = self.steps_per_contact[0], max(body.type for body in bodies) + 1
        time = lab.time_at_rest(self.material, self.against, self.radius_m)
        dt = round_to(time / steps, 4)
        return experiment(
            name,
            self,
            [slug],
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


class Column(_Resting):
    """Particles that stand on each other."""

    particles: Whole

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run."""
        radius, numbers = self.radius_m, range(1, self.particles + 1)
        yield self.resting(
            name,
            lab,
            f"{self.particles}-particles",
            vary="particle",
            contacts=[(at, at - 1 or "plane", at) for at in numbers],
            pairs={
                (1, 2): lab.pair(self.material, self.against),
                (1, 1): lab.pair(self.material, self.material),
            },
            bodies=[
                Body(type=1, radius_m=radius, position_m=(0, 0, (2 * at - 1) * radius))
                for at in numbers
            ],
            gravity_m_s2=(0.0, 0.0, -lab.study.gravity_m_s2),
            frames=1000,
        )


class Incline(_Resting):
    """Particles on an incline; the friction differs from particle to particle."""

    angle_deg: Positive
    slip_ratio: list[Positive]
    restitution: Number

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run."""
        angle, size = math.radians(self.angle_deg), lab.study.gravity_m_s2
        ratios = dict(enumerate(self.slip_ratio, start=1))
        radius, last = self.radius_m, len(ratios) + 1
        yield self.resting(
            name,
            lab,
            f"{self.angle_deg:g}-degrees",
            vary="slip_ratio",
            contacts=[(at, "plane", ratio) for at, ratio in ratios.items()],
            angle_deg=self.angle_deg,
            pairs={(at, last): self._pair(angle, ratio) for at, ratio in ratios.items()},
            bodies=[
                Body(type=at, radius_m=radius, position_m=(0, 6 * at * radius, radius))
                for at in ratios
            ],
            gravity_m_s2=(size * math.sin(angle), 0.0, -size * math.cos(angle)),
            frames=500,
        )

    def _pair(self, angle_rad: float, ratio: float) -> Pair:
        """Friction over 2/7 tan(angle), below which a sphere slips as it rolls: 1 / ratio."""
        friction = math.tan(angle_rad) / 3.5 / ratio
        return Pair(restitution=self.restitution, friction=friction)

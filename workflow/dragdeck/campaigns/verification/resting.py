"""Particles on a plane under gravity: a column that stands, and particles on an incline."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from dragdeck.campaigns.verification.lab import Lab, Test, experiment
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.collide import Body, Experiment, Wall
from dragdeck.study.base import Number, Positive, Whole
from dragdeck.study.contact_law import Pair


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

"""Particles on a plane under gravity: a column that stands, and particles on an incline."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dragdeck.campaigns.verification.lab import GROUP, Lab, Test, facts, named
from dragdeck.physics.contact_mechanics import rayleigh_time
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

    def timestep(self, lab: Lab) -> float:
        """Time step, s, from the contact time at the speed of falling a radius."""
        time = lab.step_at_rest(self.material, self.against, self.radius_m)
        return round_to(time / self.steps_per_contact[0], 4)

    def frame_period(self, timestep_s: float, frames: int) -> int:
        """Steps between frames."""
        return max(1, round(self.duration_s / timestep_s / frames))


class Column(_Resting):
    """Particles that stand on each other."""

    particles: Whole

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run."""
        particle, floor = lab.material(self.material), lab.material(self.against)
        dt, words = self.timestep(lab), lab.series(self.material, self.against)
        numbers = range(1, self.particles + 1)
        rows = [(at, at - 1 or "plane", at) for at in numbers]
        experiment = Experiment(
            group=GROUP,
            run="",
            title=self.title,
            types=[(self.material, particle), (self.against, floor)],
            pairs={
                (1, 2): lab.pair(self.material, self.against),
                (1, 1): lab.pair(self.material, self.material),
            },
            bodies=[
                Body(
                    type=1,
                    radius_m=self.radius_m,
                    position_m=(0, 0, (2 * at - 1) * self.radius_m),
                )
                for at in numbers
            ],
            walls=[Wall("plane", 2, "zplane 0.0")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, self.radius_m),
            steps=math.ceil(self.duration_s / dt),
            period=self.frame_period(dt, 1000),
            gravity_m_s2=(0.0, 0.0, -lab.study.gravity_m_s2),
            facts=facts(name, self, "particle", words, self.steps_per_contact[0], rows),
        )
        yield named(experiment, [f"{self.particles}-particles"])


class Incline(_Resting):
    """Particles on an incline; the friction differs from particle to particle."""

    angle_deg: Positive
    slip_ratio: list[Positive]
    restitution: Number

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """One run."""
        particle, floor = lab.material(self.material), lab.material(self.against)
        dt, words = self.timestep(lab), lab.series(self.material, self.against)
        angle, size = math.radians(self.angle_deg), lab.study.gravity_m_s2
        ratios = dict(enumerate(self.slip_ratio, start=1))
        last = len(ratios) + 1
        rows = [(at, "plane", ratio) for at, ratio in ratios.items()]
        about = facts(name, self, "slip_ratio", words, self.steps_per_contact[0], rows)
        experiment = Experiment(
            group=GROUP,
            run="",
            title=self.title,
            types=[*[(self.material, particle)] * len(ratios), (self.against, floor)],
            pairs={(at, last): self._pair(angle, ratio) for at, ratio in ratios.items()},
            bodies=[
                Body(
                    type=at,
                    radius_m=self.radius_m,
                    position_m=(0, 6 * at * self.radius_m, self.radius_m),
                )
                for at in ratios
            ],
            walls=[Wall("plane", last, "zplane 0.0")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, self.radius_m),
            steps=math.ceil(self.duration_s / dt),
            period=self.frame_period(dt, 500),
            gravity_m_s2=(size * math.sin(angle), 0.0, -size * math.cos(angle)),
            facts=about.model_copy(update={"angle_deg": self.angle_deg}),
        )
        yield named(experiment, [f"{self.angle_deg:g}-degrees"])

    def _pair(self, angle_rad: float, ratio: float) -> Pair:
        """Friction over 2/7 tan(angle), below which a sphere slips as it rolls: 1 / ratio."""
        friction = math.tan(angle_rad) / 3.5 / ratio
        return Pair(restitution=self.restitution, friction=friction)

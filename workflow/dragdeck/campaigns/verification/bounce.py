"""One elastic particle between two walls: what many impacts do to its energy."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import Field

from dragdeck.campaigns.verification.lab import GROUP, Lab, Test, contact_time, facts, named
from dragdeck.physics.contact_mechanics import rayleigh_time
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.collide import Body, Experiment, Wall
from dragdeck.study.base import Positive, Whole
from dragdeck.study.contact_law import Pair


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
        words = lab.series(self.material, self.against)
        about = facts(name, self, "impact", words, steps, [(1, "floor", 0)])
        body = Body(
            type=1,
            radius_m=self.radius_m,
            position_m=(0, 0, top / 2),
            velocity_m_s=(0, 0, -self.speed_m_s),
        )
        experiment = Experiment(
            group=GROUP,
            run="",
            title=self.title,
            types=[(self.material, particle), (self.against, wall)],
            pairs={(1, 2): Pair(restitution=1, friction=0)},
            bodies=[body],
            walls=[Wall("floor", 2, "zplane 0.0"), Wall("ceiling", 2, f"zplane {top!r}")],
            limit_force=True,
            timestep_s=dt,
            rayleigh_time_s=rayleigh_time(particle, self.radius_m),
            steps=math.ceil(self.impacts * (flight + 1.03 * time) / dt),
            period=max(1, steps // 5),
            facts=about.model_copy(update={"impacts": self.impacts}),
        )
        return named(experiment, [f"{steps}-steps"])

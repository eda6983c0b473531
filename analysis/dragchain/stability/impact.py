"""Single impacts of a map: restitution, peak force, energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from dragchain.arrays import Floats
from dragchain.contact_law.hertz import sphere_mass
from dragchain.dumps.frame import Frame
from dragchain.run.kinematics import needed
from dragchain.stability.contacts import (
    PARTICLE,
    Contacts,
    centres,
    in_id_order,
    network_frequency,
    radii,
)
from dragchain.stability.measured import Measured
from dragchain.stability.points import PointRun
from dragchain.statistics.estimate import Estimate
from dragchain.tables.run_folder import Run


class Spread(NamedTuple):
    """Mean, smallest and largest value among the impacts of a run."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Floats) -> Self:
        """The spread of values."""
        return cls(float(values.mean()), float(values.min()), float(values.max()))

    def error(self, reference: Spread, scale: float = 1.0) -> Estimate:
        """The worst deviation from the reference's mean, over a scale."""
        ends = [(end - reference.mean) / scale for end in (self.low, self.high)]
        return Estimate.around(max(ends, key=abs), 0.0)


@dataclass(frozen=True, kw_only=True)
class Impacts(Measured):
    """Impacts met at different moments within a step; speeds are over that of the impact.

    Attributes
    ----------
    restitution, peak_force_n, tangential : Spread
        Normal speed after the impact, peak force, tangential speed after it.
    energy_after_over_before : float
        Largest among the impacts.
    """

    restitution: Spread
    peak_force_n: Spread
    tangential: Spread
    energy_after_over_before: float

    def energy_ratio(self, reference: Self | None) -> float:
        """Energy after over before, over what the reference has where its law itself gains."""
        fine = reference.energy_after_over_before if reference else 1.0
        return self.energy_after_over_before / max(1.0, fine)

    def errors(self, reference: Self) -> Mapping[str, Estimate]:
        """Of all impacts the worst counts."""
        peak = reference.peak_force_n
        return {
            "restitution": self.restitution.error(reference.restitution),
            "peak force": self.peak_force_n.error(peak, peak.mean),
            "tangential speed": self.tangential.error(reference.tangential),
        }

    def columns(self) -> dict[str, float]:
        """Restitution, peak force, energy and frequency."""
        return {
            **{f"restitution_{name}": end for name, end in self.restitution._asdict().items()},
            "peak_force_n": self.peak_force_n.mean,
            "energy_after_over_before": self.energy_after_over_before,
            "frequency_rad_s": self.frequency_rad_s,
        }


def measure_impacts(point: PointRun, run: Run) -> Impacts:
    """Measure the impacts of a run."""
    impact = needed(run.case.impact, "impact")
    plate = impact.size_ratio == 0.0
    frames = [in_id_order(frame) for frame in run.frames("particles")]
    first, last = frames[0], frames[-1]
    striking = slice(None) if plate else slice(0, None, 2)
    velocity = last.vectors("vx_m_s", "vy_m_s", "vz_m_s")
    speed = velocity if plate else velocity[0::2] - velocity[1::2]
    forces = (frame.vectors("force_x_n", "force_y_n", "force_z_n")[striking] for frame in frames)
    force = np.stack([np.linalg.norm(vectors, axis=1) for vectors in forces])
    overlap = max(float(_overlap(frame, plate).max()) for frame in frames)
    before, after = (
        _energy(frame, run.case.media.density_kg_m3).reshape(-1, 1 if plate else 2).sum(axis=1)
        for frame in (first, last)
    )
    deepest = Contacts(
        a=np.array([0]),
        b=np.array([-1 if plate else 1]),
        partner=np.array([PARTICLE]),  # a plate is of the particles' material
        normal=np.array([[0.0, 0.0, -1.0]]),
        overlap_m=np.array([overlap]),
    )
    effective = np.array([impact.effective_radius_m])
    bodies = radii(first)[: 1 if plate else 2]
    return Impacts(
        overlap_ratio=overlap / float(radii(first).min()),
        frequency_rad_s=network_frequency(run.case, point.sticks, bodies, deepest, effective),
        restitution=Spread.of(speed[:, 2] / impact.normal_speed_m_s),
        peak_force_n=Spread.of(force.max(axis=0)),
        tangential=Spread.of(speed[:, 0] / impact.speed_m_s),
        energy_after_over_before=float((after / before).max()),
    )


def _overlap(frame: Frame, plate: bool) -> Floats:
    centre, radius = centres(frame), radii(frame)
    if plate:
        return np.asarray(radius - centre[:, 2])
    distance = np.linalg.norm(centre[0::2] - centre[1::2], axis=1)
    return np.asarray(radius[0::2] + radius[1::2] - distance)


def _energy(frame: Frame, density_kg_m3: float) -> Floats:
    """Kinetic energy of each particle, spin included, J."""
    radius = radii(frame)
    mass = sphere_mass(radius, density_kg_m3)
    speed = (frame.vectors("vx_m_s", "vy_m_s", "vz_m_s") ** 2).sum(axis=1)
    spin = (frame.vectors("wx_rad_s", "wy_rad_s", "wz_rad_s") ** 2).sum(axis=1)
    return np.asarray(0.5 * mass * (speed + 0.4 * radius**2 * spin))

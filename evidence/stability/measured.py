"""What is measured of a run of the map, and what is made of it beside its reference.

Here for beds without a workpiece and for impacts, in `drag` for a workpiece that moves.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from dragchain.arrays import Floats
from dragchain.contact_law.hertz import sphere_mass
from dragchain.run.kinematics import needed
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate
from dragdeck.decks.case_file import CaseOfStudy
from dragdeck.dumps.frame import Frame
from evidence.stability import contacts as network
from evidence.stability.contacts import centres, in_id_order, network_frequency, radii
from evidence.stability.points import PointRun

COLUMNS = (
    "restitution_mean",
    "restitution_low",
    "restitution_high",
    "peak_force_n",
    "height_m",
    "peak_energy_j",
    "rest_energy_ratio",
    "drag_mean_n",
    "drag_half_width_n",
    "energy_after_over_before",
    "frequency_rad_s",
)
"""Columns of the table of points with what was measured; each regime has some of them."""


@dataclass(frozen=True, kw_only=True)
class Measured(ABC):
    """What a run of one regime showed.

    Attributes
    ----------
    overlap_ratio : float
        Largest overlap over the radius.
    frequency_rad_s : float
        Largest eigenfrequency of the contact network.
    """

    overlap_ratio: float
    frequency_rad_s: float

    @abstractmethod
    def energy_ratio(self, reference: Self | None) -> float | None:
        """Ratio of energies that `ENERGY_LIMITS` is for; None where the reference is needed."""

    @abstractmethod
    def errors(self, reference: Self) -> Mapping[str, Estimate]:
        """Deviations from the reference, by the quantity's name."""

    def columns(self) -> dict[str, float]:
        """What the table of points has of it."""
        return {name: value for name, value in vars(self).items() if name in COLUMNS}


# --- beds: one that settles, and one at rest under a load ------------------------------------


REST_FLOOR = 1e-7
"""Kinetic energy over N m g d below which a loaded bed is at rest whatever it did before."""

_LAST_SAMPLES = 50
"""Samples at the end of a resting bed's run whose mean energy counts: a quarter of them."""


@dataclass(frozen=True, kw_only=True)
class Bed(Measured):
    """A bed at the end of its run.

    Attributes
    ----------
    height_m : float
        Mean height of the particles' centres.
    height_scatter : float
        Of a reference: relative standard deviation of heights that differ by chance.
    """

    height_m: float
    height_scatter: float = 0.0

    def errors(self, reference: Self) -> Mapping[str, Estimate]:
        """The relative error of the height."""
        half_width = NORMAL_QUANTILE * math.sqrt(2.0) * reference.height_scatter
        return {"height": Estimate.around(self.height_m / reference.height_m - 1.0, half_width)}


@dataclass(frozen=True, kw_only=True)
class SettledBed(Bed):
    """A bed that settled, and its largest kinetic energy while it did."""

    peak_energy_j: float

    def energy_ratio(self, reference: Self | None) -> float | None:
        """Its largest energy over the reference's."""
        return None if reference is None else self.peak_energy_j / reference.peak_energy_j


@dataclass(frozen=True, kw_only=True)
class RestingBed(Bed):
    """A bed at rest, and its kinetic energy at the end over N m g d."""

    rest_energy_ratio: float

    def energy_ratio(self, reference: Self | None) -> float | None:
        """Its energy over the reference's, or over `REST_FLOOR`."""
        if reference is None:
            return None
        return self.rest_energy_ratio / max(reference.rest_energy_ratio, REST_FLOOR)


def measure_settled(point: PointRun, case: CaseOfStudy) -> SettledBed:
    """Measure a bed that settled."""
    *_, last = point.frames("particles")
    overlap, frequency = _bed_contacts(point, case, last)
    return SettledBed(
        overlap_ratio=overlap,
        frequency_rad_s=frequency,
        height_m=float(last.columns["z_m"].mean()),
        peak_energy_j=float(_bed_energy(point).max()),
    )


def measure_resting(point: PointRun, case: CaseOfStudy) -> RestingBed:
    """Measure a bed at rest; its contacts are those before the step under test begins."""
    first, *_, last = point.frames("particles")
    media = case.media
    mass = sphere_mass(media.radius_mean_m, media.density_kg_m3)
    unit = media.count * mass * case.gravity_m_s2 * 2.0 * media.radius_mean_m
    overlap, frequency = _bed_contacts(point, case, first)
    return RestingBed(
        overlap_ratio=overlap,
        frequency_rad_s=frequency,
        height_m=float(last.columns["z_m"].mean()),
        rest_energy_ratio=float(_bed_energy(point)[-_LAST_SAMPLES:].mean()) / unit,
    )


def _bed_contacts(point: PointRun, case: CaseOfStudy, frame: Frame) -> tuple[float, float]:
    """Largest overlap over the radius and largest frequency of a frame."""
    radius = radii(frame)
    contacts = network.touching(centres(frame), radius, case.bowl.radius_m)
    frequency = network_frequency(case, point.sticks, radius, contacts)
    return contacts.overlap_ratio(radius), frequency


def _bed_energy(point: PointRun) -> Floats:
    """Kinetic energy with that of the spins over time, J."""
    blocks = point.prints("thermo")
    return np.concatenate(
        [rows["kinetic_energy_j"] + rows["rotational_energy_j"] for rows in blocks]
    )


# --- impacts ---------------------------------------------------------------------------------


class Spread(NamedTuple):
    """Mean, smallest and largest value among the impacts of a run."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Floats) -> Self:
        """The spread of values."""
        return cls(float(values.mean()), float(values.min()), float(values.max()))

    def error(self, reference: "Spread", scale: float = 1.0) -> Estimate:
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


def measure_impacts(point: PointRun, case: CaseOfStudy) -> Impacts:
    """Measure the impacts of a run."""
    impact = needed(point.impact, "impact")
    plate = impact.size_ratio == 0.0
    frames = [in_id_order(frame) for frame in point.frames("particles")]
    first, last = frames[0], frames[-1]
    striking = slice(None) if plate else slice(0, None, 2)
    velocity = last.vectors("vx_m_s", "vy_m_s", "vz_m_s")
    speed = velocity if plate else velocity[0::2] - velocity[1::2]
    forces = (frame.vectors("force_x_n", "force_y_n", "force_z_n")[striking] for frame in frames)
    force = np.stack([np.linalg.norm(vectors, axis=1) for vectors in forces])
    overlap = max(float(_overlap(frame, plate).max()) for frame in frames)
    before, after = (
        _energy(frame, case.media.density_kg_m3).reshape(-1, 1 if plate else 2).sum(axis=1)
        for frame in (first, last)
    )
    deepest = network.Contacts(
        a=np.array([0]),
        b=np.array([-1 if plate else 1]),
        partner=np.array([network.PARTICLE]),  # a plate is of the particles' material
        normal=np.array([[0.0, 0.0, -1.0]]),
        overlap_m=np.array([overlap]),
    )
    effective = np.array([impact.effective_radius_m])
    bodies = radii(first)[: 1 if plate else 2]
    return Impacts(
        overlap_ratio=overlap / float(radii(first).min()),
        frequency_rad_s=network_frequency(case, point.sticks, bodies, deepest, effective),
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

"""Beds without a workpiece: one that settles, and one at rest under a load."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from dragchain.arrays import Floats
from dragchain.contact_law.hertz import sphere_mass
from dragchain.dumps.frame import Frame
from dragchain.run.kinematics import needed
from dragchain.stability.contacts import centres, network_frequency, radii, touching
from dragchain.stability.measured import NORMAL_95, Measured
from dragchain.stability.points import PointRun
from dragchain.statistics.estimate import Estimate
from dragchain.tables.run_folder import Run

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
        half_width = NORMAL_95 * math.sqrt(2.0) * reference.height_scatter
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


def measure_settled(point: PointRun, run: Run) -> SettledBed:
    """Measure a bed that settled."""
    *_, last = run.frames("particles")
    overlap, frequency = _contacts(point, run, last)
    return SettledBed(
        overlap_ratio=overlap,
        frequency_rad_s=frequency,
        height_m=float(last.columns["z_m"].mean()),
        peak_energy_j=float(_energy(run).max()),
    )


def measure_resting(point: PointRun, run: Run) -> RestingBed:
    """Measure a bed at rest; its contacts are those before the step under test begins."""
    first, *_, last = run.frames("particles")
    media = run.case.media
    mass = sphere_mass(media.radius_mean_m, media.density_kg_m3)
    unit = media.count * mass * run.case.gravity_m_s2 * 2.0 * media.radius_mean_m
    overlap, frequency = _contacts(point, run, first)
    return RestingBed(
        overlap_ratio=overlap,
        frequency_rad_s=frequency,
        height_m=float(last.columns["z_m"].mean()),
        rest_energy_ratio=float(_energy(run)[-_LAST_SAMPLES:].mean()) / unit,
    )


def _contacts(point: PointRun, run: Run, frame: Frame) -> tuple[float, float]:
    """Largest overlap over the radius and largest frequency of a frame."""
    radius = radii(frame)
    contacts = touching(centres(frame), radius, needed(run.case.bowl, "bowl").radius_m)
    frequency = network_frequency(run.case, point.sticks, radius, contacts)
    return contacts.overlap_ratio(radius), frequency


def _energy(run: Run) -> Floats:
    """Kinetic energy with that of the spins over time, J."""
    blocks = run.prints("thermo")
    return np.concatenate(
        [rows["kinetic_energy_j"] + rows["rotational_energy_j"] for rows in blocks]
    )

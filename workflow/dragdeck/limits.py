"""Limits that a healthy run never meets: past one of them a run is stopped.

They follow from the scene alone, so that nothing has to be known of the run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dragdeck.gates import Gate

ENERGY_FACTOR = 4.0
"""How far above the energy that a ball can have at all a run is stopped. An
assumption: 1 is the physical bound of the mean; the rest is room for a bed
whose elastic energy is set free and for what a tool gives to single balls."""

SPEED_FACTOR = 4.0
"""How far above the speed of a fall through the box plus the push from outside a
single ball may be. An assumption: 1 is what one contact can give; a ball that is
squeezed out between others gets more."""

GATE = "within its limits"


def run_limits(
    balls: int, mass_kg: float, gravity_m_s2: float, height_m: float, speed_m_s: float
) -> dict[str, Any]:
    """The entry ``limits`` of ``case.json``.

    No ball of a bed can gain more than by a free fall through the whole box,
    ``m g H``, on top of the largest speed v that something in the scene has from
    outside, ``m v^2 / 2``: contacts only take energy away.

    Parameters
    ----------
    balls : int
        How many there are.
    mass_kg : float
        Mass of the mean ball.
    gravity_m_s2 : float
    height_m : float
        Height H of the simulation box.
    speed_m_s : float
        Largest speed v that comes from outside: the first speed of a ball, or
        that of the tool.
    """
    available = mass_kg * (gravity_m_s2 * height_m + 0.5 * speed_m_s**2)
    return {
        "balls": balls,
        "mean_kinetic_energy_j": ENERGY_FACTOR * available,
        "speed_m_s": SPEED_FACTOR * math.sqrt(2 * available / mass_kg),
        "why": f"{ENERGY_FACTOR:g} times m (g H + v^2 / 2): a fall of {height_m:.3g} m "
        f"and a speed of {speed_m_s:.3g} m/s",
    }


@dataclass(frozen=True)
class Sample:
    """One row of ``thermo``: energies are totals of all balls, J; the fastest ball's speed, m/s."""

    step: int
    balls: int
    kinetic_energy_j: float
    rotational_energy_j: float
    fastest_ball_m_s: float

    @property
    def mean_energy_j(self) -> float:
        """Kinetic energy of a ball, spin included, J; NaN where there are no balls."""
        total = self.kinetic_energy_j + self.rotational_energy_j
        return total / self.balls if self.balls else math.nan


def read_samples(rows: Sequence[str], columns: Sequence[str]) -> list[Sample]:
    """Rows of a ``thermo`` file; headers, and a row that is not whole yet, are left out."""
    found = []
    for row in rows:
        words = row.split()
        if len(words) != len(columns) or not words[0].isdigit():
            continue
        try:
            values = dict(zip(columns, (float(word) for word in words), strict=True))
        except ValueError:
            continue
        found.append(
            Sample(
                int(values["step"]),
                int(values["balls"]) if math.isfinite(values["balls"]) else 0,
                values["kinetic_energy_j"],
                values["rotational_energy_j"],
                values["fastest_ball_m_s"],
            )
        )
    return found


def breach(samples: Sequence[Sample], limits: Mapping[str, Any]) -> Gate | None:
    """The first sample past a limit, as a gate that did not hold; None where there is none.

    Parameters
    ----------
    samples : sequence of Sample
    limits : mapping
        As `run_limits` makes it.
    """
    most, balls, fastest = limits["mean_kinetic_energy_j"], limits["balls"], limits["speed_m_s"]
    for sample in samples:
        energy = sample.mean_energy_j
        if sample.balls < balls:
            seen, limit = f"{sample.balls} balls", f"{balls} balls"
        elif not math.isfinite(energy):
            seen, limit = f"a kinetic energy of {energy}", "finite numbers"
        elif energy > most:
            seen = f"a mean kinetic energy of {energy:.3g} J a ball"
            limit = f"{most:.3g} J, {limits['why']}"
        elif sample.fastest_ball_m_s > fastest:
            seen = f"a ball at {sample.fastest_ball_m_s:.3g} m/s"
            limit = f"{fastest:.3g} m/s, {SPEED_FACTOR:g} times the speed of that energy"
        else:
            continue
        return Gate(GATE, False, f"{seen} at step {sample.step:,}", limit)
    return None


def held(limits: Mapping[str, Any]) -> Gate:
    """The gate of a run that met no limit."""
    most = limits["mean_kinetic_energy_j"]
    return Gate(GATE, True, "no limit met", f"{most:.3g} J a ball, {limits['why']}")

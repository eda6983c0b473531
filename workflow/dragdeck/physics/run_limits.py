"""Energies and speeds that no run of a scene can have, and limits of LIGGGHTS itself."""

import math
from dataclasses import dataclass

ENGINE_SOFTEST_PA = 5e6
"""`units si` of LIGGGHTS refuses a softer Young's modulus."""

ENGINE_NEIGHBOURS = 2000
"""Neighbours of a particle for which LIGGGHTS has room by itself (`neigh_modify one`)."""

ENGINE_HARD_PA = 1e9
"""Above this LIGGGHTS wants `hard_particles yes`."""

ENERGY_FACTOR = 4.0
"""How far above the energy that a particle can have at all a run is stopped. An
assumption: 1 is the physical bound of the mean; the rest is room for a bed
whose elastic energy is set free and for what a workpiece gives to single particles."""

SPEED_FACTOR = 4.0
"""How far above the speed of a fall through the box plus the push from outside a
single particle may be. An assumption: 1 is what one contact can give; a particle that is
squeezed out between others gets more."""


@dataclass(frozen=True)
class RunLimits:
    """Limits that no sample of a run may exceed.

    Attributes
    ----------
    n_particles : int
        Number of particles; fewer mean that one was lost.
    mean_kinetic_energy_j : float
        Largest mean kinetic energy per particle, rotation included, J.
    speed_m_s : float
        Largest speed of the fastest particle, m/s.
    why : str
        How the limits were derived.
    """

    n_particles: int
    mean_kinetic_energy_j: float
    speed_m_s: float
    why: str


def thrown_speed(gravity_m_s2: float, height_m: float, speed_m_s: float) -> float:
    """Speed above which a contact that was found too late has thrown a particle, m/s.

    A fall through a box of this height plus `SPEED_FACTOR` times the largest speed of what moves
    in it: particles that are squeezed out between others were seen at 2 to 3 times, once at 6
    times the speed of a slow workpiece.
    """
    return math.sqrt(2 * gravity_m_s2 * height_m) + SPEED_FACTOR * speed_m_s


def run_limits(
    particles: int, mass_kg: float, gravity_m_s2: float, height_m: float, speed_m_s: float
) -> RunLimits:
    """The limits of a run.

    No particle of a bed can gain more than by a free fall through the whole box,
    ``m g H``, on top of the largest speed v that something in the scene has from
    outside, ``m v^2 / 2``: contacts only take energy away.

    Parameters
    ----------
    particles : int
        How many there are.
    mass_kg : float
        Mass of the mean particle.
    gravity_m_s2 : float
    height_m : float
        Height H of the simulation box.
    speed_m_s : float
        Largest speed v that comes from outside: the first speed of a particle, or
        that of the workpiece.
    """
    available = mass_kg * (gravity_m_s2 * height_m + 0.5 * speed_m_s**2)
    return RunLimits(
        n_particles=particles,
        mean_kinetic_energy_j=ENERGY_FACTOR * available,
        speed_m_s=SPEED_FACTOR * math.sqrt(2 * available / mass_kg),
        why=f"{ENERGY_FACTOR:g} times m (g H + v^2 / 2): a fall of {height_m:.3g} m "
        f"and a speed of {speed_m_s:.3g} m/s",
    )

"""Single impacts, many at once: particles on a plate, or small particles on large ones."""

import math
from dataclasses import dataclass
from typing import Literal

from dragdeck.cases.bed import particle_material
from dragdeck.cases.case import Case
from dragdeck.decks import outputs
from dragdeck.decks.case_file import CaseOfStudy, MediaOfRun
from dragdeck.decks.data_file import Body, data_file
from dragdeck.decks.deck import Deck, Scene
from dragdeck.documents import Part
from dragdeck.physics.contact_mechanics import (
    effective_modulus,
    hertz_contact_time,
    particle_mass,
    rayleigh_time,
)
from dragdeck.physics.rounding import timestep
from dragdeck.physics.run_limits import RunLimits, run_limits
from dragdeck.scenes.scene import case_of_study, material_table

_PHASES = 16
"""Impacts in one run, each begun at another sixteenth of a step."""

_FRAMES_PER_CONTACT = 200
"""Frames written over a contact where the step is small enough."""

_CONTACT_TIMES = 4
"""Length of the run in elastic contact times: room for the slowest rebound."""


@dataclass(frozen=True)
class Impact:
    """How two bodies meet.

    Attributes
    ----------
    speed_m_s : float
        Relative speed.
    angle_deg : float
        Between the motion and the normal.
    size_ratio : float
        Radius of the struck particle over that of the striking one; 0 for a plate.
    """

    speed_m_s: float
    angle_deg: float
    size_ratio: float


@dataclass(frozen=True, kw_only=True)
class _ImpactDeck(Deck):
    """What the impact template sees."""

    plate: bool
    steps: int


class ImpactOfRun(Part):
    """How the bodies meet; the contact time is the elastic one (Hertz)."""

    speed_m_s: float
    normal_speed_m_s: float
    size_ratio: float
    effective_radius_m: float
    effective_mass_kg: float
    effective_modulus_pa: float
    contact_time_s: float


class ImpactCase(CaseOfStudy):
    """Single impacts."""

    scene: Literal["impact"] = "impact"
    impact: ImpactOfRun
    limits: RunLimits


def effective_body(study_radius_m: float, size_ratio: float, mass_kg: float) -> tuple[float, float]:
    """Effective radius, m, and mass, kg, of a particle and what it strikes (same density)."""
    if size_ratio == 0.0:
        return study_radius_m, mass_kg
    other = size_ratio**3
    return study_radius_m * size_ratio / (1 + size_ratio), mass_kg * other / (1 + other)


def impact_scene(case: Case, run: str, impact: Impact, fraction: float) -> Scene[ImpactCase]:
    """Impacts of the mean particle at a time step.

    Parameters
    ----------
    case : Case
        Gives the particle, its material and its pair with itself.
    impact : Impact
    fraction : float
        Time step over the Rayleigh time of the striking particle, the smaller one.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    material, radius = particle_material(study), study.media.radius_mean_m
    mass = particle_mass(material, radius)
    rayleigh = rayleigh_time(material, radius, scale)
    dt = timestep(rayleigh, fraction)
    body_radius, body_mass = effective_body(radius, impact.size_ratio, mass)
    modulus = effective_modulus(material, material, scale)
    normal_speed = impact.speed_m_s * math.cos(math.radians(impact.angle_deg))
    contact = hertz_contact_time(body_mass, body_radius, modulus, normal_speed)
    period = max(1, math.floor(contact / dt / _FRAMES_PER_CONTACT))
    frames = math.ceil((_CONTACT_TIMES * contact / dt + 10) / period)
    travel = impact.speed_m_s * frames * period * dt
    bodies = _bodies(radius, material.density_kg_m3, impact, dt)
    side = 6 * radius * max(1.0, impact.size_ratio) * _PHASES + travel
    height = 2 * radius * (2 + 2 * impact.size_ratio) + 2 * travel
    deck = _ImpactDeck(
        title="Single impacts",
        study=case.study_name,
        scene="impact",
        run=run,
        source="particles.data",
        materials=material_table(study, [study.media.material], scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=0.0,
        skin_m=radius,
        timestep_s=dt,
        outputs=(
            outputs.thermo(frames * period, frames * period),
            outputs.particles_and_forces(period, frames * period),
        ),
        thermo_steps=frames * period,
        plate=impact.size_ratio == 0.0,
        steps=frames * period,
    )
    largest = max(1.0, impact.size_ratio) ** 3
    return Scene(
        deck=deck,
        case=case_of_study(
            ImpactCase,
            case,
            run,
            {},
            dt,
            rayleigh,
            media=MediaOfRun(
                count=len(bodies),
                radius_mean_m=radius,
                radius_std_m=0.0,
                density_kg_m3=material.density_kg_m3,
            ),
            impact=ImpactOfRun(
                speed_m_s=impact.speed_m_s,
                normal_speed_m_s=normal_speed,
                size_ratio=impact.size_ratio,
                effective_radius_m=body_radius,
                effective_mass_kg=body_mass,
                effective_modulus_pa=modulus,
                contact_time_s=contact,
            ),
            limits=run_limits(len(bodies), largest * mass, 0.0, height, impact.speed_m_s),
        ),
        steps=frames * period,
        files={
            "particles.data": lambda: data_file(
                "impacts", 1, ((-side, side), (-side, side), (-height, height)), bodies
            )
        },
    )


def _bodies(radius_m: float, density_kg_m3: float, impact: Impact, dt: float) -> list[Body]:
    """A striking particle for each phase, and the particle it strikes if it is no plate."""
    angle = math.radians(impact.angle_deg)
    normal, along = impact.speed_m_s * math.cos(angle), impact.speed_m_s * math.sin(angle)
    struck_m = impact.size_ratio * radius_m
    pitch = 6 * max(radius_m, struck_m)
    bodies = []
    for phase in range(_PHASES):
        y = pitch * (phase - 0.5 * (_PHASES - 1))
        gap = normal * dt * (1 + (phase + 0.5) / _PHASES)
        place, velocity = (0.0, y, radius_m + gap), (along, 0.0, -normal)
        bodies.append(Body(1, radius_m, density_kg_m3, place, velocity))
        if struck_m > 0.0:
            bodies.append(Body(1, struck_m, density_kg_m3, (0.0, y, -struck_m)))
    return bodies

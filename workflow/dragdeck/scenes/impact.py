"""Single impacts, many at once: balls on a plate, or small balls on large ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import Any

from dragdeck import outputs
from dragdeck.cases import Case
from dragdeck.derive import ball_mass, effective_modulus, hertz_contact_time, rayleigh_time
from dragdeck.limits import run_limits
from dragdeck.scenes.common import Deck, Scene, ball_material, base_case, material_table, timestep

PHASES = 16
"""Impacts in one run, each begun at another sixteenth of a step."""

FRAMES_PER_CONTACT = 200
"""Frames written over a contact where the step is small enough."""

CONTACT_TIMES = 4
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
        Radius of the struck ball over that of the striking one; 0 for a plate.
    """

    speed_m_s: float
    angle_deg: float
    size_ratio: float


@dataclass(frozen=True, kw_only=True)
class ImpactDeck(Deck):
    """What the impact template sees."""

    plate: bool
    steps: int


@dataclass(frozen=True)
class Ball:
    """A ball as the data file states it: along x the tangential, along z the normal."""

    radius_m: float
    place_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]


def effective_body(study_radius_m: float, size_ratio: float, mass_kg: float) -> tuple[float, float]:
    """Effective radius, m, and mass, kg, of a ball and what it strikes (same density)."""
    if size_ratio == 0.0:
        return study_radius_m, mass_kg
    other = size_ratio**3
    return study_radius_m * size_ratio / (1 + size_ratio), mass_kg * other / (1 + other)


def impact_scene(case: Case, impact: Impact, fraction: float) -> Scene:
    """Impacts of the mean ball at a time step.

    Parameters
    ----------
    case : Case
        Gives the ball, its material and its pair with itself.
    impact : Impact
    fraction : float
        Time step over the Rayleigh time of the striking ball, the smaller one.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    material, radius = ball_material(study), study.media.radius_mean_m
    mass = ball_mass(material, radius)
    rayleigh = rayleigh_time(material, radius, scale)
    dt = timestep(rayleigh, fraction)
    body_radius, body_mass = effective_body(radius, impact.size_ratio, mass)
    modulus = effective_modulus(material, material, scale)
    normal_speed = impact.speed_m_s * math.cos(math.radians(impact.angle_deg))
    contact = hertz_contact_time(body_mass, body_radius, modulus, normal_speed)
    period = max(1, math.floor(contact / dt / FRAMES_PER_CONTACT))
    frames = math.ceil((CONTACT_TIMES * contact / dt + 10) / period)
    travel = impact.speed_m_s * frames * period * dt
    balls = _balls(radius, impact, dt)
    side = 6 * radius * max(1.0, impact.size_ratio) * PHASES + travel
    height = 2 * radius * (2 + 2 * impact.size_ratio) + 2 * travel
    deck = ImpactDeck(
        title="Single impacts",
        study=case.study_name,
        scene="impact",
        run="",
        source="balls.data",
        materials=material_table(study, [study.media.material], scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=0.0,
        skin_m=radius,
        timestep_s=dt,
        outputs=(
            outputs.thermo(frames * period, frames * period),
            outputs.balls_and_forces(period, frames * period),
        ),
        thermo_steps=frames * period,
        plate=impact.size_ratio == 0.0,
        steps=frames * period,
    )
    largest = max(1.0, impact.size_ratio) ** 3
    return Scene(
        deck=deck,
        case={
            **base_case(case, "drop", dt, rayleigh),
            "scene": "impact",
            "phases": [],
            "media": _media(case, len(balls)),
            "impact": {
                "speed_m_s": impact.speed_m_s,
                "normal_speed_m_s": normal_speed,
                "size_ratio": impact.size_ratio,
                "effective_radius_m": body_radius,
                "effective_mass_kg": body_mass,
                "effective_modulus_pa": modulus,
                "contact_time_s": contact,
            },
            "limits": run_limits(len(balls), largest * mass, 0.0, height, impact.speed_m_s),
        },
        steps=frames * period,
        files={"balls.data": _data(balls, material.density_kg_m3, side, height)},
    )


def _media(case: Case, count: int) -> dict[str, Any]:
    media = base_case(case, "drop", 1.0, 1.0)["media"]
    return {**media, "count": count, "radius_sd_m": 0.0}


def _balls(radius_m: float, impact: Impact, dt: float) -> list[Ball]:
    """A striking ball for each phase, and the ball it strikes if it is no plate."""
    angle = math.radians(impact.angle_deg)
    normal, along = impact.speed_m_s * math.cos(angle), impact.speed_m_s * math.sin(angle)
    pitch = 6 * radius_m * max(1.0, impact.size_ratio)
    rest = (0.0, 0.0, 0.0)
    return list(
        chain.from_iterable(
            _pair(
                radius_m,
                impact.size_ratio,
                pitch * (phase - 0.5 * (PHASES - 1)),
                normal * dt * (1 + (phase + 0.5) / PHASES),
                (along, 0.0, -normal),
                rest,
            )
            for phase in range(PHASES)
        )
    )


def _pair(
    radius_m: float,
    size_ratio: float,
    y: float,
    gap: float,
    velocity: tuple[float, float, float],
    rest: tuple[float, float, float],
) -> list[Ball]:
    striking = Ball(radius_m, (0.0, y, radius_m + gap), velocity)
    if size_ratio == 0.0:
        return [striking]
    other = size_ratio * radius_m
    return [striking, Ball(other, (0.0, y, -other), rest)]


def _data(balls: list[Ball], density: float, side: float, height: float) -> str:
    """The engine's data file, numbers that read back exactly."""
    places = (
        f"{i} 1 {2 * ball.radius_m!r} {density!r} {' '.join(map(repr, ball.place_m))}"
        for i, ball in enumerate(balls, 1)
    )
    speeds = (
        f"{i} {' '.join(map(repr, ball.velocity_m_s))} 0 0 0" for i, ball in enumerate(balls, 1)
    )
    box = [f"{-side!r} {side!r} {axis}lo {axis}hi" for axis in "xy"]
    head = ["impacts", "", f"{len(balls)} atoms", "1 atom types", ""]
    ends = [*box, f"{-height!r} {height!r} zlo zhi", ""]
    return "\n".join([*head, *ends, "Atoms", "", *places, "", "Velocities", "", *speeds, ""])

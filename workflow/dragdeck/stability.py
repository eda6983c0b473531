"""What to expect of a time step: shares of the Rayleigh time, steps per contact, errors.

The errors and the safe steps were measured on the engine by the stability map;
``data/stability.json`` holds them with engine version and date.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any

from dragdeck.cases import Case, SceneName
from dragdeck.derive import (
    ball_mass,
    effective_modulus,
    fall_speed,
    hertz_contact_time,
    rayleigh_time,
)
from dragdeck.scenes import Scene
from dragdeck.scenes.common import ball_material, smallest_radius
from dragdeck.scenes.fill import first_balls
from dragdeck.scenes.tool import tool_radius
from dragdeck.study import Study

REGIME: Mapping[SceneName, str] = {"drop": "impact", "fill": "settle", "process": "drag"}
"""The regime of the stability map that a scene belongs to."""

ORDINARY_RESTITUTION = 0.5
"""The map tells apart conditions below and above: strong damping needs smaller steps."""


@dataclass(frozen=True)
class Expected:
    """An error read from the measured table.

    Attributes
    ----------
    value : float
        Largest absolute error of the restitution that was seen.
    measured : bool
        Whether the number of steps lies within the measured range; if not,
        `value` is that of the range's nearest end.
    """

    value: float
    measured: bool


@dataclass(frozen=True)
class PairOutlook:
    """What a time step means for two bodies that meet.

    Attributes
    ----------
    bodies : str
    limiting : str
        The body with the smaller Rayleigh time.
    rayleigh_share : float
        Time step over that time.
    speed_m_s : float
        Expected speed of an impact.
    steps_per_contact : float
        Elastic Hertz contact time at that speed over the time step.
    error : Expected
    """

    bodies: str
    limiting: str
    rayleigh_share: float
    speed_m_s: float
    steps_per_contact: float
    error: Expected

    def __str__(self) -> str:
        outside = "" if self.error.measured else " (outside of the measured range)"
        return (
            f"{100 * self.rayleigh_share:.3g} % of the Rayleigh time ({self.limiting}), "
            f"{self.steps_per_contact:.3g} steps per contact at {self.speed_m_s:.3g} m/s, "
            f"error of restitution up to {self.error.value:.2g}{outside}"
        )


@lru_cache(maxsize=1)
def measured() -> dict[str, Any]:
    """The measured map: ``data/stability.json`` of this package."""
    file = resources.files("dragdeck").joinpath("data").joinpath("stability.json")
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def expected_error(
    steps: float, restitution: float, table: Mapping[str, Sequence[float]]
) -> Expected:
    """Error of the restitution at a number of steps per contact.

    Parameters
    ----------
    steps : float
    restitution : float
        From `ORDINARY_RESTITUTION` on, the errors of such impacts count.
    table : mapping
        ``steps_per_contact``, rising, and the errors seen there, ``worst`` and
        ``ordinary_worst``. Between them the error is interpolated on
        logarithmic scales.
    """
    ordinary = restitution >= ORDINARY_RESTITUTION
    known, errors = table["steps_per_contact"], table["ordinary_worst" if ordinary else "worst"]
    if steps <= known[0] or steps >= known[-1]:
        end = 0 if steps <= known[0] else -1
        return Expected(errors[end], steps == known[end])
    after = next(n for n, value in enumerate(known) if value > steps)
    low, high = known[after - 1], known[after]
    share = math.log(steps / low) / math.log(high / low)
    return Expected(errors[after - 1] ** (1 - share) * errors[after] ** share, True)


def impact_speed(case: Case, scene: SceneName) -> float:
    """Largest speed that an impact of a scene is expected to have, m/s.

    The fall from the drop's height, or from the top of the poured balls on top
    of their first speed; in a process the fastest motion of the tool.
    """
    study = case.study
    if scene == "drop":
        return fall_speed(study.drop.height_m, study.gravity_m_s2)
    if scene == "fill":
        balls = first_balls(study)
        first = float((balls.velocities_m_s**2).sum(axis=1).max())
        return math.sqrt(first + fall_speed(balls.top_m, study.gravity_m_s2) ** 2)
    motion, factor = study.motion, study.chosen_fidelity().speed_factor
    speeds = (motion.speed_m_s, motion.plunge_speed_m_s, motion.approach_speed_m_s)
    return factor * max(speeds)


def outlook(case: Case, scene: SceneName, timestep_s: float) -> list[PairOutlook]:
    """Every pair of bodies that meets in a scene, unlike ones included.

    The engine's own check of the time step looks at balls of one material only.

    Parameters
    ----------
    case : Case
    scene : str
    timestep_s : float
    """
    study = case.study
    scale = 1.0 if scene == "drop" else study.chosen_fidelity().youngs_modulus_scale
    drop = scene == "drop"
    radius = study.media.radius_mean_m if drop else smallest_radius(study)
    speed = impact_speed(case, scene)
    return [
        _pair(study, other, others_radius, radius, scale, speed, timestep_s, name)
        for name, other, others_radius in _partners(case, scene, radius)
    ]


def _partners(case: Case, scene: SceneName, radius: float) -> list[tuple[str, str, float]]:
    """What a ball meets: name, material, radius."""
    study = case.study
    if scene == "drop":
        return [("plate", study.workpiece.material, math.inf)]
    found = [
        ("ball", study.media.material, radius),
        ("bowl", study.bowl.material, study.bowl.radius_m),
    ]
    if scene == "process":
        found.append(("tool", study.workpiece.material, tool_radius(case)))
    return found


def _pair(
    study: Study,
    other: str,
    others_radius: float,
    radius: float,
    scale: float,
    speed: float,
    timestep_s: float,
    name: str,
) -> PairOutlook:
    ball, partner = ball_material(study), study.materials[other]
    times = {"ball": rayleigh_time(ball, radius, scale)}
    times.setdefault(name, rayleigh_time(partner, others_radius, scale))
    limiting = min(times, key=lambda body: times[body])
    mass = ball_mass(ball, radius)
    # the engine meets walls and facets as planes: half of it all for two balls
    share = 0.5 if name == "ball" else 1.0
    modulus = effective_modulus(ball, partner, scale)
    contact = hertz_contact_time(share * mass, share * radius, modulus, speed)
    steps = contact / timestep_s
    pair = study.pair(study.media.material, other)
    return PairOutlook(
        bodies=f"ball on {name}",
        limiting=limiting,
        rayleigh_share=timestep_s / times[limiting],
        speed_m_s=speed,
        steps_per_contact=steps,
        error=expected_error(steps, pair.restitution, measured()["restitution_error"]),
    )


def safe_share(case: Case, scene: SceneName) -> tuple[float, str]:
    """Largest step over the Rayleigh time that was safe in the scene's regime, and where from.

    Strongly damped balls have a limit of their own. The safety factor is not in it.
    """
    known = measured()
    lowest = min(pair.restitution for pair in case.study.pairs.values())
    strong = lowest < ORDINARY_RESTITUTION
    damping = "any restitution" if strong else f"restitution of {ORDINARY_RESTITUTION:g} or more"
    engine = ", ".join(known["engine_versions"])
    source = f"{REGIME[scene]}, {damping}; LIGGGHTS {engine}, {known['measured']}"
    return _regime_share(scene, lowest), source


def _regime_share(scene: SceneName, lowest_restitution: float) -> float:
    row = measured()["regimes"][REGIME[scene]]
    strong = lowest_restitution < ORDINARY_RESTITUTION
    return float(row["safe_fraction"] if strong else row["ordinary_fraction"])


def largest_share(scene: SceneName, lowest_restitution: float) -> float:
    """Largest step over the Rayleigh time that keeps the safety factor."""
    return float(measured()["safety_factor"]) * _regime_share(scene, lowest_restitution)


def notes(case: Case, name: SceneName, scene: Scene) -> list[tuple[str, str]]:
    """What ``check`` and ``explain`` say of a scene's time step: a heading and a text each."""
    step = scene.deck.timestep_s
    found = [(pair.bodies, str(pair)) for pair in outlook(case, name, step)]
    share, source = safe_share(case, name)
    factor = float(measured()["safety_factor"])
    own = step / scene.case["rayleigh_time_s"]
    verdict = "within" if own <= factor * share * (1 + 1e-9) else "ABOVE"
    text = (
        f"{100 * own:.3g} % is {verdict} {100 * factor * share:.3g} %: "
        f"{factor:g} (safety factor) times the {100 * share:.3g} % measured to be safe ({source})"
    )
    return [*found, ("safe step", text)]

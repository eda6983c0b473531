"""The fill: the balls fall into the bowl and come to rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dragdeck import outputs
from dragdeck.cases import Case
from dragdeck.derive import (
    DENSEST_RANDOM_PACKING,
    SOLID_FRACTION_ESTIMATE,
    ball_mass,
    bed_height,
    bed_overlap,
    bed_pressure,
    effective_modulus,
    fall_speed,
)
from dragdeck.errors import InputError
from dragdeck.limits import run_limits
from dragdeck.packing import FIRST_SPEED_M_S, Balls, pour
from dragdeck.ranks import Filling, Split, split
from dragdeck.ranks import warnings as rank_warnings
from dragdeck.scenes.common import (
    Deck,
    LeftOut,
    Scene,
    ball_material,
    base_case,
    bed_radii,
    bed_rayleigh_time,
    material_table,
    skin,
    timestep,
)
from dragdeck.similarity import rounded
from dragdeck.study import Study

CHECK_INTERVAL_S = 0.02
"""Time between two looks at the kinetic energy, about the fall over one ball."""

MOST_OVERLAP = 0.01
"""Overlap over the diameter, by the weight of the bed, above which a warning is given: an
assumption; forces on the tool are several times those of the weight."""

SETTLING_ESTIMATE_S = 0.5
"""Time from the last ball's arrival to rest, an estimate used for expectations only."""


@dataclass(frozen=True, kw_only=True)
class FillDeck(Deck):
    """What the fill template sees."""

    bowl_type: int
    bowl_radius_m: float
    energy_ratio: float
    energy_unit_j: float
    check_steps: int
    most_checks: int
    longest_s: float


def fill_scene(case: Case) -> Scene:
    """The fill of a case.

    Raises
    ------
    InputError
        More balls than the bowl holds; a ball wider than the bowl; a modulus
        that the engine refuses.
    """
    study = case.study
    check_capacity(case)
    fidelity = study.chosen_fidelity()
    rayleigh = bed_rayleigh_time(study)
    dt = timestep(rayleigh, fidelity.fill_timestep_fraction)
    check_steps = max(1, math.ceil(CHECK_INTERVAL_S / dt))
    balls = first_balls(study)
    top = box_top(study, balls)
    longest = study.fill.longest_s
    types = _fill_types(study)
    parts = rank_split(case, top)
    deck = FillDeck(
        title=f"Fill: {study.title}",
        study=case.study_name,
        scene="fill",
        run=case.run_ids["fill"],
        source="balls.data",
        materials=material_table(study, types, fidelity.youngs_modulus_scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=study.gravity_m_s2,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=(outputs.thermo(check_steps, None), outputs.settled_balls()),
        thermo_steps=check_steps,
        checkpoint_steps=5 * check_steps,
        processors=parts.line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=study.bowl.radius_m,
        energy_ratio=study.fill.energy_ratio,
        energy_unit_j=_energy_unit(study),
        check_steps=check_steps,
        most_checks=math.ceil(longest / (check_steps * dt)),
        longest_s=longest,
    )
    return Scene(
        deck=deck,
        case={
            **base_case(case, "fill", dt, rayleigh),
            "phases": [],
            "settled": {"energy_ratio": study.fill.energy_ratio},
            "limits": bed_limits(
                study, top, float(np.linalg.norm(balls.velocities_m_s, axis=1).max())
            ),
        },
        steps=round(_expected_time(study, balls) / dt),
        files={"balls.data": _balls_data(balls, study, top, len(types))},
        models={
            "every ball by name": "exactly the asked number, mean and spread of radii",
            "rest by a criterion": f"kinetic energy below {study.fill.energy_ratio:g} m g d a ball",
            "a step of its own": "balls in flight collide faster than a bed at rest",
        },
        leaves_out={
            "the tool": LeftOut("it comes later; cases that differ in it share this fill"),
            "contact output": LeftOut("nobody reads contacts before the drag", "fill_contacts"),
            "facets of the bowl": LeftOut("balls fall the same onto an exact plane and cylinder"),
        },
        warnings=[
            *rank_warnings(parts),
            *overlap_warnings(study),
            *_skin_warnings(study, balls, dt),
        ],
    )


def _fill_types(study: Study) -> list[str]:
    """A material for each engine type; a type the fill has no use for repeats the bowl's."""
    ball, bowl = study.media.material, study.bowl.material
    used = list(dict.fromkeys((ball, bowl)))
    return used + [bowl] * (len(study.type_names()) - len(used))


def first_balls(study: Study) -> Balls:
    """The balls of a study before they fall."""
    return pour(bed_radii(study), study.bowl.radius_m, study.seed)


def check_capacity(case: Case) -> None:
    """Refuse more balls than the bowl can hold.

    Raises
    ------
    InputError
        Even the densest random packing would stand above the rim.
    """
    study = case.study
    media, bowl = study.media, study.bowl
    height = _height(study, DENSEST_RANDOM_PACKING)
    if height > bowl.height_m:
        most = math.floor(media.count * bowl.height_m / height)
        raise InputError(
            "more balls than the bowl holds",
            file=case.file,
            field="media.count",
            value=f"{media.count}, which stand at least {height:.4g} m high",
            limit=f"{most} balls in a bowl {bowl.height_m:g} m high, at a solid fraction of "
            f"{DENSEST_RANDOM_PACKING} (random close packing)",
            remedy="take fewer balls, or a wider or higher bowl",
        )


def expected_surface(study: Study) -> float:
    """Height of the settled bed before it exists, m: an estimate."""
    return _height(study, SOLID_FRACTION_ESTIMATE)


def _height(study: Study, solid_fraction: float) -> float:
    """Height of the study's balls in its bowl at a solid fraction, m."""
    volume = float((4 / 3 * np.pi * bed_radii(study) ** 3).sum())
    return bed_height(volume, study.bowl.radius_m, solid_fraction)


def box_top(study: Study, balls: Balls) -> float:
    """Top of the simulation box, m: room for the falling balls, and for a tool above the bed.

    It must not depend on the tool: cases with other tools share this fill, and
    their runs inherit the box from its restart file.
    """
    diameter = 2 * study.media.radius_mean_m
    above_bed = 2 * expected_surface(study) + 8 * diameter
    return math.ceil(100 * max(balls.top_m, above_bed, 2 * study.bowl.height_m) + 5) / 100


def rank_split(case: Case, top_m: float) -> Split:
    """How the box of a case is split among its ranks.

    Parameters
    ----------
    case : Case
    top_m : float
        Top of the box.
    """
    study = case.study
    filling = Filling(
        balls=study.media.count,
        radius_m=study.bowl.radius_m,
        height_m=expected_surface(study),
        half_width_m=_half_width(study),
        bottom_m=-study.media.radius_mean_m,
        top_m=top_m,
        reach_m=2 * float(bed_radii(study).max()) + skin(study),
    )
    return split(case.ranks, filling)


def floor_overlap(study: Study) -> float:
    """Overlap of two balls at the floor under the bed's weight, over the diameter: an estimate."""
    ball, scale = ball_material(study), study.chosen_fidelity().youngs_modulus_scale
    pressure = bed_pressure(ball.density_kg_m3, study.gravity_m_s2, expected_surface(study))
    return bed_overlap(effective_modulus(ball, ball, scale), pressure)


def overlap_warnings(study: Study) -> list[str]:
    """A warning where balls are too soft for the bed above them."""
    overlap = floor_overlap(study)
    if overlap <= MOST_OVERLAP:
        return []
    scale = study.chosen_fidelity().youngs_modulus_scale
    stiffer = rounded(scale * (overlap / MOST_OVERLAP) ** 1.5, up=True)
    return [
        f"the weight of the bed presses balls at the floor {100 * overlap:.2g} % of a diameter "
        f"into each other, more than {100 * MOST_OVERLAP:g} %: the bed is denser than a real one; "
        f"take a fidelity.youngs_modulus_scale of at least {stiffer:g}"
    ]


def _skin_warnings(study: Study, balls: Balls, timestep_s: float) -> list[str]:
    """A warning where a falling ball outruns the neighbour lists, which fails the run."""
    speed = FIRST_SPEED_M_S + fall_speed(_free_fall(study, balls), study.gravity_m_s2)
    least = rounded(2 * speed * timestep_s, up=True)
    if skin(study) >= least:
        return []
    return [
        f"balls fall at up to {speed:.2g} m/s, more than half the neighbour skin of "
        f"{skin(study):.2g} m in a step: the run would fail for dangerous neighbour builds; take "
        f"a fidelity.skin_m of at least {least:g}, or a smaller fidelity.fill_timestep_fraction"
    ]


def bed_limits(study: Study, top_m: float, speed_m_s: float) -> dict[str, Any]:
    """Limits of a run with the whole bed in a box of that height."""
    mass = ball_mass(ball_material(study), study.media.radius_mean_m)
    return run_limits(study.media.count, mass, study.gravity_m_s2, top_m, speed_m_s)


def _energy_unit(study: Study) -> float:
    """Number of balls times m g d of the mean ball, J."""
    media = study.media
    mass = ball_mass(ball_material(study), media.radius_mean_m)
    return media.count * mass * study.gravity_m_s2 * 2 * media.radius_mean_m


def _expected_time(study: Study, balls: Balls) -> float:
    fall = fall_speed(_free_fall(study, balls), study.gravity_m_s2) / study.gravity_m_s2
    return fall + SETTLING_ESTIMATE_S


def _free_fall(study: Study, balls: Balls) -> float:
    """Height that the highest ball falls to the bed, m."""
    return max(balls.top_m - expected_surface(study), 0.0)


def _half_width(study: Study) -> float:
    """Half of the box's width, m."""
    return study.bowl.radius_m + 2 * study.media.radius_mean_m


def _balls_data(balls: Balls, study: Study, top_m: float, types: int) -> str:
    """The engine's data file: one line a ball, numbers that read back exactly."""
    side = _half_width(study)
    density = ball_material(study).density_kg_m3
    count = len(balls.radii_m)
    atoms = (
        f"{i + 1} 1 {2 * balls.radii_m[i]:.17g} {density!r} {x:.17g} {y:.17g} {z:.17g}"
        for i, (x, y, z) in enumerate(balls.positions_m)
    )
    speeds = (
        f"{i + 1} {u:.17g} {v:.17g} {w:.17g} 0 0 0"
        for i, (u, v, w) in enumerate(balls.velocities_m_s)
    )
    return "\n".join(
        [
            "balls before they fall",
            "",
            f"{count} atoms",
            f"{types} atom types",
            "",
            f"{-side!r} {side!r} xlo xhi",
            f"{-side!r} {side!r} ylo yhi",
            f"{-study.media.radius_mean_m!r} {top_m!r} zlo zhi",
            "",
            "Atoms",
            "",
            *atoms,
            "",
            "Velocities",
            "",
            *speeds,
            "",
        ]
    )

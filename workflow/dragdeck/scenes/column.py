"""Balls at rest under a load: a straight stack in a tube, or a settled bed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from dragdeck import outputs
from dragdeck.cases import Case
from dragdeck.derive import ball_mass, rayleigh_time
from dragdeck.limits import run_limits
from dragdeck.scenes.common import (
    Deck,
    Scene,
    ball_material,
    base_case,
    bed_rayleigh_time,
    material_table,
    skin,
    timestep,
)
from dragdeck.scenes.fill import box_top, first_balls

STACK = 12
"""Balls of a stack."""

TUBE_CLEARANCE = 0.02
"""Gap between a stack's balls and its tube, as a share of the radius: the stack
leans and has about two contacts with balls and one with the tube a ball."""

LOAD_FRACTION = 0.1
"""Step over the Rayleigh time while the balls come to rest under the load."""

LOAD_S = 0.15
"""Time they get for that, s."""

DRAG_S = 0.004
"""Time in which the drag takes a ball's speed to 1/e, s."""

TEST_STEPS = 4000
FRAME_STEPS = 20

Packing = Literal["stack", "bed"]


@dataclass(frozen=True, kw_only=True)
class ColumnDeck(Deck):
    """What the column template sees."""

    stack: bool
    bowl_type: int
    bowl_radius_m: float
    load_timestep_s: float
    load_steps: int
    test_steps: int
    drag_kg_s: float


def column_scene(
    case: Case, packing: Packing, load_factor: float, fraction: float, fill_run: str
) -> Scene:
    """Balls at rest under gravity times a factor, at a time step.

    Parameters
    ----------
    case : Case
    packing : str
        ``stack``, or ``bed``: the settled bed of a fill.
    load_factor : float
        On gravity.
    fraction : float
        Time step over the Rayleigh time of the smallest ball.
    fill_run : str
        Folder name of the fill, beside the columns'; not used by a stack.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    scale, radius = study.chosen_fidelity().youngs_modulus_scale, study.media.radius_mean_m
    stack = packing == "stack"
    material = ball_material(study)
    rayleigh = rayleigh_time(material, radius, scale) if stack else bed_rayleigh_time(study)
    dt, load_dt = timestep(rayleigh, fraction), timestep(rayleigh, LOAD_FRACTION)
    count = STACK if stack else study.media.count
    tube = (1 + TUBE_CLEARANCE) * radius if stack else study.bowl.radius_m
    top = 2 * radius * (STACK + 4) if stack else box_top(study, first_balls(study))
    types = study.type_names()
    gravity, mass = load_factor * study.gravity_m_s2, ball_mass(material, radius)
    deck = ColumnDeck(
        title="Balls at rest under a load",
        study=case.study_name,
        scene="column",
        run="",
        source="balls.data" if stack else f"../../fill/{fill_run}/fill.restart",
        materials=material_table(study, types, scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=gravity,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=(
            outputs.thermo(FRAME_STEPS, TEST_STEPS),
            outputs.balls(TEST_STEPS, 0, TEST_STEPS, False),
            outputs.contacts(TEST_STEPS, 0, TEST_STEPS),
        ),
        thermo_steps=FRAME_STEPS,
        stack=stack,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=tube,
        load_timestep_s=load_dt,
        load_steps=math.ceil(LOAD_S / load_dt),
        test_steps=TEST_STEPS,
        drag_kg_s=mass / DRAG_S,
    )
    base = base_case(case, "fill", dt, rayleigh)
    return Scene(
        deck=deck,
        case={
            **base,
            "scene": "column",
            "phases": [{"name": "test", "start_step": 0, "end_step": TEST_STEPS}],
            "gravity_m_s2": gravity,
            "media": {**base["media"], "count": count},
            "bowl": {"radius_m": tube, "walls": "primitive"},
            "column": {"packing": packing, "load_factor": load_factor},
            "limits": run_limits(count, mass, gravity, top, 0.0),
        },
        steps=math.ceil(LOAD_S / load_dt) + TEST_STEPS,
        files={"balls.data": _stack(case, radius, tube, top, len(types))} if stack else {},
    )


def _stack(case: Case, radius: float, tube: float, top: float, types: int) -> str:
    """The balls of a stack, leaning to and fro within the tube, just touching."""
    density: Any = ball_material(case.study).density_kg_m3
    lean = 0.9 * (tube - radius)
    rise = math.sqrt((2 * radius) ** 2 - (2 * lean) ** 2)
    rows = (
        f"{i + 1} 1 {2 * radius!r} {density!r} "
        f"{lean * (-1) ** i!r} {0.1 * lean * (i % 3 - 1)!r} {radius + i * rise * 1.0001!r}"
        for i in range(STACK)
    )
    side = 2 * tube
    head = ["a stack", "", f"{STACK} atoms", f"{types} atom types", ""]
    box = [f"{-side!r} {side!r} {axis}lo {axis}hi" for axis in "xy"]
    return "\n".join([*head, *box, f"{-radius!r} {top!r} zlo zhi", "", "Atoms", "", *rows, ""])

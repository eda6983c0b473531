"""Particles at rest under a load: a straight stack in a tube, or a settled bed."""

import math
from dataclasses import dataclass
from typing import Literal

from dragdeck.cases.bed import bed_rayleigh_time, particle_material, skin
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE, outputs
from dragdeck.decks.case_file import BowlOfRun, CaseOfStudy, MediaOfRun, Phase
from dragdeck.decks.data_file import Body, data_file
from dragdeck.decks.deck import Deck, Scene
from dragdeck.documents import Part
from dragdeck.physics.contact_mechanics import particle_mass, rayleigh_time
from dragdeck.physics.rounding import timestep
from dragdeck.physics.run_limits import RunLimits, run_limits
from dragdeck.scenes.filling import box_top, filling_content
from dragdeck.scenes.scene import case_of_study, material_table

_STACK = 12
"""Particles of a stack."""

_TUBE_CLEARANCE = 0.02
"""Gap between a stack's particles and its tube, as a fraction of the radius: the stack
leans and has about two contacts with particles and one with the tube a particle."""

_LOAD_FRACTION = 0.1
"""Step over the Rayleigh time while the particles come to rest under the load."""

_LOAD_S = 0.15
"""Time they get for that, s."""

_DRAG_S = 0.004
"""Time in which the drag takes a particle's speed to 1/e, s."""

_TEST_STEPS = 4000
_FRAME_STEPS = 20

Packing = Literal["stack", "bed"]


class LoadedPacking(Part):
    """Particles at rest under gravity times a factor."""

    packing: Packing
    load_factor: float


class ColumnCase(CaseOfStudy):
    """Particles at rest."""

    scene: Literal["column"] = "column"
    column: LoadedPacking
    limits: RunLimits


@dataclass(frozen=True, kw_only=True)
class _ColumnDeck(Deck):
    """What the column template sees."""

    stack: bool
    bowl_type: int
    bowl_radius_m: float
    load_timestep_s: float
    load_steps: int
    test_steps: int
    drag_kg_s: float


def column_scene(
    case: Case,
    run: str,
    packing: Packing,
    load_factor: float,
    fraction: float,
    filling_run: str,
) -> Scene[ColumnCase]:
    """Particles at rest under gravity times a factor, at a time step.

    Parameters
    ----------
    case : Case
    packing : str
        ``stack``, or ``bed``: the settled bed of a fill.
    load_factor : float
        On gravity.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    filling_run : str
        Folder name of the fill, beside the columns'; not used by a stack.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    scale, radius = study.chosen_fidelity().youngs_modulus_scale, study.media.radius_mean_m
    stack = packing == "stack"
    material = particle_material(study)
    rayleigh = rayleigh_time(material, radius, scale) if stack else bed_rayleigh_time(study)
    dt, load_dt = timestep(rayleigh, fraction), timestep(rayleigh, _LOAD_FRACTION)
    count = _STACK if stack else study.media.count
    tube = (1 + _TUBE_CLEARANCE) * radius if stack else study.bowl.radius_m
    top = 2 * radius * (_STACK + 4) if stack else box_top(study)
    types = study.type_names()
    gravity, mass = load_factor * study.gravity_m_s2, particle_mass(material, radius)
    deck = _ColumnDeck(
        title="Particles at rest under a load",
        study=case.study_name,
        scene="column",
        run=run,
        source="particles.data" if stack else f"../../filling/{filling_run}/{PACKING_FILE}",
        materials=material_table(study, types, scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=gravity,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=(
            outputs.thermo(_FRAME_STEPS, _TEST_STEPS),
            outputs.particles(_TEST_STEPS, 0, _TEST_STEPS, False),
            outputs.contacts(_TEST_STEPS, 0, _TEST_STEPS),
        ),
        thermo_steps=_FRAME_STEPS,
        stack=stack,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=tube,
        load_timestep_s=load_dt,
        load_steps=math.ceil(_LOAD_S / load_dt),
        test_steps=_TEST_STEPS,
        drag_kg_s=mass / _DRAG_S,
    )
    return Scene(
        deck=deck,
        case=case_of_study(
            ColumnCase,
            case,
            run,
            filling_content(case),
            dt,
            rayleigh,
            phases=[Phase(name="test", start_step=0, end_step=_TEST_STEPS)],
            gravity_m_s2=gravity,
            media=MediaOfRun(
                count=count,
                radius_mean_m=radius,
                radius_std_m=study.media.radius_std_m,
                density_kg_m3=material.density_kg_m3,
            ),
            bowl=BowlOfRun(radius_m=tube, walls="primitive"),
            column=LoadedPacking(packing=packing, load_factor=load_factor),
            limits=run_limits(count, mass, gravity, top, 0.0),
        ),
        steps=math.ceil(_LOAD_S / load_dt) + _TEST_STEPS,
        files={"particles.data": lambda: _stack(case, radius, tube, top, len(types))}
        if stack
        else {},
    )


def _stack(case: Case, radius: float, tube: float, top: float, types: int) -> str:
    """The particles of a stack, leaning to and fro within the tube, just touching."""
    density = particle_material(case.study).density_kg_m3
    lean = 0.9 * (tube - radius)
    rise = math.sqrt((2 * radius) ** 2 - (2 * lean) ** 2)
    bodies = [
        Body(1, radius, density,
             (lean * (-1) ** i, 0.1 * lean * (i % 3 - 1), radius + i * rise * 1.0001))
        for i in range(_STACK)
    ]  # fmt: skip
    side = 2 * tube
    return data_file("a stack", types, ((-side, side), (-side, side), (-radius, top)), bodies)

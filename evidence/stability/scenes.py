"""Scenes that only the stability map has: single impacts, and particles at rest under a load."""

import math
from dataclasses import dataclass
from typing import Literal

from dragdeck.cases.bed import bed_rayleigh_time, particle_material, skin
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE, outputs
from dragdeck.decks.deck import Body, Deck, Scene, data_file
from dragdeck.parts import Part
from dragdeck.physics.contact_mechanics import (
    effective_modulus,
    hertz_contact_time,
    particle_mass,
    rayleigh_time,
)
from dragdeck.physics.rounding import timestep
from dragdeck.physics.run_limits import RunLimits, run_limits
from dragdeck.physics.walls import Container, round_container
from dragdeck.records.bed import BowlOfRun, MediaOfRun
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import Phase
from dragdeck.scenes.bed_space import box_top
from dragdeck.scenes.scene import case_of_study, deck_of_study
from evidence.placed import COLLIDE, CollideDeck, ExactPlane

# --- single impacts, many at once: particles on a plate, or small particles on large ones ------

PHASES = 16
"""Impacts in one run, each begun at another sixteenth of a step."""

_FRAMES_PER_CONTACT = 200
"""Frames written over a contact where the step is small enough."""

_CONTACT_TIMES = 4
"""Length of the run in elastic contact times: room for the slowest rebound."""


class ImpactSettings(Part):
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

    @property
    def normal_speed_m_s(self) -> float:
        """Speed along the normal."""
        return self.speed_m_s * math.cos(math.radians(self.angle_deg))

    def effective_body(self, radius_m: float, mass_kg: float) -> tuple[float, float]:
        """Effective radius, m, and mass, kg, of a particle and what it strikes (same density)."""
        ratio, mass = self.size_ratio, self.size_ratio**3
        if ratio == 0.0:
            return radius_m, mass_kg
        return radius_m * ratio / (1 + ratio), mass_kg * mass / (1 + mass)


class ImpactCase(CaseOfRun):
    """Single impacts; the contact time is the elastic one (Hertz)."""

    scene: Literal["impact"] = "impact"
    impact: ImpactSettings
    contact_time_s: float
    limits: RunLimits


def impact_scene(
    case: Case, run: str, impact: ImpactSettings, fraction: float
) -> Scene[ImpactCase]:
    """Impacts of the mean particle at a time step.

    Parameters
    ----------
    case : Case
        Gives the particle, its material and its pair with itself.
    run : str
        The run id.
    impact : ImpactSettings
    fraction : float
        Time step over the Rayleigh time of the striking particle, the smaller one.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    material, radius = particle_material(study), study.media.typical_radius_m
    mass, rayleigh = particle_mass(material, radius), rayleigh_time(material, radius, scale)
    dt = timestep(rayleigh, fraction)
    body_radius, body_mass = impact.effective_body(radius, mass)
    modulus = effective_modulus(material, material, scale)
    contact = hertz_contact_time(body_mass, body_radius, modulus, impact.normal_speed_m_s)
    period = max(1, math.floor(contact / dt / _FRAMES_PER_CONTACT))
    steps = math.ceil((_CONTACT_TIMES * contact / dt + 10) / period) * period
    travel = impact.speed_m_s * steps * dt
    bodies = _bodies(radius, material.density_kg_m3, impact, dt)
    side = 6 * radius * max(1.0, impact.size_ratio) * PHASES + travel
    height = 2 * radius * (2 + 2 * impact.size_ratio) + 2 * travel
    largest = max(1.0, impact.size_ratio) ** 3
    deck = deck_of_study(
        CollideDeck,
        case,
        [study.media.main_material],
        title="Single impacts",
        scene="impact",
        run=run,
        source="particles.data",
        gravity_m_s2=0.0,
        skin_m=radius,
        timestep_s=dt,
        outputs=(outputs.thermo(steps, steps), outputs.particles_and_forces(period, steps)),
        thermo_steps=steps,
        walls=[ExactPlane("plate", 1, "zplane 0.0")] if impact.size_ratio == 0.0 else [],
        steps=steps,
    )
    content = case_of_study(
        ImpactCase,
        case,
        deck,
        rayleigh_time_s=rayleigh,
        media=MediaOfRun(
            count=len(bodies),
            radius_mean_m=radius,
            radius_std_m=0.0,
            density_kg_m3=material.density_kg_m3,
        ),
        impact=impact,
        contact_time_s=contact,
        limits=run_limits(len(bodies), largest * mass, 0.0, height, impact.speed_m_s),
    )
    box = ((-side, side), (-side, side), (-height, height))
    files = {"particles.data": lambda: data_file("impacts", 1, box, bodies)}
    return Scene(deck=deck, case=content, steps=steps, files=files, override=COLLIDE)


def _bodies(radius_m: float, density_kg_m3: float, impact: ImpactSettings, dt: float) -> list[Body]:
    """A striking particle for each phase, and the particle it strikes if it is no plate."""
    normal = impact.normal_speed_m_s
    along = impact.speed_m_s * math.sin(math.radians(impact.angle_deg))
    struck_m = impact.size_ratio * radius_m
    pitch = 6 * max(radius_m, struck_m)
    bodies = []
    for phase in range(PHASES):
        y = pitch * (phase - 0.5 * (PHASES - 1))
        gap = normal * dt * (1 + (phase + 0.5) / PHASES)
        place, velocity = (0.0, y, radius_m + gap), (along, 0.0, -normal)
        bodies.append(Body(1, radius_m, density_kg_m3, place, velocity))
        if struck_m > 0.0:
            bodies.append(Body(1, struck_m, density_kg_m3, (0.0, y, -struck_m)))
    return bodies


# --- particles at rest under a load: a straight stack in a tube, or a settled bed --------------

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

BedKind = Literal["stack", "bed"]


class LoadedPacking(Part):
    """Particles at rest under gravity times a factor."""

    packing: BedKind
    load_factor: float


class ColumnCase(CaseOfRun):
    """Particles at rest."""

    scene: Literal["column"] = "column"
    column: LoadedPacking
    limits: RunLimits


@dataclass(frozen=True, kw_only=True)
class _ColumnDeck(Deck):
    """What the column template sees."""

    stack: bool
    bowl_type: int
    bowl: Container
    load_timestep_s: float
    load_steps: int
    test_steps: int
    drag_kg_s: float


def column_scene(
    case: Case, run: str, load: LoadedPacking, fraction: float, filling_run: str
) -> Scene[ColumnCase]:
    """Particles at rest under gravity times a factor, at a time step.

    Parameters
    ----------
    case : Case
    run : str
        The run id.
    load : LoadedPacking
        A stack, or the settled bed of a fill.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    filling_run : str
        Folder name of the fill, beside the columns'; not used by a stack.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study, media = case.study, case.study.media
    scale, radius = study.chosen_fidelity().youngs_modulus_scale, media.typical_radius_m
    stack, material = load.packing == "stack", particle_material(study)
    rayleigh = rayleigh_time(material, radius, scale) if stack else bed_rayleigh_time(study)
    dt, load_dt = timestep(rayleigh, fraction), timestep(rayleigh, _LOAD_FRACTION)
    load_steps = math.ceil(_LOAD_S / load_dt)
    count = _STACK if stack else study.particle_count
    tube = (1 + _TUBE_CLEARANCE) * radius
    bowl = round_container(tube) if stack else study.bowl.container
    top = 2 * radius * (_STACK + 4) if stack else box_top(study)
    types = study.type_names()
    gravity, mass = load.load_factor * study.gravity_m_s2, particle_mass(material, radius)
    deck = deck_of_study(
        _ColumnDeck,
        case,
        types,
        title="Particles at rest under a load",
        scene="column",
        run=run,
        source="particles.data" if stack else f"../../filling/{filling_run}/{PACKING_FILE}",
        gravity_m_s2=gravity,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=(
            outputs.thermo(_FRAME_STEPS, _TEST_STEPS),
            outputs.particles(_TEST_STEPS, 0, _TEST_STEPS, [wall.name for wall in bowl.walls]),
            outputs.contacts(_TEST_STEPS, 0, _TEST_STEPS),
        ),
        thermo_steps=_FRAME_STEPS,
        stack=stack,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl=bowl,
        load_timestep_s=load_dt,
        load_steps=load_steps,
        test_steps=_TEST_STEPS,
        drag_kg_s=mass / _DRAG_S,
    )
    content = case_of_study(
        ColumnCase,
        case,
        deck,
        rayleigh_time_s=rayleigh,
        phases=[Phase(name="test", start_step=0, end_step=_TEST_STEPS)],
        gravity_m_s2=gravity,
        media=MediaOfRun(
            count=count,
            radius_mean_m=radius,
            radius_std_m=media.typical_std_m,
            density_kg_m3=material.density_kg_m3,
        ),
        bowl=BowlOfRun(**dict(bowl)),
        column=load,
        limits=run_limits(count, mass, gravity, top, 0.0),
    )
    files = {"particles.data": lambda: _stack(case, radius, tube, top, len(types))}
    steps = load_steps + _TEST_STEPS
    return Scene(deck=deck, case=content, steps=steps, files=files if stack else {})


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

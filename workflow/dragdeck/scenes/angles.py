"""Heaps and drums: the angle that the surface of the media makes with given coefficients.

A heap is what a slowly lifted cylinder leaves on a plate, a drum turns about its horizontal axis.
Plate and drum have a glued layer of particles, so that the media's own coefficients decide.
"""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case
from dragdeck.decks import outputs
from dragdeck.decks.deck import Body, Deck, Scene, data_file
from dragdeck.errors import InputError
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import tube
from dragdeck.mesh.surface import surface
from dragdeck.parts import Part
from dragdeck.physics.contact_mechanics import fall_time
from dragdeck.physics.estimates import SOLID_FRACTION_ESTIMATE
from dragdeck.physics.packing import pour
from dragdeck.physics.rounding import rounded
from dragdeck.physics.run_limits import ENGINE_SOFTEST_PA
from dragdeck.physics.walls import round_container
from dragdeck.records.case import CaseOfRun
from dragdeck.scenes.scene import case_of_study, deck_of_study
from dragdeck.study.calibration import Drum, Repose, Rig
from dragdeck.study.fidelity import Fidelity
from dragdeck.study.model import Study

STIFFNESS = 1e4
"""Young's modulus over density, gravity, and radius of the cylinder or drum: soft, but the angles
do not depend on it (docs/evidence/calibration.md)."""

_STEP = 0.5
"""Time step over the Rayleigh time."""

_LIFT, _SETTLE_S = 0.1, 0.3
"""Speed of the cylinder over the root of g d; time to settle before and after it is lifted, s."""

_TRANSIENT, _REVOLUTIONS, _FRAMES = 0.4, 1.1, 120
"""Revolutions of a drum before its angle is read, and altogether; frames in them."""

_FLATTEST = math.tan(math.radians(13))
"""Slope of a heap that the glued layer still carries as a whole."""


class AngleRun(Part):
    """What a heap or drum is simulated with.

    Attributes
    ----------
    rig : str
        ``repose`` or ``drum``.
    friction, rolling_friction : float
        Between particles.
    glued : int
        Particles of the glued layer, which have the first ids.
    drum_radius_m : float
        0 for a heap.
    counted_from : int
        First step at which a drum's angle is read.
    """

    rig: Rig
    friction: float
    rolling_friction: float
    seed: int
    glued: int = 0
    drum_radius_m: float = 0.0
    counted_from: int = 0


class AngleCase(CaseOfRun):
    """The ``case.json`` of a heap or drum."""

    scene: Literal["angles"] = "angles"
    angle: AngleRun


@dataclass(frozen=True, kw_only=True)
class AngleDeck(Deck):
    """What the template of heaps and drums sees.

    Attributes
    ----------
    glued : int
        Particles of the glued layer: they have the first ids.
    edge_m, bottom_m : float
        Radius of the glued layer of a heap, and height of the plate.
    drum_rad_s, lift_speed_m_s : float
        One of them is 0.
    lift_steps : (int, int)
        Steps at which the cylinder starts and stops.
    """

    glued: int
    edge_m: float
    bottom_m: float
    drum_rad_s: float
    lift_speed_m_s: float
    lift_steps: tuple[int, int]
    steps: int


class _Placed(NamedTuple):
    """Glued and free particles as centres and radii, (N, 4); a mesh; the box; times, s."""

    glued: Floats
    media: Floats
    mesh: str
    edge_m: float
    bottom_m: float
    top_m: float
    times_s: tuple[float, float, float]


def angle_scene(case: Case, run: AngleRun, stiffness: float = STIFFNESS) -> Scene[AngleCase]:
    """A heap or drum of the study's calibration with other coefficients.

    Raises
    ------
    InputError
        The drum does not hold its particles before they fall.
    """
    assert case.study.calibration is not None and case.study.calibration.angles is not None
    rig = case.study.calibration.angles.rigs[run.rig]
    study = _study(case.study, rig, run, stiffness)
    drum, size = (rig if isinstance(rig, Drum) else None), study.media.typical_radius_m
    speed = 0.0 if drum else _LIFT * math.sqrt(2 * study.gravity_m_s2 * size)
    placed = _drum(study, rig) if isinstance(rig, Drum) else _heap(study, rig, speed)
    dt, rayleigh = beds.bed_timestep(study, "timestep_fraction"), beds.bed_rayleigh_time(study)
    start, stop, end = (round(time / dt) for time in placed.times_s)
    period, glued, of = -(-end // _FRAMES), len(placed.glued), Case(case.file, {}, study)
    steps = _FRAMES * period
    read_with = {"glued": glued, "drum_radius_m": drum.radius_m if drum else 0.0}
    names = [study.media.main_material, study.bowl.material]
    deck = deck_of_study(
        AngleDeck,
        of,
        names,
        title=f"{run.rig}: {study.title}",
        scene="angles",
        run=run.rig,
        source="particles.data",
        gravity_direction=(0, -1, 0) if drum else (0, 0, -1),
        skin_m=beds.widest_skin(study),
        timestep_s=dt,
        rayleigh_time_s=rayleigh,
        outputs=(outputs.thermo(period, steps), outputs.particles(period, 0, steps, ())),
        thermo_steps=period,
        glued=glued,
        edge_m=placed.edge_m,
        bottom_m=placed.bottom_m,
        drum_rad_s=drum.rad_s if drum else 0.0,
        lift_speed_m_s=speed,
        lift_steps=(start, stop),
        steps=steps,
    )
    density = beds.particle_material(study).density_kg_m3
    rows = np.concatenate([placed.glued, placed.media]).tolist()
    bodies = [Body(1, radius, density, (x, y, z)) for x, y, z, radius in rows]
    side = -placed.edge_m - size, placed.edge_m + size
    box = side, side, (placed.bottom_m - size, placed.top_m + size)
    angle = run.model_copy(update={**read_with, "counted_from": stop})
    content = case_of_study(AngleCase, of, deck, angle=angle)
    media = content.media.model_copy(update={"count": len(bodies)})
    files = {
        "particles.data": lambda: data_file(deck.title, len(names), box, bodies),
        "rig.stl": lambda: placed.mesh,
    }
    return Scene(deck, content.model_copy(update={"media": media}), steps, files)


def _study(study: Study, rig: Repose | Drum, run: AngleRun, stiffness: float) -> Study:
    """The study with the media of a heap or drum, softened, and with its coefficients."""
    main, particle = study.media.main_material, beds.particle_material(study)
    count, length = _total(study, rig)
    modulus = stiffness * particle.density_kg_m3 * study.gravity_m_s2 * length
    least = min(study.materials[name].youngs_modulus_pa for name in (main, study.bowl.material))
    scale = rounded(max(modulus / particle.youngs_modulus_pa, ENGINE_SOFTEST_PA / least), up=True)
    soft = Fidelity(youngs_modulus_scale=min(1.0, scale), timestep_fraction=_STEP, ranks=1)
    pair = run.model_dump(include={"friction", "rolling_friction"})
    name, total = f"{main}-{main}", {"count": count, "mass_kg": None, "fill_height_m": None}
    changes = {
        "media": study.media.model_copy(update=total),
        "pairs": {**study.pairs, name: study.pairs[name].model_copy(update=pair)},
    }
    return study.model_copy(update={**changes, "fidelity": soft, "seed": run.seed})


def _total(study: Study, rig: Repose | Drum) -> tuple[int, float]:
    """Number of particles, and radius of cylinder or drum, m."""
    if isinstance(rig, Repose):
        return rig.count, rig.cylinder_radius_m
    count = rig.count(study.media.typical_radius_m, study.media.mean_volume_m3)
    return count, rig.radius_m


def _heap(study: Study, rig: Repose, speed_m_s: float) -> _Placed:
    """The cylinder on its glued layer, whose tops are at z = 0."""
    size, inner, radii = study.media.typical_radius_m, rig.cylinder_radius_m, beds.bed_radii(study)
    poured = pour([radii], round_container(inner), study.seed)
    volume = beds.bed_volume(study) / SOLID_FRACTION_ESTIMATE
    edge = max((3 * volume / math.pi / _FLATTEST) ** (1 / 3), inner) + 4 * size
    line = np.arange(-edge + size, edge - size, 2 * size)
    flat = np.stack(np.meshgrid(line, line)).reshape(2, -1)
    flat = flat[:, np.hypot(*flat) <= edge - size].T
    way, top = volume / math.pi / inner**2 + 4 * size, poured.top_m + 2 * size
    start = fall_time(top, study.gravity_m_s2) + _SETTLE_S
    stop = start + way / speed_m_s
    glued = np.column_stack([flat, np.full((len(flat), 2), (-size, size))])
    media = np.column_stack([poured.positions_m, poured.radii_m])
    mesh, times = stl_text(tube(inner, top, 2 * size)), (start, stop, stop + _SETTLE_S)
    return _Placed(glued, media, mesh, edge, -2 * size, top + way, times)


def _drum(study: Study, rig: Drum) -> _Placed:
    """The drum about z; gravity acts along -y."""
    size, radius, half = study.media.typical_radius_m, rig.radius_m, rig.width_m / 2
    around = np.arange(math.floor(math.pi * (radius - size) / size))
    rows = np.linspace(size - half, half - size, math.floor(half / size))
    angle, z = np.stack(np.meshgrid(math.tau * around / len(around), rows)).reshape(2, -1)
    ring = (radius - size) * np.stack([np.cos(angle), np.sin(angle)])
    radii = np.random.default_rng(study.seed).permutation(beds.bed_radii(study))
    step = 2.01 * float(radii.max())
    x, z_free = (np.arange(step / 2 - length, length - step / 2, step) for length in (radius, half))
    sites = np.stack(np.meshgrid(x, x, z_free)).reshape(3, -1).T
    sites = sites[np.hypot(*sites[:, :2].T) < radius - 2 * size - step / 2]
    if len(sites) < len(radii) or not len(rows):
        raise InputError(
            "the drum does not hold its particles before they fall",
            field="calibration.angles.drum.fill_fraction",
            value=rig.fill_fraction,
            remedy="use a smaller fill_fraction, or a larger drum",
        )
    sites = sites[np.argsort(sites[:, 1], kind="stable")][: len(radii)]
    corners = [
        [x, y, z] for z in (-half, half) for x in (-radius, radius) for y in (-radius, radius)
    ]
    mesh = stl_text(surface(corners, [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]))
    turn, begin = math.tau / rig.rad_s, fall_time(2 * radius, study.gravity_m_s2)
    times = 0.0, begin + _TRANSIENT * turn, begin + _REVOLUTIONS * turn
    glued = np.column_stack([*ring, z, np.full(len(z), size)])
    return _Placed(glued, np.column_stack([sites, radii]), mesh, radius, -half, half, times)

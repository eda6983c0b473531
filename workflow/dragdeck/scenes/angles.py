"""Heaps and drums: the angle that the surface of the media makes with given coefficients.

A heap is what a slowly lifted cylinder leaves on a plate, a drum turns about its horizontal axis.
Plate and drum carry a glued layer of particles, so that only the media's own coefficients matter.
"""

import math
from dataclasses import dataclass

import numpy as np

from dragdeck.cases.bed import (
    bed_density,
    bed_radii,
    bed_rayleigh_time,
    bed_timestep,
    bed_volume,
    particle_material,
    skin,
    widest_skin,
)
from dragdeck.cases.case import Case
from dragdeck.decks import outputs
from dragdeck.decks.deck import Body, Box, Deck, Scene, data_file
from dragdeck.errors import InputError
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import tube
from dragdeck.mesh.surface import surface
from dragdeck.physics.contact_mechanics import (
    ENGINE_SOFTEST_PA,
    bed_height,
    bed_overlap,
    bed_pressure,
    effective_modulus,
    fall_time,
)
from dragdeck.physics.packing import pour
from dragdeck.physics.rounding import rounded
from dragdeck.records.case import CaseOfRun, MediaOfRun
from dragdeck.scenes.scene import case_of_study, material_table
from dragdeck.study.calibration import Drum, Repose, Rig
from dragdeck.study.media import SOLID_FRACTION_ESTIMATE, Array
from dragdeck.study.model import Fidelity, Study

SOFT_OVERLAP = 0.003
"""Relative overlap by the weight of the media to which Young's modulus is reduced
(docs/evidence/calibration.md: the angles do not depend on it)."""

_STEP = 0.3
"""Time step over the Rayleigh time."""

_SETTLE_S, _REST_S = 0.3, 0.5
"""Time after the fall, before a cylinder is lifted, and after that, s."""

_TRANSIENT, _REVOLUTIONS = 0.4, 1.1
"""Revolutions of a drum before its angle is read, and altogether."""

_FRAMES = 120

_FLATTEST_DEG = 10.0
"""Angle of a heap that the glued layer still carries as a whole."""


@dataclass(frozen=True, kw_only=True)
class AngleDeck(Deck):
    """What the template of heaps and drums sees.

    Attributes
    ----------
    glued : int
        Particles of the glued layer: they have the first ids.
    radius_m : float
        Of the glued layer's edge, or of the drum.
    drum_rad_s, lift_speed_m_s : float
        One of them is 0.
    lift_from, lift_to, steps : int
        Steps at which the cylinder starts and stops, and of the whole run.
    counted_from : int
        First step of the statistics.
    """

    glued: int
    radius_m: float
    bottom_m: float
    drum_rad_s: float
    lift_speed_m_s: float
    lift_from: int
    lift_to: int
    steps: int
    counted_from: int


@dataclass(frozen=True)
class AnglePoint:
    """What a heap or drum is simulated with."""

    rig: Rig
    friction: float
    rolling_friction: float
    seed: int
    overlap: float = SOFT_OVERLAP


def angle_scene(case: Case, point: AnglePoint) -> Scene[CaseOfRun]:
    """A heap or drum of the study's calibration with other coefficients.

    Raises
    ------
    InputError
        The drum does not hold its particles before they fall, or a modulus that LIGGGHTS refuses.
    """
    assert case.study.calibration is not None and case.study.calibration.angles is not None
    rig = case.study.calibration.angles.rigs[point.rig]
    study = _study(case.study, rig, point)
    place = _drum if isinstance(rig, Drum) else _heap
    glued, media, box, mesh, times = place(study, rig, point.seed)  # type: ignore[operator]
    dt, rayleigh = bed_timestep(study, "timestep_fraction"), bed_rayleigh_time(study)
    lift_from, lift_to, end, counted = (math.ceil(time / dt) for time in times)
    period = -(-end // _FRAMES)
    steps = _FRAMES * period
    material, wall = study.media.main_material, rig.material or study.bowl.material
    of = Case(case.file, case.settings, study)
    scale = study.chosen_fidelity().youngs_modulus_scale
    deck = AngleDeck(
        title=f"{point.rig}: {study.title}",
        study=case.study_name,
        scene="angles",
        run=point.rig,
        source="particles.data",
        materials=material_table(study, [material, wall], scale, of),
        limit_force=study.contact.limit_force,
        gravity_m_s2=study.gravity_m_s2,
        gravity_direction=(0, -1, 0) if isinstance(rig, Drum) else (0, 0, -1),
        skin_m=skin(study),
        timestep_s=dt,
        rayleigh_time_s=rayleigh,
        outputs=(outputs.thermo(period, steps), outputs.particles(period, 0, steps, True)),
        thermo_steps=period,
        glued=len(glued),
        radius_m=box[0][1],
        bottom_m=box[2][0],
        drum_rad_s=rig.rad_s if isinstance(rig, Drum) else 0.0,
        lift_speed_m_s=rig.lift_speed_m_s if isinstance(rig, Repose) else 0.0,
        lift_from=lift_from,
        lift_to=lift_to,
        steps=steps,
        counted_from=counted,
    )
    density = particle_material(study).density_kg_m3
    rows = np.concatenate([glued, media]).tolist()
    bodies = [Body(1, radius, density, (x, y, z)) for x, y, z, radius in rows]
    content = case_of_study(
        CaseOfRun,
        of,
        point.rig,
        {"rig": rig.plain(), **vars(point)},
        dt,
        rayleigh,
        scene="angles",
        media=MediaOfRun(
            count=len(bodies),
            radius_mean_m=study.media.typical_radius_m,
            radius_std_m=study.media.typical_std_m,
            density_kg_m3=density,
        ),
    )
    roomy = _roomy(box, study.media.typical_radius_m)
    files = {
        "particles.data": lambda: data_file(deck.title, 2, roomy, bodies),
        "rig.stl": lambda: mesh,
    }
    return Scene(deck=deck, case=content, steps=steps, files=files)


def _roomy(box: Box, room: float) -> Box:
    (a, b), (c, d), (e, f) = box
    return (a - room, b + room), (c - room, d + room), (e - room, f + room)


def _study(study: Study, rig: Repose | Drum, point: AnglePoint) -> Study:
    """The study with the media of a heap or drum, softened, and with its coefficients."""
    main = study.media.main_material
    pair = {"friction": point.friction, "rolling_friction": point.rolling_friction}
    name, particle = f"{main}-{main}", particle_material(study)
    pairs = {**study.pairs, name: study.pairs[name].model_copy(update=pair)}
    found = study.model_copy(
        update={"media": rig.filled(study.media), "pairs": pairs, "seed": point.seed}
    )
    depth = rig.radius_m if isinstance(rig, Drum) else _filled_m(found, rig)
    pressure = bed_pressure(bed_density(found), study.gravity_m_s2, depth)
    overlap = bed_overlap(effective_modulus(particle, particle), pressure)
    moduli = (study.materials[one].youngs_modulus_pa for one in (main, rig.material or main))
    softest = ENGINE_SOFTEST_PA / min(moduli)
    fidelity = Fidelity(
        youngs_modulus_scale=min(1.0, rounded(max((overlap / point.overlap) ** 1.5, softest), up=True)),
        timestep_fraction=_STEP,
        skin_m=widest_skin(study),
        ranks=1,
    )
    return found.model_copy(update={"fidelity": fidelity})


def _filled_m(study: Study, rig: Repose) -> float:
    return bed_height(bed_volume(study), rig.cylinder_radius_m, SOLID_FRACTION_ESTIMATE)


_Placed = tuple[Array, Array, Box, str, tuple[float, float, float, float]]
"""Glued and free particles as centres and radii, (N, 4); the box; the mesh; start and stop of the
lift, the end, and the begin of what counts, s."""


def _heap(study: Study, rig: Repose, seed: int) -> _Placed:
    """The cylinder on its glued layer, whose tops are at z = 0."""
    size, gravity, inner = study.media.typical_radius_m, study.gravity_m_s2, rig.cylinder_radius_m
    poured = pour([bed_radii(study)], inner, seed)
    flattest = math.tan(math.radians(_FLATTEST_DEG))
    cone = 3 * bed_volume(study) / SOLID_FRACTION_ESTIMATE / math.pi / flattest
    edge = max(cone ** (1 / 3), inner) + 4 * size
    flat = _hexagonal(2 * size, edge)
    flat = flat[np.hypot(*flat.T) <= edge - size]
    way, top = _filled_m(study, rig) + 4 * size, poured.top_m + 2 * size
    lift_from = fall_time(top, gravity) + _SETTLE_S
    lift_to = lift_from + way / rig.lift_speed_m_s
    end = lift_to + _REST_S
    mesh = stl_text(tube(inner, top, min(2 * size, inner / 3)))
    box = ((-edge, edge), (-edge, edge), (-2 * size, top + way))
    glued = np.column_stack([flat, np.full((len(flat), 2), (-size, size))])
    media = np.column_stack([poured.positions_m, poured.radii_m])
    return glued, media, box, mesh, (lift_from, lift_to, end, end)


def _drum(study: Study, rig: Drum, seed: int) -> _Placed:
    """The drum about z; gravity acts along -y."""
    size, radius, half = study.media.typical_radius_m, rig.radius_m, rig.width_m / 2
    rows = 1 + math.floor((rig.width_m - 2 * size) / (math.sqrt(3) * size))
    around = math.floor(math.pi * (radius - size) / size)
    row, number = np.divmod(np.arange(rows * around), around)
    angle = math.tau * (number + row % 2 / 2) / around
    z = np.linspace(size - half, half - size, rows)[row]
    ring = (radius - size) * np.array([np.cos(angle), np.sin(angle)])
    glued = np.column_stack([*ring, z, np.full(len(z), size)])
    radii = np.random.default_rng(seed).permutation(bed_radii(study))
    sites = _sites(2.01 * radii.max(), radius - 2 * size - radii.max(), half - radii.max())
    if len(sites) < len(radii):
        raise InputError(
            "the drum does not hold its particles before they fall",
            field="calibration.angles.drum.fill_fraction",
            value=rig.fill_fraction,
            limit=f"{rig.fill_fraction * len(sites) / len(radii):.3g} with these particles",
            remedy="use a smaller fill_fraction, or a larger drum",
        )
    media = np.column_stack([sites[: len(radii)], radii])
    corners = [[x, y] for x in (-radius, radius) for y in (-radius, radius)]
    points = [[x, y, z] for z in (-half, half) for x, y in corners]
    faces = [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]
    box = ((-radius, radius), (-radius, radius), (-half, half))
    turn = math.tau / rig.rad_s
    begin = fall_time(2 * radius, study.gravity_m_s2)
    times = 0.0, 0.0, begin + _REVOLUTIONS * turn, begin + _TRANSIENT * turn
    return glued, media, box, stl_text(surface(points, faces)), times


def _hexagonal(step: float, reach: float) -> Array:
    """Points of a hexagonal lattice in a square about the origin, (N, 2)."""
    most = math.ceil(1.2 * reach / step)
    i, j = np.mgrid[-most : most + 1, -most : most + 1].reshape(2, -1)
    return np.column_stack([i + j % 2 / 2, math.sqrt(0.75) * j]) * step


def _sites(step: float, reach: float, half: float) -> Array:
    """Densest packing in a cylinder about z, the lowest along y first, (N, 3)."""
    layers, flat = math.floor(2 * half / (step * math.sqrt(2 / 3))), _hexagonal(step, reach)
    shift = np.array([0.0, step / math.sqrt(3)])
    found = [
        np.column_stack([flat + k % 2 * shift, np.full(len(flat), k * step * math.sqrt(2 / 3))])
        for k in range(layers + 1)
    ]
    sites = np.concatenate(found) - [0, 0, layers * step * math.sqrt(2 / 3) / 2]
    sites = sites[np.hypot(sites[:, 0], sites[:, 1]) <= reach]
    return np.asarray(sites[np.argsort(sites[:, 1], kind="stable")])

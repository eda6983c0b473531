"""A compound carries a part of the particles' weight, and of nothing else."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from placed_spheres import frames_of

from dragdeck.cases.bed import expected_surface, tip_pressure
from dragdeck.cases.case import Case
from dragdeck.decks.deck import Liquid
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.errors import InputError
from dragdeck.mesh.shapes import cylinder
from dragdeck.mesh.surface import surface, volume_below
from dragdeck.physics.contact_mechanics import fall_energy
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.filling_cautions import floor_overlap
from dragdeck.scenes.numbers import describe, workpiece_buoyancy
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.study.contact_law import Pair
from dragdeck.study.workpiece import Material
from evidence.verification.experiment import PlacedSphere

Made = Callable[..., Case]

SOLID, LIQUID = 2656.0, 1000.0
WATER = {"density_kg_m3": LIQUID}
REST = 1 - LIQUID / SOLID


@pytest.mark.engine
@pytest.mark.parametrize("level", [0.5, 1.3, 4.0], ids=["low", "high", "submerged"])
def test_a_particle_at_rest_weighs_its_reduced_weight(level: float, tmp_path: Path) -> None:
    """A cap of height h of a sphere displaces pi h^2 (3 R - h) / 3."""
    radius = 0.003
    glass = Material(youngs_modulus_pa=1e8, poissons_ratio=0.2, density_kg_m3=SOLID)
    pair = Pair(restitution=0.2, friction=0.5)
    *_, last = frames_of(
        tmp_path / "rest", glass, {(1, 1): pair, (1, 2): pair},
        [PlacedSphere(1, radius, (0, 0, radius))], liquid=Liquid(level * radius, LIQUID),
        gravity_m_s2=(0, 0, -9.81), timestep_s=1e-6, steps=60_000, period=20_000,
    )  # fmt: skip
    height = min(level * radius - (last.columns["z_m"].item() - radius), 2 * radius)
    displaced = math.pi * height**2 * (3 * radius - height) / 3
    weight = 9.81 * (SOLID * 4 / 3 * math.pi * radius**3 - LIQUID * displaced)
    assert last.columns["floor_force_z_n"].item() == pytest.approx(weight, rel=1e-5)


@pytest.mark.parametrize("level", [None, 0.05])
def test_both_scenes_with_the_bed_have_the_liquid(
    level: float | None, made: Made, project: Project
) -> None:
    """A restart file has no buoyancy: the process states it again; a drop test is in air."""
    dry, templates = made(), environment(project.templates)
    wet = made({"compound": {**WATER, "level_m": level}})
    line = f"fix buoyancy all buoyancy level {level or 0.1:g} dim z density 1000"
    for scene in (filling_scene(wet), process_scene(wet, Bed(0.038, 0.045))):
        text = deck_text(scene, templates)
        assert line in text
        assert "lubrication" in text
        assert "buoyancy of the workpiece" in scene.leaves_out
    assert DROP_TEST.run_id(wet) == DROP_TEST.run_id(dry)
    assert DROP_TEST.digest(wet) == DROP_TEST.digest(dry)
    for kind in (FILLING, PROCESS):
        assert kind.run_id(wet) != kind.run_id(dry) == kind.run_id(made({"compound": None}))


def test_the_reduced_weight_counts(made: Made) -> None:
    """Pressure, overlap and settling refer to it; the unit of a run's status is the deck's."""
    dry, wet = made(), made({"compound": WATER})
    assert tip_pressure(wet.study) == pytest.approx(REST * tip_pressure(dry.study))
    assert floor_overlap(wet.study) == pytest.approx(REST ** (2 / 3) * floor_overlap(dry.study))
    numbers, before = describe(wet), describe(dry)
    assert numbers["submerged_weight_ratio"] == pytest.approx(REST)
    assert numbers["inertial_number"] * math.sqrt(REST) == pytest.approx(before["inertial_number"])
    assert "submerged_weight_ratio" not in before
    units = []
    for case in (dry, wet):
        scene = filling_scene(case)
        media = scene.case.media
        per_particle = fall_energy(1, media.weight_kg_m3, media.radius_mean_m, 9.81)
        assert scene.deck.energy_unit_j == pytest.approx(media.count * per_particle)  # type: ignore[attr-defined]
        units.append(scene.deck.energy_unit_j)  # type: ignore[attr-defined]
    assert units[1] == pytest.approx(REST * units[0])


def test_only_what_is_below_the_level_is_lighter(made: Made) -> None:
    """At half the immersion depth the level is above half of the bed over the tip."""
    study = made().study
    dry, depth = tip_pressure(study), study.motion.immersion_depth_m
    surface_m = expected_surface(study)
    for level, share in ((surface_m - depth / 2, 0.5), (surface_m - depth, 0.0), (0.1, 1.0)):
        wet = made({"compound": {**WATER, "level_m": level}}).study
        assert tip_pressure(wet) == pytest.approx(dry * (1 - share * LIQUID / SOLID))


@pytest.mark.parametrize(
    ("compound", "says"),
    [
        ({"level_m": 0.11}, r"compound.level_m: the liquid stands above the rim.*0.11.*0.1 m"),
        ({"level_m": 60}, r"did you mean 60 mm"),
        ({"density_kg_m3": 2656}, r"compound.density_kg_m3: particles of ceramic float.*2656"),
        ({"density_kg_m3": 1.1}, r"did you mean 1.1 g/cm3"),
        ({"viscosity_pa_s": 1e-3}, r"unknown key"),
    ],
)
def test_bad_input_is_named(made: Made, compound: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=f"(?s){says}"):
        made({"compound": {**WATER, **compound}})


def test_the_volume_below_a_level() -> None:
    """A tilted cube on its edge is a wedge below x: x^2; a box in water displaces its bottom."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
    half = math.sqrt(0.5)
    turn = np.array([[half, 0, half], [0, 1, 0], [-half, 0, half]])
    cube = surface(corner @ turn.T + [0, 0, half], faces)
    assert volume_below(cube, 0.0) == 0.0
    for level, volume in ((0.3, 0.09), (half, 0.5), (half + 0.4, 1 - 0.307106781**2), (2, 1.0)):
        assert volume_below(cube, level) == pytest.approx(volume)


def test_the_report_states_the_missing_buoyancy(made: Made) -> None:
    """The rod displaces its cross-section times what is below the level."""
    case = made({"compound": {**WATER, "level_m": 0.03}})
    bed = Bed(0.038, 0.045)
    rod = cylinder(0.004, 0.02, 0.0015)
    area = volume_below(rod, 0.01) / 0.01
    expected = LIQUID * 9.81 * area * (0.03 - (0.038 - 0.015))
    assert workpiece_buoyancy(case, bed.surface_m) == pytest.approx(expected)
    assert area == pytest.approx(math.pi * 0.004**2, rel=0.01)
    (told,) = process_scene(case, bed).case.assumptions
    assert told.field == "compound"
    assert f"{expected:+.3g} N" in told.why
    assert not process_scene(made({"compound": None}), bed).case.assumptions

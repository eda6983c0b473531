"""The contact law: each coefficient is one row, and absent where a study does not name it."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dragdeck.cases.case import Case
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.decks.render import deck_text, write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.log import read_samples
from dragdeck.engine.run_folder import run
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.process import SCENES, process_scene
from dragdeck.study import contact_law
from dragdeck.study.contact_law import (
    Coefficient,
    Pair,
    added_forces,
    coefficients,
    contact_model,
    contact_settings,
)
from dragdeck.study.workpiece import Material
from dragdeck.sweep.cases import load_cases
from evidence.verification.experiment import PlacedSphere, Wall, collide_scene, experiment

OPTIONAL = [name for name, row in coefficients().items() if row.model]
USED = 0.1

Small = dict[str, Any]
Write = Callable[[Small], Path]


def with_coefficient(small: Small, write_study: Write, name: str, value: float) -> Case:
    """The small study's case with a coefficient of every pair."""
    for pair in small["pairs"].values():
        pair[name] = value
    (found,) = load_cases(write_study(small))
    return found


@pytest.mark.parametrize("name", OPTIONAL)
def test_a_coefficient_at_its_default_renames_no_run(
    name: str, case: Case, small: Small, write_study: Write
) -> None:
    default = Pair.model_fields[name].default
    same = with_coefficient(small, write_study, name, default)
    other = with_coefficient(small, write_study, name, USED)
    for scene in SCENES.values():
        assert scene.run_id(case) == scene.run_id(same) != scene.run_id(other)


@pytest.mark.parametrize("name", OPTIONAL)
def test_particles_and_walls_share_the_contact_model(
    name: str, small: Small, write_study: Write, project: Project
) -> None:
    case = with_coefficient(small, write_study, name, USED)
    row = coefficients()[name]
    for scene in (filling_scene(case), process_scene(case)):
        text = deck_text(scene, environment(project.templates))
        laws = re.findall(r"^(?:pair_style|fix .* wall/gran) .*$", text, re.MULTILINE)
        assert len(laws) > 2
        assert all(row.model in law and law.endswith(row.settings) for law in laws)
        assert re.search(rf"{row.engine} peratomtypepair 2 (?:0\.1 ?){{4}}$", text, re.MULTILINE)


@pytest.mark.parametrize("name", OPTIONAL)
def test_explain_says_whether_a_coefficient_is_modelled(
    name: str, case: Case, small: Small, write_study: Write
) -> None:
    words = coefficients()[name].words
    assert words in process_scene(case).leaves_out
    modelled = process_scene(with_coefficient(small, write_study, name, USED))
    assert words in modelled.models and words not in modelled.leaves_out


@pytest.mark.parametrize(
    ("law", "added"),
    [
        ("gran model hertz tangential history", []),
        ("gran model hooke tangential no_history rolling_friction cdt limitForce on", []),
        ("gran model hertz/stiffness cohesion off", []),
        ("wall/gran model hertz cohesion sjkr2 mesh n_meshes 1 meshes a", ["cohesion sjkr2"]),
        ("gran model hooke/hysteresis tangential history", ["hooke/hysteresis"]),
        ("gran model ${law} tangential history", ["${law}"]),
        ("gran/hertz/history 1 0", ["gran/hertz/history 1 0"]),
        ("hybrid gran model hertz dpd 1", ["hybrid gran model hertz dpd 1"]),
    ],
)
def test_what_a_contact_law_adds_to_the_force_that_limits_friction(
    law: str, added: list[str]
) -> None:
    assert added_forces(law.split()) == added


@pytest.mark.parametrize("name", coefficients())
def test_a_coefficient_says_whether_it_adds_a_force(name: str) -> None:
    law = f"gran model {contact_model([Pair(restitution=0.9, friction=0.3)])}"
    row = coefficients()[name]
    assert bool(added_forces(f"{law} {row.model}".split())) == row.adds_force


def test_a_coefficient_that_adds_a_force_is_found_in_a_script(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    row = Coefficient("liquid", "liquid", "surface wet", adds_force=True)
    monkeypatch.setattr(contact_law, "coefficients", lambda: {"liquid": row})
    assert added_forces(["gran", "model", "hertz", "surface", "wet"]) == ["surface wet"]


def test_a_pair_needs_only_what_it_has() -> None:
    plain = Pair(restitution=0.9, friction=0.3)
    rolling = Pair(restitution=0.9, friction=0.3, rolling_friction=0.01)
    assert contact_model([plain]) == "hertz tangential history"
    assert contact_model([plain, rolling]) == "hertz tangential history rolling_friction epsd2"
    assert contact_settings([plain]) == [] and contact_settings([rolling]) == ["torsionTorque on"]
    assert plain.plain() == {"restitution": 0.9, "friction": 0.3}


@pytest.mark.engine
@pytest.mark.parametrize("name", OPTIONAL)
def test_a_bed_comes_to_rest_with_the_coefficient(
    name: str, small: Small, write_study: Write, project: Project
) -> None:
    small["media"]["count"] = 50
    case = with_coefficient(small, write_study, name, USED)
    folder = project.run_folder(case, FILLING)
    write_run(filling_scene(case), folder, environment(project.templates))
    assert run(folder, lambda line: None).state == "complete"


@pytest.mark.engine
def test_a_rolling_particle_slows_down_by_five_sevenths_of_the_coefficient(
    tmp_path: Path, project: Project
) -> None:
    """Rolling without sliding under a torque mu_r R m g: 7/5 m a = mu_r m g."""
    mu, radius, speed, gravity, step = 0.02, 0.003, 0.1, 9.81, 1e-6
    steel = Material(youngs_modulus_pa=1e8, poissons_ratio=0.3, density_kg_m3=7800)
    pair = Pair(restitution=0.5, friction=0.5, rolling_friction=mu)
    turning = PlacedSphere(1, radius, (0, 0, radius), (speed, 0, 0), (0, speed / radius, 0))
    rolling = experiment(
        "rolling", 1, "A rolling particle", [],
        types=[("particle", steel), ("plane", steel)], pairs={(1, 2): pair}, bodies=[turning],
        walls=[Wall("floor", 2, "zplane 0.0")], timestep_s=step, series="", vary="", contacts=[],
        gravity_m_s2=(0, 0, -gravity), steps_per_contact=1, steps=200_000, period=20_000,
    )  # fmt: skip
    scene = collide_scene(rolling)
    folder = tmp_path / "rolling"
    write_run(scene, folder, environment(project.templates))
    run(folder, lambda line: None)
    columns = ColumnsFile.read(folder / "columns.json").outputs["thermo"].columns
    samples = read_samples((folder / "thermo.1.txt").read_text().splitlines(), columns)
    mass = steel.density_kg_m3 * 4 / 3 * math.pi * radius**3
    first, last = (math.sqrt(2 * samples[i].kinetic_energy_j / mass) for i in (2, -1))
    slowing = (first - last) / ((samples[-1].step - samples[2].step) * step)
    assert slowing == pytest.approx(5 / 7 * mu * gravity, rel=0.01)

"""The contact law: each coefficient is one row, and absent where a study does not name it."""

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain, product
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from made_scenes import own_template, rendered
from made_study import Made
from placed_spheres import frames_of
from scipy.optimize import brentq

from dragdeck.arrays import Floats
from dragdeck.cases.case import Case
from dragdeck.decks import DECK_FILE
from dragdeck.decks.render import deck_text, of_its_templates
from dragdeck.decks.templates import environment
from dragdeck.engine.log import engine_errors
from dragdeck.engine.process import command, execute, find_engine
from dragdeck.engine.run_folder import run
from dragdeck.errors import InputError
from dragdeck.physics.contact_mechanics import effective_modulus, pull_off_force
from dragdeck.project import Project
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.filling_cautions import bond_numbers
from dragdeck.scenes.process import SCENES, process_scene
from dragdeck.scenes.scene import material_table
from dragdeck.study import contact_law
from dragdeck.study.check import validate
from dragdeck.study.contact_law import (
    Coefficient,
    Contact,
    FrictionLimit,
    Pair,
    RollingModel,
    added_forces,
    coefficients,
    contact_model,
    contact_settings,
)
from dragdeck.study.model import Study
from dragdeck.study.workpiece import Material
from evidence.verification.experiment import PlacedSphere

OPTIONAL = [name for name, row in coefficients().items() if row.model]
USED = 0.1

Small = dict[str, Any]
With = Callable[..., Case]


@pytest.fixture
def with_coefficient(small: Small, made: Made) -> With:
    """The small study's case with a coefficient of every pair."""

    def case(name: str, value: float = USED) -> Case:
        for pair in small["pairs"].values():
            pair[name] = value
        return made()

    return case


@pytest.mark.parametrize("name", OPTIONAL)
def test_a_coefficient_at_its_default_renames_no_run(
    name: str, case: Case, with_coefficient: With
) -> None:
    default = Pair.model_fields[name].default
    same = with_coefficient(name, default)
    other = with_coefficient(name)
    for scene in SCENES.values():
        assert scene.run_id(case) == scene.run_id(same) != scene.run_id(other)


@pytest.mark.parametrize("name", OPTIONAL)
def test_particles_and_walls_share_the_contact_model(
    name: str, with_coefficient: With, project: Project
) -> None:
    case = with_coefficient(name)
    row = coefficients()[name]
    model, templates = row.model.format(**dict(case.study.contact)), environment(project.templates)
    for scene in (filling_scene(case), process_scene(case)):
        text = deck_text(scene, templates)
        assert of_its_templates(text, scene, templates)["added_forces"] == ()  # none is unknown
        laws = re.findall(r"^(?:pair_style|fix .* wall/gran) .*$", text, re.MULTILINE)
        assert len(laws) > 2
        assert all(model in law and law.endswith(row.settings) for law in laws)
        simulated = USED * scene.deck.materials.youngs_modulus_scale**row.modulus_power
        values = re.search(rf"{row.engine} peratomtypepair 2 (.*)$", text, re.MULTILINE)
        assert values
        assert [*map(float, values[1].split())] == pytest.approx(4 * [simulated], rel=1e-9)


@pytest.mark.parametrize("name", OPTIONAL)
def test_explain_says_whether_a_coefficient_is_modelled(
    name: str, case: Case, with_coefficient: With
) -> None:
    words = coefficients()[name].words
    assert words in process_scene(case).leaves_out
    modelled = process_scene(with_coefficient(name))
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
    law = f"gran model {contact_model([Pair(restitution=0.9, friction=0.3)], Contact())}"
    row = coefficients()[name]
    assert bool(added_forces(f"{law} {row.model}".split())) == (row.attraction is not None)


def _linear(value: float, radius: Floats, overlap: Floats, wall: bool) -> Floats:
    return value * overlap


def test_a_coefficient_that_adds_a_force_is_found_in_a_script(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    row = Coefficient("liquid", "liquid", "surface wet", attraction=_linear)
    monkeypatch.setattr(contact_law, "coefficients", lambda: {"liquid": row})
    assert added_forces(["gran", "model", "hertz", "surface", "wet"]) == ["surface wet"]


def test_a_pair_needs_only_what_it_has() -> None:
    plain = Pair(restitution=0.9, friction=0.3)
    rolling = Pair(restitution=0.9, friction=0.3, rolling_friction=0.01)
    assert contact_model([plain], Contact()) == "hertz tangential history"
    for model, contact in {"epsd2": Contact(), "cdt": Contact(rolling_model="cdt")}.items():
        words = f"hertz tangential history rolling_friction {model}"
        assert contact_model([plain, rolling], contact) == words
    assert contact_settings([plain]) == [] and contact_settings([rolling]) == ["torsionTorque on"]
    assert plain.plain() == {"restitution": 0.9, "friction": 0.3}


TWO_SPHERES = """{% extends "base/process.in.j2" %}
{% block start %}
region all block -0.1 0.1 -0.1 0.1 -0.01 0.2 units box
create_box {{ deck.materials.names | length }} all
create_atoms 1 single 0.02 0 0.0029 units box
create_atoms 1 single 0.02 0 0.0087 units box
set group all diameter 0.006 density 2500
{% endblock %}
{% block outputs %}{% endblock %}
{% block run %}
print "LAW {{ self.contact_model() }}; {{ self.contact_settings() }}"
run 1
{% endblock %}
"""
"""One step of a sphere on the floor and another on top of it."""


def combinations(small: Small) -> Iterator[Study]:
    """Studies with every combination of coefficients and options that a study may have."""
    optional = {name: field for name, field in Pair.model_fields.items() if not field.is_required()}
    values = {name: (field.default, USED) for name, field in optional.items()}
    options = {
        name: get_args(field.annotation) or (True, False)
        for name, field in Contact.model_fields.items()
    }
    for chosen in product(*values.values(), *options.values()):
        pairs = dict(zip(values, chosen, strict=False))
        small["contact"] = dict(zip(options, chosen[len(values) :], strict=True))
        for pair in small["pairs"].values():
            pair.update(pairs)
        with contextlib.suppress(InputError):
            yield validate(small, "small")


@pytest.mark.engine
def test_liggghts_takes_every_combination_of_coefficients_and_options(
    case: Case, small: Small, project: Project, tmp_path: Path
) -> None:
    """One process: pairs, an analytical bowl and a mesh have each contact law in turn."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own/process.in.j2").write_text(TWO_SPHERES)
    templates = environment(project.templates, tmp_path / "own")
    plain = process_scene(case)
    types = plain.deck.materials.names
    decks = {}
    for study in combinations(small):
        materials = material_table(study, types, 1e-3, case)
        limited = study.contact.limit_force
        deck = replace(plain.deck, materials=materials, limit_force=limited)
        decks[materials.law.model, (limited, *materials.law.settings)] = deck
    assert {row.model.split()[0] for row in coefficients().values() if row.model} <= {
        *chain.from_iterable(model.split() for model, _ in decks)
    }
    scenes = [replace(plain, deck=deck, override="process.in.j2") for deck in decks.values()]
    for name, text in plain.texts().items():
        (tmp_path / name).write_text(text)
    script = "\nclear\n".join(deck_text(scene, templates) for scene in scenes)
    (tmp_path / DECK_FILE).write_text(script)
    words = command(find_engine(), DECK_FILE, 1, 1, None)
    ending = execute(words, tmp_path, tmp_path / "screen", lambda elapsed: None)
    screen = (tmp_path / "screen").read_text()
    laws = re.findall("^LAW (.*)$", screen, re.MULTILINE)
    assert ending.exit_status == 0 and len(laws) == len(decks), (laws, engine_errors(screen))


def test_an_order_of_keywords_that_liggghts_refuses_is_refused(
    case: Case, project: Project
) -> None:
    law = "hertz tangential history rolling_friction cdt cohesion sjkr2"
    text = f'{{% extends "base/base.in.j2" %}}{{% block contact_model %}}{law}{{% endblock %}}'
    file = own_template(case, text, "base.in.j2")
    with pytest.raises(InputError, match="order of keywords") as raised:
        deck_text(filling_scene(case), environment(project.templates, file.parent))
    assert "tangential cohesion rolling_friction surface" in str(raised.value)


@pytest.mark.engine
@pytest.mark.parametrize("name", OPTIONAL)
def test_a_bed_comes_to_rest_with_the_coefficient(
    name: str, made: Made, with_coefficient: With, project: Project
) -> None:
    made({"media.count": 50, "filling.energy_ratio": 1e-4})  # a single particle may roll for long
    case = with_coefficient(name)
    folder = rendered(case, project)
    assert run(folder, lambda line: None).state == "complete"


@pytest.mark.parametrize(
    ("model", "damping", "said"),
    [
        ("epsd", 0, "is missing, which the rolling model epsd requires"),
        ("cdt", 0.3, "the rolling model cdt has no damping"),
    ],
)
def test_only_epsd_has_damping_of_rolling_and_needs_it(
    model: str, damping: float, said: str, made: Made
) -> None:
    pair = "pairs.ceramic-ceramic"
    rolling = {f"{pair}.rolling_friction": 0.1, f"{pair}.rolling_damping": damping}
    with pytest.raises(InputError, match=f"{pair}.rolling_damping.*{said}"):
        made({"contact.rolling_model": model, **rolling})


@pytest.mark.engine
@pytest.mark.parametrize(
    ("model", "damping", "slowest", "fastest"),
    [("epsd2", 0.0, 0.0, 1e-8), ("cdt", 0.0, 1e-8, 1e-5), ("epsd", 0.3, 1e-6, 1e-3)],
)
def test_a_rolling_particle_slows_down_by_five_sevenths_of_the_coefficient(
    model: RollingModel, damping: float, slowest: float, fastest: float, tmp_path: Path
) -> None:
    """Rolling without sliding under a torque mu_r R m g: 7/5 m a = mu_r m g; then it rests."""
    mu, radius, speed, gravity, step = 0.02, 0.003, 0.02, 9.81, 5e-6
    steel = Material(youngs_modulus_pa=1e8, poissons_ratio=0.3, density_kg_m3=7800)
    pair = Pair(restitution=0.5, friction=0.5, rolling_friction=mu, rolling_damping=damping)
    turning = PlacedSphere(1, radius, (0, 0, radius), (speed, 0, 0), (0, speed / radius, 0))
    frames = frames_of(
        tmp_path / "rolling", steel, {(1, 2): pair}, [turning], gravity_m_s2=(0, 0, -gravity),
        timestep_s=step, steps=50_000, period=1000, rolling_model=model,
    )  # fmt: skip
    rows = [(frame.step * step, abs(frame.columns["vx_m_s"][0])) for frame in frames]
    time, moving = np.array(rows).T
    rolls = (time > 0.02) & (moving > 0.1 * speed)
    slowing = -np.polyfit(time[rolls], moving[rolls], 1)[0]
    assert slowing == pytest.approx(5 / 7 * mu * gravity, rel=1e-3)
    assert slowest <= moving[-5:].mean() < fastest


@pytest.mark.parametrize("name", [name for name, row in coefficients().items() if row.attraction])
def test_a_softened_pair_keeps_its_largest_tension(name: str) -> None:
    """The tension falls with the square of the moduli at the same coefficient."""
    pair = Pair.model_validate({"restitution": 0.5, "friction": 0.5, name: 1e5})
    for wall in (True, False):
        tensions = []
        for scale in (1.0, 1e-3):
            limit = FrictionLimit(0.5, pair.softened(scale).attractive(), wall)
            (slope,) = limit.attraction_n(np.array([0.003]), np.array([1.0]))
            tensions.append(pull_off_force(float(slope), scale * 1e9, 0.003))
        assert tensions[0] == pytest.approx(tensions[1]) != 0.0


def said_of_cohesion(case: Case) -> list[str]:
    return [str(one) for one in filling_scene(case).warnings if one.code == "cohesion"]


@pytest.mark.parametrize(
    ("pair", "bodies"),
    [
        ("ceramic-ceramic", ["big-big"]),
        ("ceramic-steel", ["big-small", "big-bowl", "big-workpiece"]),
        ("steel-steel", ["small-small", "small-bowl", "small-workpiece"]),
    ],
)
def test_a_strong_tension_of_any_pair_is_told(
    pair: str, bodies: list[str], made: Made, small: Small
) -> None:
    """The first class is not the only one that sticks; a tension is proportional to the cube."""
    small["media"] = {"count": 300, "classes": {
        "big": {"material": "ceramic", "radius_mean_m": 0.003, "fraction": 0.5},
        "small": {"material": "steel", "radius_mean_m": 0.002, "fraction": 0.5},
    }}  # fmt: skip
    small["pairs"]["steel-steel"] = dict(small["pairs"]["ceramic-steel"])
    field, value = f"pairs.{pair}.cohesion_j_m3", 1e5
    numbers = bond_numbers(made({field: value}).study)
    assert [name for name, number in numbers.items() if number > 0] == bodies
    enough = value * max(numbers.values()) ** (-1 / 3)
    assert said_of_cohesion(made({field: 0.999 * enough})) == []
    (said,) = said_of_cohesion(made({field: 1.001 * enough}))
    strongest = max(numbers, key=numbers.__getitem__)
    assert f"is 1 ({strongest}) times the weight" in said
    (said,) = said_of_cohesion(made({field: 100 * enough}))
    assert all(f"({name})" in said for name in bodies)


@pytest.mark.engine
@pytest.mark.parametrize("name", [name for name, row in coefficients().items() if row.attraction])
@pytest.mark.parametrize("wall", [True, False], ids=["wall", "pair"])
@pytest.mark.parametrize("share", [0.97, 1.03])
def test_a_cohesive_contact_opens_at_its_tension(
    share: float, wall: bool, name: str, tmp_path: Path
) -> None:
    """A hanging particle, alone or below another one, stays up to the largest tension."""
    radius, density = 0.003, 2500.0
    glass = Material(youngs_modulus_pa=1e8, poissons_ratio=0.2, density_kg_m3=density)
    modulus = effective_modulus(glass, glass)
    mass = density * 4 / 3 * math.pi * radius**3
    weaker, stronger = (
        Pair.model_validate({"restitution": 0.2, "friction": 0.5, name: density})
        for density in (2e5, 1.2e6)
    )
    reduced = radius if wall else radius / 2
    attraction = FrictionLimit(0.5, weaker.attractive(), wall).attraction_n
    slope = float(attraction(np.array([reduced]), np.array([1.0]))[0])
    tension = pull_off_force(slope, modulus, reduced)

    def hanging(slope_n_m: float, reduced_m: float, pull_n: float) -> float:
        """The stable overlap of a contact under a pull, or that of the largest tension."""
        opening = (slope_n_m / (2 * modulus * math.sqrt(reduced_m))) ** 2

        def held(overlap: float) -> float:
            return slope_n_m * overlap - 4 / 3 * modulus * math.sqrt(reduced_m) * overlap**1.5

        return float(brentq(lambda d: held(d) - pull_n, opening, 9 / 4 * opening))

    pull = share * tension
    strong = FrictionLimit(0.5, stronger.attractive()).attraction_n
    strong_slope = float(strong(np.array([radius]), np.array([1.0]))[0])
    overlap = hanging(slope, reduced, min(pull, 0.999 * tension))
    above = 0.0 if wall else 2 * radius - hanging(strong_slope, radius, 2 * pull)
    distance = radius if wall else 2 * radius
    place = above + distance - overlap
    places = [place] if wall else [above - radius, place - radius]
    bodies = [PlacedSphere(1, radius, (0, 0, z)) for z in places]
    pairs = {(1, 1): weaker, (1, 2): weaker if wall else stronger}
    frames = frames_of(
        tmp_path / "hanging", glass, pairs, bodies, gravity_m_s2=(0, 0, pull / mass),
        timestep_s=1e-6, steps=60_000, period=20_000,
    )  # fmt: skip
    moved = frames[-1].columns["z_m"].max() - places[-1]
    assert (moved < 0.01 * radius) == (share < 1), (
        f"{name}: `attraction` in study/contact_law.py differs from the force of LIGGGHTS's model"
    )

"""Decks: golden files, determinism, overridden blocks, errors in templates."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_scenes import BED, own_template, script
from made_study import Made
from paths import ROOT

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text, of_its_templates, write_run
from dragdeck.decks.templates import commands_digest, environment
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.process import PROCESS, SCENES, process_scene

GOLDEN = ROOT / "tests/golden"


def render(case: Case, project: Project, scene: str) -> str:
    templates = environment(project.templates, case.file.parent / "templates")
    return deck_text(SCENES[scene].build(case, BED), templates)


@pytest.mark.parametrize("scene", SCENES)
def test_a_deck_is_as_it_was(
    case: Case, project: Project, scene: str, request: pytest.FixtureRequest
) -> None:
    golden = GOLDEN / f"{scene}.in.liggghts"
    text = render(case, project, scene)
    if request.config.getoption("--update"):
        golden.write_text(text)
    assert text == golden.read_text(), "run pytest --update if the change is meant"


def test_the_shipped_templates_are_known(request: pytest.FixtureRequest) -> None:
    """By their hashes, an edit of the project's own templates is seen."""
    files = sorted((ROOT / "templates").glob("*.j2"))
    rows = [f"{file.name},{commands_digest(file.read_text())}" for file in files]
    text = "\n".join(["template,commands", *rows, ""])
    record = ROOT / "workflow/dragdeck/data/templates.csv"
    if request.config.getoption("--update"):
        record.write_text(text)
    assert text == record.read_text(), "run pytest --update if the change is meant"


LAW = "{% block contact_model %}hertz tangential no_history rolling_friction epsd2{% endblock %}"
LAW_IN_BASE = "base.in.j2", f'{{% extends "base/base.in.j2" %}}{LAW}'
LID = (
    "{% block walls %}{{ super() }}\nfix lid all wall/gran model hertz tangential history "
    "primitive type 2 zplane 0.09 store_force yes limitForce on\n{% endblock %}"
)


@pytest.mark.parametrize(
    ("files", "changed", "law"),
    [
        ({}, (), 0),
        (dict([LAW_IN_BASE]), ("base.in.j2 (contact_model)",), 2),
        ({"process.in.j2": "{% block extra %}# a remark{% endblock %}"}, (), 0),
        (
            {"process.in.j2": "{% block extra %}fix f all viscous 1e-4{% endblock %}"
             "{% block end %}\n# a remark\n{% endblock %}"},
            ("process.in.j2 (extra)",),
            0,
        ),
        ({"process.in.j2": LID}, ("process.in.j2 (walls)",), 0),
        ({"process.in.j2": LID.replace("history", "off")}, ("process.in.j2 (walls)",), 1),
        (
            {"process.in.j2": '{% block extra %}{% include "own.j2" %}{% endblock %}',
             "own.j2": "fix f all viscous 1e-4\n"},
            ("process.in.j2 (extra)",),
            0,
        ),
        ({"process.in.j2": "{% block engine %}{{ super() }}\nprocessors * * 1\n{% endblock %}"},
         ("process.in.j2 (engine)",), 0),
        ({"base.in.j2": "{% block contact_settings %}tangential_damping off{% endblock %}",
          "process.in.j2": "{% block integration %}{{ super() }}\nfix f all viscous 1.0\n"
          "{% endblock %}"},
         ("base.in.j2 (contact_settings)", "process.in.j2 (integration)"), 2),
    ],
)  # fmt: skip
def test_what_templates_change_is_recorded_with_its_blocks(
    files: dict[str, str], changed: tuple[str, ...], law: int, case: Case, project: Project
) -> None:
    for name, text in files.items():
        extended = name in ("base.in.j2", "process.in.j2") and "extends" not in text
        own_template(case, f'{{% extends "base/{name}" %}}{text}' if extended else text, name)
    templates, scene = project.templates_of(case), process_scene(case)
    found = of_its_templates(deck_text(scene, templates), scene, templates)
    assert found["changed_scripts"] == changed
    assert len(found["changed_law"]) == law, found


@pytest.mark.parametrize("name", SCENES)
def test_the_projects_own_scripts_count_as_unchanged(
    name: str, case: Case, project: Project
) -> None:
    scene = SCENES[name].build(case, BED)
    found = of_its_templates(render(case, project, name), scene, environment(project.templates))
    assert not any(found.values())


@pytest.mark.parametrize(
    ("old", "new", "changed", "law"),
    [
        ("tangential spring with history", "tangential spring", False, False),
        ("timestep {{", "run 0\ntimestep {{", True, False),
        ("{{ deck.materials.law.model }}{% endblock", "hertz{% endblock", True, True),
    ],
)
def test_an_edit_of_the_projects_own_templates_is_recorded(
    old: str, new: str, changed: bool, law: bool, case: Case, tmp_path: Path
) -> None:
    own = tmp_path / "edited"
    shutil.copytree(ROOT / "templates", own)
    text = (own / "base.in.j2").read_text()
    assert old in text
    (own / "base.in.j2").write_text(text.replace(old, new))
    templates, scene = environment(own), process_scene(case)
    found = of_its_templates(deck_text(scene, templates), scene, templates)
    assert found["changed_scripts"] == (("templates/base.in.j2 of the project",) if changed else ())
    assert bool(found["changed_law"]) == law


def test_the_outputs_of_the_deck_are_those_of_columns_json(
    case: Case, project: Project, tmp_path: Path
) -> None:
    scene = process_scene(case, BED)
    write_run(scene, tmp_path / "run", environment(project.templates))
    deck = (tmp_path / "run/in.liggghts").read_text()
    outputs = json.loads((tmp_path / "run/columns.json").read_text())["outputs"]
    assert set(outputs) == {output.name for output in scene.deck.outputs} and len(outputs) == 6
    for output in outputs.values():
        assert output["pattern"].replace("{part}", "${part}") in deck
        if output["engine_columns"]:
            assert " ".join(output["engine_columns"]) in deck


def test_contacts_are_written_after_all_that_reads_stored_forces(
    case: Case, project: Project
) -> None:
    """In whatever order a scene lists its outputs, see `in_writing_order`."""
    scene = process_scene(case, BED)
    turned = replace(scene, deck=replace(scene.deck, outputs=scene.deck.outputs[::-1]))
    deck = deck_text(turned, environment(project.templates))
    dumps = [line.split()[3] for line in deck.splitlines() if line.startswith("dump ")]
    assert dumps == ["custom", "custom", "local", "local"]


def test_a_study_may_change_one_block(case: Case, project: Project) -> None:
    plain = render(case, project, "process")
    own_template(
        case,
        '{% extends "base/process.in.j2" %}\n{% block extra %}\n# mine: {{ deck.run }}\n'
        "{% endblock %}\n",
    )
    changed = render(case, project, "process")
    assert f"# mine: {PROCESS.run_id(case)}" in changed
    body = [line for line in changed.splitlines() if not line.startswith("# ") and line]
    assert body == [line for line in plain.splitlines() if not line.startswith("# ") and line]
    assert "base/process.in.j2" in changed  # the header names every template


def test_nothing_is_written_when_a_template_fails(
    case: Case, project: Project, tmp_path: Path
) -> None:
    own_template(case, '{% extends "base/process.in.j2" %}{% block run %}{{ no }}{% endblock %}')
    templates = environment(project.templates, case.file.parent / "templates")
    with pytest.raises(InputError):
        write_run(process_scene(case, BED), tmp_path / "run", templates)
    assert not (tmp_path / "run").exists()


def test_every_rate_is_at_least_the_asked(case: Case) -> None:
    scene = process_scene(case, BED)
    dt = scene.deck.timestep_s
    asked = {
        "workpiece_force": 1000,
        "workpiece_particles": 200,
        "workpiece_contacts": 200,
        "particles": 20,
        "contacts": 20,
    }
    periods = {output.name: output.period_steps for output in scene.deck.outputs}
    for name, rate in asked.items():
        assert 1 / (periods[name] * dt) >= rate
    assert periods["workpiece_particles"] % periods["workpiece_force"] == 0
    assert periods["contacts"] % periods["workpiece_contacts"] == 0
    assert scene.case.phases[-1].start_step % periods["contacts"] == 0


WIDE = {"kind": "circle", "radius_m": 0.0215}


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        (("motion", "path"), WIDE, "between its path and the bowl"),
        (("motion", "path"), WIDE | {"radius_m": 0.016}, "no particle fits"),
        (("motion", "immersion_depth_m"), 0.05, "below the floor"),
        (("motion", "immersion_depth_m"), 0.035, "crush particles"),
        (("media", "count"), 5000, "more particles than fit into the bowl"),
        (("fidelities", "quick"), {"youngs_modulus_scale": 1e-5}, "below the minimum of LIGGGHTS"),
        (("media", "radius_mean_m"), 0.022, "does not fit into the bowl"),
    ],
)
def test_an_impossible_scene_is_refused(
    small: dict[str, Any], field: tuple[str, str], value: Any, words: str, made: Made
) -> None:
    small[field[0]][field[1]] = value
    if field == ("media", "radius_mean_m"):
        small["media"]["count"] = 1
    case = made()
    with pytest.raises(InputError) as caught:
        for scene in SCENES.values():
            scene.build(case, BED)
    assert words in str(caught.value)
    assert caught.value.limit
    assert caught.value.remedy


def test_a_workpiece_never_crosses_a_radius_in_a_step(small: dict[str, Any], made: Made) -> None:
    small["fidelities"]["quick"]["speed_factor"] = 100
    case = made({"motion.plunge_speed_m_s": 29})
    with pytest.raises(InputError, match="moves by more than a particle radius per step") as caught:
        process_scene(case, BED)
    assert caught.value.field == "motion.speed_m_s"


def test_all_that_does_not_fit_is_named(made: Made) -> None:
    case = made({"motion": {"immersion_depth_m": 0.05, "path": WIDE}})
    with pytest.raises(InputError) as caught:
        process_scene(case, BED)
    fields = [error.field for error in (caught.value, *caught.value.more)]
    assert fields == ["motion.path", "motion.immersion_depth_m"]


@pytest.mark.parametrize(("size_m", "many"), [(1.5e-3, False), (2e-4, True)])
def test_a_particle_may_have_each_facet_as_its_neighbour(
    project: Project, size_m: float, many: bool, made: Made
) -> None:
    """LIGGGHTS ends with `mesh neighbor list overflow` beyond 2000 of them."""
    sizes = ("facet_size_m", "facet_length_m")
    case = made({f"workpiece.shape.{name}": size_m for name in sizes})
    scene = process_scene(case, BED)
    facets = scene.files["workpiece.stl"]().count("facet normal")
    assert (facets > 2000) == many
    text = script(case, project)
    room = f" one {facets} page {10 * facets}" if many else ""
    assert f"\nneigh_modify delay 0{room}\n\n# ---" in text


@pytest.mark.parametrize(("size_m", "room"), [(5e-3, False), (5e-4, True)])
def test_a_particle_may_touch_many_facets_of_the_bowl(
    size_m: float, room: bool, made: Made
) -> None:
    case = made({"bowl.facet_size_m": size_m})
    assert process_scene(case, BED).deck.crowded == room

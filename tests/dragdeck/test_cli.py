"""The command: what it prints, what it exits with, what it leaves alone."""

import inspect
import json
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from made_scenes import own_template
from made_study import Load

from dragchain.cli import PROGRAM as DRAGCHAIN
from dragdeck.cases.case import Case
from dragdeck.cases.ranks import CORES_VARIABLE
from dragdeck.cli import PROGRAM as DRAGDECK
from dragdeck.cli import main
from dragdeck.command_line import Program
from dragdeck.project import Project
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.scene import SceneType
from evidence.__main__ import PROGRAM as EVIDENCE

pytestmark = pytest.mark.usefixtures("inside")


@pytest.mark.parametrize("program", [DRAGDECK, DRAGCHAIN])
def test_every_command_has_help(program: Program, capsys: pytest.CaptureFixture[str]) -> None:
    steps = [["step", one.name] for one in program.steps]
    for words in [*([one.name] for one in program.commands), *steps]:
        with pytest.raises(SystemExit):
            program.main([*words, "--help"])
        assert " ".join(words) in capsys.readouterr().out


@pytest.mark.parametrize("program", [DRAGDECK, DRAGCHAIN, EVIDENCE])
def test_every_command_calls_a_function_with_the_parameters_that_it_has(program: Program) -> None:
    for command in (*program.commands, *program.steps):
        module, _, name = command.calls.partition(":")
        function = getattr(import_module(f"{program.package}.{module}"), name)
        given = {
            options.get("dest", name.removeprefix("--").replace("-", "_"))
            for name, options in command.arguments.items()
        }
        parameters = inspect.signature(function).parameters.values()
        needed = {item.name for item in parameters if item.default is item.empty}
        assert needed <= given <= {item.name for item in parameters}, command.name


@pytest.mark.parametrize("command", ["check", "explain", "cases"])
def test_an_unknown_study_exits_with_one_and_no_traceback(
    command: str, case: Case, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "large"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("dragdeck: ")
    assert "one of: small" in said


def test_bad_input_writes_nothing(
    project: Project, small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    small["media"]["count"] = -5
    write_study(small)
    assert main(["step", "render", "small", "drop_test", "any"]) == 1
    assert not (project.root / "results").exists()


@pytest.mark.parametrize("scene", [DROP_TEST, FILLING])
def test_nothing_is_run_before_a_process_that_cannot_be(
    scene: SceneType, project: Project, load: Load, capsys: pytest.CaptureFixture[str]
) -> None:
    """The other cases of a sweep run, and what they share with one that cannot be."""
    for depths, status in (([0.06, 0.07], 1), ([0.02, 0.07], 0)):
        cases = load({"sweep": {"motion.immersion_depth_m": depths}})
        run = scene.run_id(cases[1])
        assert main(["step", "render", "small", scene.name, run]) == status
        assert project.run_folder(cases[1], scene).exists() == (status == 0)
    assert capsys.readouterr().err.count("immersion_depth_m") == 2


def test_a_process_is_never_rendered_on_a_guess(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["step", "render", "small", "process", PROCESS.run_id(case)]) == 1
    assert "requires the settled packing" in capsys.readouterr().err
    assert not project.run_folder(case, PROCESS).exists()


def test_render_writes_all_that_a_run_needs(case: Case, project: Project) -> None:
    assert main(["step", "render", "small", "filling", FILLING.run_id(case)]) == 0
    names = {file.name for file in project.run_folder(case, FILLING).iterdir()}
    assert names == {"in.liggghts", "case.json", "columns.json", "particles.data"}


def test_outside_a_project(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    assert main(["cases", "small"]) == 1
    assert "not inside a dragdeck project" in (said := capsys.readouterr().err)
    assert "dragdeck init" in said


def test_a_new_study_can_be_run_at_once(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "mine", "--from", "small"]) == 0
    (mine,) = project.cases("mine")
    assert PROCESS.run_id(mine) == PROCESS.run_id(case)
    written = mine.file.read_text()
    for name, problem in (
        ("mine", "has that name already"),
        ("../x", "this name cannot be used for a study"),
        (".", "this name cannot be used for a study"),
    ):
        assert main(["new", name, "--from", "small"]) == 1
        assert problem in capsys.readouterr().err
    assert main(["new", "other", "--from", "none"]) == 1
    assert "unknown study" in capsys.readouterr().err
    assert mine.file.read_text() == written and not (project.studies / "other").exists()


def edited(case: Case, **changes: Any) -> None:
    data = {**yaml.safe_load(case.file.read_text()), **changes}
    case.file.write_text(yaml.safe_dump(data, sort_keys=False))


def test_check_names_the_problems_of_all_scenes_with_their_lines(
    case: Case, capsys: pytest.CaptureFixture[str]
) -> None:
    data = yaml.safe_load(case.file.read_text())
    edited(case, media={**data["media"], "count": 5000}, motion={**data["motion"], "path": WIDE})
    assert main(["check", "small"]) == 1
    said = capsys.readouterr().err
    lines = case.file.read_text().splitlines()
    for field, problem in (("  count:", "more particles"), ("  path:", "does not fit between")):
        line = 1 + next(n for n, text in enumerate(lines) if text.startswith(field))
        assert any(f"study.yaml:{line}: " in row and problem in row for row in said.splitlines())


def test_check_ends_with_its_verdict_whatever_is_wrong(
    case: Case, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = yaml.safe_load(case.file.read_text())
    path, spun = {"path": WIDE}, {"spin_rpm": 5, "immersion_m": 1}
    for study, motion, errors in (
        ("small", {}, "1 error"),  # no LIGGGHTS
        ("small", path, "1 error"),
        ("small", spun, "2 errors"),
        ("large", {}, "1 error"),
    ):
        edited(case, motion=data["motion"] | motion)
        monkeypatch.setenv("DRAGDECK_ENGINE", "/none")
        assert main(["check", study]) == 1
        said = capsys.readouterr().err
        assert said.splitlines()[-1] == f"dragdeck: {study}: {errors}; it cannot be run"
        assert ("did you mean 'spin.rpm'?" in said) == (motion is spun)


@pytest.mark.parametrize(
    ("times", "reason"),
    [
        ([], "(short)"),
        ([0, 1, *range(1, 200)], "(time)"),
        ([*range(99), *range(100, 300)], "(uneven)"),
    ],
)
def test_check_refuses_a_record_that_no_calibration_can_use(
    case: Case, capsys: pytest.CaptureFixture[str], times: list[int], reason: str
) -> None:
    rows = "".join(f"{time},{time % 7}\n" for time in times)
    (case.file.parent / "record.csv").write_text(f"Zeit [s],Kraft [N]\n{rows}")
    edited(case, calibration={"record": "record.csv"})
    assert main(["check", "small"]) == 1
    said = capsys.readouterr().err
    assert re.search(rf"study.yaml:\d+: calibration.record: {re.escape(reason)}", said)


@pytest.mark.engine
@pytest.mark.parametrize(
    ("fidelity", "warned"),
    [({"ranks": 1}, True), ({"ranks": 1, "timestep_fraction": 0.2}, False), ("draft", False)],
)
def test_a_block_that_drops_a_named_fidelity_is_warned_of(
    case: Case, capsys: pytest.CaptureFixture[str], fidelity: object, warned: bool
) -> None:
    edited(case, fidelity=fidelity)
    assert main(["check", "small"]) == 0
    said = capsys.readouterr().out
    assert ("add youngs_modulus_scale: 0.001 and timestep_fraction: 0.6" in said) == warned


WIDE = {"kind": "circle", "radius_m": 0.0215, "revolutions": 0.1}


def test_a_step_that_broke_needs_a_reason(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    unsafe = {"youngs_modulus_scale": 1e-3, "timestep_fraction": 1.2, "ranks": 1}
    edited(case, fidelity=unsafe)
    assert main(["check", "small"]) == 1
    said = capsys.readouterr().err
    problem = "the contacts are not stable at this time step with E x 0.001"
    assert f"fidelity.timestep_fraction: {problem}" in said
    assert "accepted.unsafe_timestep" in said
    edited(case, accepted={"unsafe_timestep": "to see it break"})
    (accepted,) = project.cases("small")
    assumptions = PROCESS.build(accepted, None).case.assumptions
    assert [(one.field, one.value) for one in assumptions] == [("fidelity.timestep_fraction", 1.2)]
    assert "to see it break" in assumptions[0].why


def test_more_ranks_than_cores_are_refused(
    case: Case, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CORES_VARIABLE, "3")
    edited(case, fidelity={"youngs_modulus_scale": 1e-3, "ranks": 4})
    assert main(["check", "small"]) == 1
    assert "at most 3 here" in capsys.readouterr().err
    monkeypatch.setenv(CORES_VARIABLE, "4")
    assert main(["check", "small"]) == 0


@pytest.mark.engine
def test_a_contact_law_that_adds_a_force_is_recorded(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    law = "{% block contact_model %}{{ super() }} cohesion sjkr2{% endblock %}"
    own_template(case, '{% extends "base/base.in.j2" %}' + law, "base.in.j2")
    assert main(["check", "small"]) == 0
    assert "the contact law adds a force (cohesion sjkr2)" in capsys.readouterr().out
    assert main(["step", "render", "small", "filling", FILLING.run_id(case)]) == 0
    recorded = json.loads((project.run_folder(case, FILLING) / "case.json").read_text())
    assert recorded["added_forces"] == ["cohesion sjkr2"]
    law = "hertz tangential history cohesion sjkr2"
    assert recorded["changed_law"] == [
        f"pair_style gran model {law} limitForce on",
        f"wall/gran model {law} store_force yes limitForce on",
    ]


ROLLING = """{% extends "base/base.in.j2" %}
{% block contact_model %}{{ super() }} rolling_friction epsd2{% endblock %}
{% block properties %}{{ super() }}
fix rolling all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1
{% endblock %}"""
NAMED = "input scripts changed by templates: base.in.j2 (contact_model, properties)"


@pytest.mark.engine
def test_a_contact_law_of_a_template_is_told_and_has_no_tolerance(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*arguments: str) -> str:
        assert main([*arguments, "small"]) == 0
        return " ".join(capsys.readouterr().out.split())

    assert NAMED not in said("check")
    left = re.search("leaves out(.*)$", said("explain", "--verbose"))
    assert left and "rolling friction" in left[1]
    own_template(case, ROLLING, "base.in.j2")
    assert f"note: {case.name}: {NAMED}" in said("check")
    shown = said("explain")
    assert "rolling friction" in shown and not re.search("leaves out[^:]*rolling friction", shown)
    bowl = yaml.safe_load(case.file.read_text())["bowl"] | {"radius_m": 0.028}
    edited(case, fidelity={"tolerance": 0.1}, bowl=bowl)
    (asked,) = project.cases("small")
    for command in (["check"], ["step", "render", "small", "filling", FILLING.run_id(asked)]):
        assert main([*command, *(["small"] if command == ["check"] else [])]) == 1
        refused = capsys.readouterr().err
        assert "fidelity.tolerance: the errors of settings are not known" in refused
        assert "rolling_friction epsd2" in refused and "full, instead of a tolerance" in refused

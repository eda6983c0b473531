"""`dragdeck status` and `dragdeck open` on folders as runs leave them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from made_scenes import own_template
from made_study import Made

from dragdeck.cases.case import Case
from dragdeck.cli import main
from dragdeck.project import Project, by_run
from dragdeck.records.run import AcceptanceCheck, RunPart, RunRecord
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.study.reference import Reference, Signal


@pytest.fixture(autouse=True)
def without_display(inside: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


Said = pytest.CaptureFixture[str]
TEMPLATE = '{% extends "base/process.in.j2" %}{% block extra %}timestep 1e-6{% endblock %}'


def write_state(folder: Path, **values: object) -> None:
    part = RunPart(part=1, checkpoint=None, from_step=0)
    record = RunRecord(
        state="complete", inputs="", started="", engine_version="3.8.0", ranks=1, parts=[part]
    )
    record.model_copy(update=values).write(folder / "state.json")


def test_a_study_that_was_never_run_waits(case: Case, project: Project, capsys: Said) -> None:
    assert main(["status", "small"]) == 0
    *runs, cost, report = capsys.readouterr().out.splitlines()
    assert len(runs) == 3 and all(": waiting, speed assumed, about " in line for line in runs)
    assert cost.startswith("small: runs 0 % done: 3 waiting; still to run: about ")
    assert cost.endswith("(estimates; speed assumed)")
    assert report == "report: none yet; make it with: ./run all --config study=small"
    assert not (project.root / "results").exists()


def test_failed_runs_come_first_with_their_remedy(
    case: Case, project: Project, capsys: Said
) -> None:
    write_state(project.run_folder(case, FILLING), steps_per_s=500.0, wall_time_s=75.0)
    check = AcceptanceCheck(
        code="ranks", name="split", passed=False, seen="one", limit="two", remedy="use this"
    )
    write_state(project.run_folder(case, PROCESS), state="failed", checks=[check])
    assert main(["status", "small"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"process {PROCESS.run_id(case)}: failed")
    assert "check:  split: one (limit: two)" in said and "remedy: use this" in said
    assert f"filling {FILLING.run_id(case)}: complete, 500 steps/s, 1 min 15 s" in said
    assert "% done: 1 failed, 1 waiting, 1 complete" in said


def test_the_points_of_a_plan_have_a_status(case: Case, project: Project, capsys: Said) -> None:
    plan = project.root / "two.yaml"
    points = {"vary": {"fidelity.timestep_fraction": [0.5, 0.6]}, "seeds": 2}
    base = {"fidelity.youngs_modulus_scale": 0.001, "fidelity.timestep_fraction": 0.5}
    reference = {"vary": {"fidelity.youngs_modulus_scale": [0.002]}, "seeds": 1}
    drops = {"drop_test.timestep_fraction": [0.02, 0.1]}
    content = {"base": base, "reference": reference, "points": [points], "drop_test": drops}
    plan.write_text(yaml.safe_dump(content))
    assert main(["status", "small", "--plan", str(plan)]) == 0
    counted = project.points("small", str(plan))
    of_scenes = [len(by_run(counted.of(kind), kind)) for kind in SCENES.values()]
    assert of_scenes == [2, 3, 5]
    assert "runs 0 % done: 10 waiting" in capsys.readouterr().out


EDITS: Mapping[str, Callable[[Case, Made], object]] = {
    "a remark": lambda case, made: made({"title": "another"}),
    "a template": lambda case, made: own_template(case, TEMPLATE),
    "a template that cannot be used": lambda case, made: own_template(case, TEMPLATE[:-2]),
}


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_open_and_status_say_where_the_report_is_and_whether_it_is_current(
    edit: Callable[[Case, Made], object], case: Case, made: Made, project: Project, capsys: Said
) -> None:
    assert main(["open", "small"]) == 1
    assert "./run all --config study=small" in capsys.readouterr().err
    file = project.report("small")
    file.parent.mkdir(parents=True)
    file.touch()
    (file.parent / "complete").write_text(f"{project.state([case])}\n")
    assert main(["open", "small"]) == 0
    assert capsys.readouterr() == (f"{file}\n", "")
    assert main(["status", "small"]) == 0
    assert capsys.readouterr().out.endswith(f"report: {file}\n")
    edit(case, made)
    assert main(["open", "small"]) == 0
    assert "the report is of other settings" in capsys.readouterr().err
    assert main(["status", "small"]) == 0
    assert "is of other settings, or not of all runs" in capsys.readouterr().out


def test_the_state_of_a_report_has_the_measured_signal(case: Case, project: Project) -> None:
    signal = Signal(file="force.csv", column="fx_n", orientation="fixed", low_pass_hz=9)
    reference = Reference(source="measured", signal=signal)
    measured = replace(case, study=case.study.model_copy(update={"reference": reference}))
    states = set()
    for content in ("fx_n\n1\n", "fx_n\n2\n"):
        (case.file.parent / "force.csv").write_text(content)
        states.add(project.state([measured]))
    assert len(states) == 2

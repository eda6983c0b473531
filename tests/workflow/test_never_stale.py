"""A study that is edited in each state of its life: the same call makes the new result.

Results are empty files, which Snakemake records as made by its rules; what a call would run is
observed in a dry run.
"""

import json
import os
import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from made_run import run_json
from made_study import put
from paths import DATA, ROOT
from snakemake_calls import copy_of_project, jobs, snakemake, succeed

from dragdeck.project import Project
from dragdeck.scenes.process import SCENES

pytestmark = pytest.mark.slow

STUDY = ("--config", "study=small")
PROCESS = {"render_process", "run_process", "tabulate_process", "write_report"}
FILLING = {"render_filling", "run_filling", *PROCESS}
DROP_TEST = {"render_drop_test", "run_drop_test", "write_report"}


def edit(folder: Path, changes: Mapping[str, Any], name: str = "small") -> None:
    """Change fields of a study by their dotted names."""
    file = folder / f"studies/{name}/study.yaml"
    data = yaml.safe_load(file.read_text())
    put(data, changes)
    file.write_text(yaml.safe_dump(data))


def restore(file: Path, text: str) -> None:
    """Put an earlier version of a file in its place, which is older than the results."""
    file.write_text(text)
    os.utime(file, (1e9, 1e9))


def let_be_made(folder: Path, target: str) -> list[str]:
    """Let all outputs of a target be there, as if they had been made; their names."""
    lines = succeed(folder, target, *STUDY, "--summary").stdout.splitlines()
    names = [name for line in lines if (name := line.partition("\t")[0]).startswith("results/")]
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    succeed(folder, target, *STUDY, "--touch")
    return names


WAY = "time_s,x_m,y_m\n0,-0.01,0\n1,0.01,0\n"
TEMPLATE = '{% extends "base/process.in.j2" %}{% block extra %}\n# mine\n{% endblock %}\n'
OWN = {
    "extends": "base",
    "workpiece": {"shape": {"kind": "mesh", "file": "part.stl", "unit": "mm"}},
    "motion": {"path": {"kind": "waypoints", "file": "way.csv"}, "speed_m_s": None},
}


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with a report on a study that extends another one."""
    folder = copy_of_project(tmp_path_factory.mktemp("reported"), OWN)
    study, base = folder / "studies/small", folder / "studies/base"
    for place in (study / "templates", base):
        place.mkdir()
    shutil.copy(DATA / "small_study.yaml", base / "study.yaml")
    shutil.copy(ROOT / "meshes/hex_bar.stl", study / "part.stl")
    (study / "way.csv").write_text(WAY)
    (study / "templates/process.in.j2").write_text(TEMPLATE)
    let_be_made(folder, "report")
    assert jobs(folder, "report", *STUDY) == set()
    return folder


def _turned(folder: Path) -> None:
    file = folder / "studies/small/part.stl"
    restore(file, "solid turned\n" + file.read_text().partition("\n")[2])


EDITS: Mapping[str, tuple[Callable[[Path], object], set[str]]] = {
    "a field": (lambda at: edit(at, {"seed": 2}), FILLING),
    "a field of the base": (lambda at: edit(at, {"drop_test.height_m": 0.02}, "base"), DROP_TEST),
    "a remark": (lambda at: edit(at, {"title": "another"}), {"render_process", "write_report"}),
    "a block for the report": (
        lambda at: edit(at, {"removal": {"coefficient_m2_n": 1e-15}}),
        {"render_process", "write_report"},
    ),
    "windows of a run": (
        lambda at: edit(at, {"fidelity": {"youngs_modulus_scale": 1e-3, "ranks": 1}}),
        PROCESS,
    ),
    "an older mesh": (_turned, PROCESS),
    "an older table": (
        lambda at: restore(at / "studies/small/way.csv", WAY.replace("1,0.01", "1,0.009")),
        PROCESS,
    ),
    "an older template": (
        lambda at: restore(at / "studies/small/templates/process.in.j2", TEMPLATE + "{# b #}"),
        PROCESS,
    ),
    "no template": (lambda at: (at / "studies/small/templates/process.in.j2").unlink(), PROCESS),
    "no records of Snakemake": (
        lambda at: shutil.rmtree(at / ".snakemake"),
        {*FILLING, *DROP_TEST},
    ),
    "results of another place": (
        lambda at: (at / "results/small/.made").write_text("elsewhere"),
        {*FILLING, *DROP_TEST},
    ),
}


@pytest.mark.parametrize("name", EDITS)
def test_what_an_edit_concerns_is_made_again(reported: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(reported, folder, symlinks=True)
    change, expected = EDITS[name]
    change(folder)
    assert expected <= jobs(folder, "report", *STUDY)


STATES = {
    "a process is tabulated": "process/.*/tables/workpiece_force.parquet",
    "it is run": "process/.*/run.json",
    "it is rendered": "process/.*/in.liggghts",
    "a filling is run": "filling/.*/run.json",
    "it is rendered, too": "filling/.*/in.liggghts",
}
"""From the last to the first, with the file that is there from then on."""


def test_an_edit_in_any_state_before_the_report_runs_all(tmp_path: Path) -> None:
    folder = copy_of_project(tmp_path)
    made = let_be_made(folder, "report")
    shutil.rmtree(folder / "results/small/report")
    assert not jobs(folder, "report", *STUDY) & FILLING - {"write_report"}
    edit(folder, {"seed": 2})
    for state, pattern in STATES.items():
        assert jobs(folder, "report", *STUDY) >= FILLING, state
        (name,) = (name for name in made if re.search(pattern, name))
        (folder / name).unlink()


def test_runs_of_another_engine_are_named(tmp_path: Path) -> None:
    folder = copy_of_project(tmp_path)
    project = Project(folder)
    (case,) = project.cases("small")
    run = project.run_folder(case, SCENES["process"])
    run.mkdir(parents=True)
    (run / "run.json").write_text(json.dumps(run_json() | {"engine_version": "3.8.9"}))
    done = succeed(folder, "process", *STUDY, "--dry-run")
    assert "LIGGGHTS 3.8.9 made 1 run(s)" in done.stdout + done.stderr


def test_a_run_that_the_study_has_no_longer_is_refused(reported: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(reported, folder, symlinks=True)
    (run,) = (folder / "results/small/process").iterdir()
    edit(folder, {"seed": 2})
    done = snakemake(folder, f"results/small/process/{run.name}/run.json", *STUDY)
    assert done.returncode != 0 and "the study as it stands has no such run" in done.stderr


@pytest.mark.parametrize("target", ["report", "process", "filling"])
def test_an_edit_after_the_advice_runs_all(advised: Path, target: str) -> None:
    runs = {"report": FILLING, "process": FILLING - {"write_report"}, "filling": {"run_filling"}}
    assert {"advise", *runs[target]} <= jobs(advised, target, *STUDY)


def test_advice_comes_before_the_runs_of_a_study_that_asks(advised: Path) -> None:
    planned = succeed(advised, "all", *STUDY, "--dry-run")
    rules = re.findall(r"^(?:local)?rule (\w+):", planned.stdout + planned.stderr, re.MULTILINE)
    assert rules.count("advise") == 1
    assert rules.index("advise") < min(map(rules.index, ("run_filling", "run_process")))


@pytest.fixture(scope="module")
def advised(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the advice of a study that asks for a tolerance, and was then edited."""
    data = yaml.safe_load((DATA / "small_study.yaml").read_text())
    data["fidelity"] = {"tolerance": 0.1}
    data["bowl"]["radius_m"] = 0.028
    folder = copy_of_project(tmp_path_factory.mktemp("advised"), data)
    succeed(folder, "results/small/advice.json", *STUDY)
    edit(folder, {"seed": 2})
    return folder

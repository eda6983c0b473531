"""What rules are told: paths, options, and the windows of a round."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from paths import ROOT
from snakemake.cli import parse_config
from snakemake_interface_common.exceptions import WorkflowError

from dragdeck.calls import checked_settings
from dragdeck.errors import InputError
from dragdeck.project import Project, scaling_of
from dragdeck.rules import Workflow, of_whole_run

SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())["properties"]


def work(study: str, **changes: Any) -> Workflow:
    given = {"fidelity": "", "plan": "default", "validation": "paper", "judged": None}
    return Workflow(Project(ROOT), study, **{**given, **changes})


def test_settings_are_text_and_checked() -> None:
    assert checked_settings({"study": "a", "fidelity": None}, SCHEMA) == {
        "study": "a",
        "fidelity": "",
    }
    for config, words in (
        ({"studdy": "a"}, "did you mean 'study'"),
        ({"study": "a b"}, "study=a b: not a name"),
        ({"study": 202405}, "study=202405: not text"),
    ):
        with pytest.raises(WorkflowError, match=words):
            checked_settings(config, SCHEMA)


@pytest.mark.parametrize("name", ["2024_05", "007", "1e3", "true"])
def test_a_name_is_what_was_typed(name: str) -> None:
    typed = ["plan=paper", f"study={name}"]
    assert checked_settings(parse_config(typed), SCHEMA, typed) == {"study": name, "plan": "paper"}


def test_what_cannot_be_used_stops_the_workflow() -> None:
    with pytest.raises(WorkflowError, match="unknown study"):
        work("uhlman2015")
    with pytest.raises(WorkflowError, match="no such plan"):
        work("quickstart", plan="defult")
    with pytest.raises(WorkflowError, match="no measured drop test"):
        work("quickstart").drop_record()


def test_a_study_without_a_scaling_is_refused() -> None:
    with pytest.raises(InputError, match="scaling: a required key is missing"):
        scaling_of(Project(ROOT).cases("quickstart")[0])


def test_options_say_what_the_call_asks_for() -> None:
    assert work("quickstart", fidelity="draft").fidelity_option == "--fidelity draft"
    assert work("quickstart").fidelity_option == ""


def test_a_run_of_a_plan_is_named_by_it_unless_the_study_has_it() -> None:
    ours = work("uhlmann2015")
    (run,) = (folder.rpartition("/")[2] for folder in ours.every_folder("process"))
    assert ours.cases_option("process")(SimpleNamespace(study="uhlmann2015", run=run)) == ""
    point = ours.every_point("points", "tables/quantities.json")[0].split("/")[-3]
    named = ours.cases_option("points")(SimpleNamespace(study="uhlmann2015", run=point))
    assert named == "--plan default"


def test_a_further_workpiece_shares_the_files_of_its_run() -> None:
    own = of_whole_run("process", "run.json")
    wildcards = SimpleNamespace(study="s", run="a-0123abcd.2")
    assert own(wildcards) == "results/s/process/a-0123abcd/run.json"


def test_a_round_judges_as_many_windows_as_the_one_before_wanted(tmp_path: Path) -> None:
    def judged(study: str, run: str, number: int) -> str:
        file = tmp_path / f"{study}-{run}-{number}.json"
        file.write_text(json.dumps({"wanted": 1 + number, "last": number == 3}))
        return str(file)

    study = tmp_path / "studies" / "windows"
    study.mkdir(parents=True)
    text = "extends: uhlmann2015\nfidelity: {youngs_modulus_scale: 0.01, timestep_fraction: 0.5, "
    text += "windows: {tolerance: 0.1, quantities: [drag_mean], most: 9}}\n"
    text += "sweep: {seed: [1, 2, 3], motion.speed_m_s: [0.01, 0.02]}\n"
    (study / "study.yaml").write_text(text)
    for name in ("uhlmann2015",):
        (tmp_path / "studies" / name).symlink_to(ROOT / "studies" / name)
    for name in ("templates", "workflow"):
        (tmp_path / name).symlink_to(ROOT / name)
    ours = Workflow(Project(tmp_path), "windows", "", "default", "paper", judged)
    run, *others = (folder.rpartition("/")[2] for folder in ours.every_folder("process"))
    assert len(others) == 5
    second = SimpleNamespace(study="windows", run=run, round="2")
    assert len(ours.windows_of_round(second)) == 2
    assert ours.last_round(second).endswith("-3.json")  # type: ignore[union-attr]
    options = ours.windows_options(second)
    assert "--tolerance 0.1 --quantities drag_mean --most" in options
    assert "--packings 3" in options and ours.packings_option(second) == "--packings 3"

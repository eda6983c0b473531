"""What rules are told: paths, options, and the windows of a round."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from made_run import output, run_json, write_documents
from paths import ROOT
from snakemake.cli import parse_config
from snakemake_interface_common.exceptions import WorkflowError

from dragdeck.calls import checked_settings
from dragdeck.errors import InputError
from dragdeck.project import Project, scaling_of
from dragdeck.rules import of_whole_run
from dragdeck.study.search import RECORD, SearchPoint, SearchRecord, SearchRound
from dragdeck.workflow_rounds import WorkflowInRounds

SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())["properties"]


def work(study: str, root: Path = ROOT, **changes: Any) -> WorkflowInRounds:
    given = {"fidelity": "", "plan": "default", "validation": "paper", "made": None}
    return WorkflowInRounds(Project(root), study, **{**given, **changes})


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


def test_tables_are_kept_whose_raw_output_was_deleted(tmp_path: Path) -> None:
    run = write_documents(
        tmp_path / "run-01234567", {}, {"force": output("print", ["step"], 1, 0, 9)}
    )
    (run / "state.json").write_text(json.dumps(run_json()))
    raw, table = run / "x.1.txt", run / "tables/force.parquet"
    jobs = [SimpleNamespace(rule=SimpleNamespace(name="tabulate_process"), output=[str(table)])]
    work("quickstart").check_raw_outputs(jobs)
    table.touch()
    with pytest.raises(WorkflowError, match="raw output was deleted"):
        work("quickstart").check_raw_outputs(jobs)
    raw.touch()
    work("quickstart").check_raw_outputs(jobs)


def test_a_further_workpiece_shares_the_files_of_its_run() -> None:
    own = of_whole_run("process", "run.json")
    wildcards = SimpleNamespace(study="s", run="a-0123abcd.2")
    assert own(wildcards) == "results/s/process/a-0123abcd/run.json"


def write_study(root: Path, name: str, text: str) -> None:
    """A study that extends a shipped one, in a new project."""
    (root / "studies" / name).mkdir(parents=True)
    (root / "studies" / name / "study.yaml").write_text(text)
    (root / "studies/uhlmann2015").symlink_to(ROOT / "studies/uhlmann2015")
    for part in ("templates", "workflow"):
        (root / part).symlink_to(ROOT / part)


def test_a_round_judges_as_many_windows_as_the_one_before_wanted(tmp_path: Path) -> None:
    def judged(checkpoint: str, study: str, run: str, round: int) -> str:
        assert checkpoint == "judge_windows"
        file = tmp_path / f"{study}-{run}-{round}.json"
        file.write_text(json.dumps({"wanted": 1 + round, "last": round == 3}))
        return str(file)

    text = "extends: uhlmann2015\nfidelity: {youngs_modulus_scale: 0.01, timestep_fraction: 0.5, "
    text += "windows: {tolerance: 0.1, quantities: [drag_mean], most: 9}}\n"
    text += "sweep: {seed: [1, 2, 3], motion.speed_m_s: [0.01, 0.02]}\n"
    write_study(tmp_path, "windows", text)
    ours = work("windows", tmp_path, made=judged)
    run, *others = (folder.rpartition("/")[2] for folder in ours.every_folder("process"))
    assert len(others) == 5
    first, second = (SimpleNamespace(study="windows", run=run, round=text) for text in "12")
    assert ours.windows_of_round(first) == []
    assert len(ours.windows_of_round(second)) == 2
    assert ours.last_round(second).endswith("-3.json")  # type: ignore[union-attr]
    options = ours.windows_options(second)
    assert "--tolerance 0.1 --quantities drag_mean --most" in options
    assert "--packings 3" in options and ours.packings_option(second) == "--packings 3"


SEARCHED = """
extends: uhlmann2015
sweep: {seed: [1, 2]}
search:
  vary: {motion.speed_m_s: [0.01, 0.02]}
  objective: {quantity: drag_mean}
  start: 3
  runs: 4
"""


def test_a_search_reads_the_complete_runs_of_all_rounds_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_study(tmp_path, "searched", SEARCHED)
    record = tmp_path / "results/searched" / RECORD
    settings = [{"motion.speed_m_s": speed} for speed in (0.011, 0.013, 0.017)]
    points = [SearchPoint(values=values, round=1, purpose="start") for values in settings]
    asked: list[tuple[str, int]] = []

    def chosen(checkpoint: str, study: str, round: int) -> str:
        asked.append((checkpoint, round))
        SearchRecord(asked="", points=tuple(points[: 2 * round])).write(record)
        file = record.with_name(f"round-{round}.json")
        runs = [by_round[round]] if round in by_round else []
        SearchRound(runs=tuple(runs), last=round == 3).write(file)
        return str(file)

    by_round: dict[int, str] = {}
    ours = work("searched", tmp_path, made=chosen)
    assert len(ours.cases) == 2 and ours.last_settings(None).endswith("round-3.json")
    assert [round_ for _, round_ in asked] == [1, 2, 3]
    folders = ours.every_folder("process")
    assert len(folders) == 6  # of three settings, which are cases by now
    by_round |= {1: Path(folders[0]).name, 2: Path(folders[2]).name}
    second = SimpleNamespace(study="searched", round="2")
    assert ours.ended_of_round(second) == [f"{folders[2]}/ended.json"]
    (tmp_path / folders[0]).mkdir(parents=True)
    (tmp_path / folders[0] / "run.json").touch()  # and the other run failed
    third = SimpleNamespace(study="searched", round="3")
    tables = [file for file in ours.known_of_search(third) if "/process/" in file]
    assert {Path(file).parents[1] for file in tables} == {Path(folders[0])}
    failed = points[1].model_copy(update={"refused": "particles were lost", "ran": True})
    points[1] = failed
    assert ours.ended_of_round(second) == [f"{folders[2]}/ended.json"]
    assert len(ours.cases) == 4 and Path(folders[2]).name in ours.runs_of("process")


@pytest.mark.parametrize(
    ("name", "fidelity", "words"),
    [("quickstart", "", "search: a required key is missing"), ("even_removal", "full", "fidelity")],
)
def test_what_cannot_be_searched_is_refused(name: str, fidelity: str, words: str) -> None:
    with pytest.raises(WorkflowError, match=words):
        work(name, fidelity=fidelity).last_settings(None)


def test_a_call_may_have_several_studies() -> None:
    ours = work("quickstart")
    other = ours.of("uhlmann2015")
    assert ours.of("quickstart") is ours and ours.of("uhlmann2015") is other
    (run,) = (folder.rpartition("/")[2] for folder in other.every_folder("process"))
    wildcards = SimpleNamespace(study="uhlmann2015", run=run)
    assert ours.case_of("process", wildcards) in other.cases
    with pytest.raises(WorkflowError, match="no such run"):
        ours.case_of("process", SimpleNamespace(study="quickstart", run=run))

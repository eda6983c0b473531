import json
import shutil
import warnings
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from finished_runs import write_finished_run
from made_scenes import own_template
from paths import SMALL_STUDY
from report_files import DROP, FILLING, make_run
from report_files import case_json as upstream_case
from tiny_run_files import chain_n

from dragchain import DocumentError, RejectedRunError, TableError, UnknownNameError, load
from dragchain.report.findings import FINDINGS_FILE
from dragchain.report.run_data import write_findings
from dragdeck.project import Project
from dragdeck.scenes.process import PROCESS


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the results of a study of two cases, one of two workpieces."""
    project = tmp_path_factory.mktemp("project")
    process = project / "results/small/process"
    run = write_finished_run(process / "deep-1", case="deep")
    for name, case in (("two-2", "two_workpiece-1"), ("two-2.2", "two_workpiece-2")):
        shutil.copytree(run, process / name)
        _edit(process / name / "case.json", {"case": case, "run": name})
    return project


@pytest.fixture
def project(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same to change; the working folder is a folder in it."""
    shutil.copytree(made, tmp_path / "project")
    (tmp_path / "project/examples").mkdir()
    monkeypatch.chdir(tmp_path / "project/examples")
    return tmp_path / "project"


def _edit(file: Path, changes: dict[str, Any]) -> None:
    file.write_text(json.dumps(json.loads(file.read_text()) | changes))


def write_summary(project: Path) -> None:
    folder = project / "results/small/report"
    folder.mkdir()
    table = pd.DataFrame({"case": ["deep"], "run": ["deep-1"], "drag_mean_n": [-2.5]})
    table.to_parquet(folder / "summary.parquet")


def test_a_study_is_found_from_below_by_its_name_and_by_paths(project: Path) -> None:
    folder = project / "results/small"
    for study in (load("small"), load(folder), load(str(folder)), load("../results/small")):
        assert study.name == "tiny"
        assert [run.name for run in study.runs] == ["deep", "two_workpiece-1", "two_workpiece-2"]
        assert study.folder.resolve() == folder


def test_one_run_folder_is_a_study_of_one_run(project: Path) -> None:
    folder = project / "results/small/process/deep-1"
    (folder / "run.json").unlink()
    study = load(folder)
    assert study.run().folder == folder
    assert study.folder == project / "results/small"


def test_an_unknown_study_is_told_from_those_that_there_are(project: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"(?s)'smal'.*did you mean 'small'.*\./run all"):
        load("smal")
    with pytest.raises(UnknownNameError, match="known:  small"):
        load(project / "examples")


def test_runs_are_found_by_case_and_by_run_id(project: Path) -> None:
    study = load("small")
    assert study.run("deep").case.run == "deep-1"
    assert study.run("two-2.2").name == "two_workpiece-2"
    with pytest.raises(UnknownNameError, match=r"(?s)no run 'depe'.*did you mean 'deep'"):
        study.run("depe")
    with pytest.raises(UnknownNameError, match=r"3 runs: name one.*\n.*two_workpiece-1"):
        study.run()


def test_an_unfinished_run_is_no_result(project: Path) -> None:
    (project / "results/small/process/deep-1/run.json").unlink()
    study = load("small")
    assert [run.case.run for run in study.runs] == ["two-2", "two-2.2"]
    with pytest.raises(RejectedRunError, match=r"not known to be complete"):
        study.run("deep")
    for run in study.runs:
        (run.folder / "run.json").unlink()
    with pytest.raises(RejectedRunError, match="no process run is finished"):
        load("small")


ALIKE = ("workpiece_contacts", "facets", "particles", "contacts", "network", "clusters", "chains")
TABLES = {"force": "workpiece_force", "events": "contact_events", "thermo": "thermo"}
TABLES |= {name: name for name in ALIKE}
"""Attributes of a run, and the files of their tables."""


@pytest.mark.parametrize(("name", "file"), TABLES.items())
def test_tables_are_read_when_they_are_used_and_kept(project: Path, name: str, file: str) -> None:
    run = load("small").run("deep")
    path = run.folder / "tables" / f"{file}.parquet"
    for other in path.parent.glob("*.parquet"):
        if other != path:
            other.unlink()
    table = getattr(run, name)
    pd.testing.assert_frame_equal(table, pd.read_parquet(path), check_exact=True)
    path.unlink()
    assert getattr(run, name) is table


MADE_BY = {"contacts": "tables", "chains": "chains", "facets": "loading", "events": "loading"}


@pytest.mark.parametrize(("name", "command"), MADE_BY.items())
def test_a_missing_table_names_its_command(project: Path, name: str, command: str) -> None:
    run = load("small").run("deep")
    (run.folder / "tables" / f"{TABLES[name]}.parquet").unlink()
    with pytest.raises(TableError, match=f"`./run dragchain {command} .*process/deep-1`"):
        getattr(run, name)
    assert f" {TABLES[name]}," not in repr(run)


def test_some_columns_of_a_table_can_be_read(project: Path) -> None:
    run = load("small").run("deep")
    drag = run.table("workpiece_force", ["step", "drag_n"])
    assert drag["drag_n"].tolist() == pytest.approx([-chain_n(step) for step in drag["step"]])
    assert list(drag) == ["step", "drag_n"]
    with pytest.raises(UnknownNameError, match=r"(?s)no column 'drag'.*did you mean 'drag_n'"):
        run.table("workpiece_force", ["drag"])
    with pytest.raises(UnknownNameError, match=r"(?s)no table 'contact'.*mean 'contacts'"):
        run.table("contact")
    with pytest.raises(UnknownNameError, match="no table 'impacts', a drop_test has"):
        _ = run.impacts


def test_columns_have_units_and_meanings(project: Path) -> None:
    run = load("small").run("deep")
    columns = {name for file in TABLES for name in getattr(run, file).columns}
    assert columns == set(run.units)
    assert (run.units["drag_n"], run.units["step"], run.units["phase"]) == ("N", "1", "")
    assert run.describe("drag_n").endswith("negative: the bed resists (N)")
    assert "(" not in run.describe("step")
    meanings = run.describe("azimuth_rad").splitlines()
    assert {line.split(":")[0] for line in meanings} == {
        *("workpiece_contacts, sphere_contacts", "chains", "contact_events")
    }
    assert all(line.endswith("(rad)") for line in meanings)
    for ask in (run.describe, run.units.__getitem__):
        with pytest.raises(UnknownNameError, match="did you mean 'drag_n'"):
            ask("drga_n")


def test_a_study_has_the_summary_of_its_report(project: Path) -> None:
    with pytest.raises(TableError, match=r"`\./run report --config study=small`"):
        _ = load("small").summary
    write_summary(project)
    study = load("small")
    assert study.summary["drag_mean_n"].tolist() == [-2.5]
    assert study.summary.attrs["run"] == ["deep-1"]
    assert dict(study.units) == {"case": "", "run": "", "drag_mean_n": "N"}
    assert study.describe("drag_mean_n") == "mean drag (N)"
    with pytest.raises(UnknownNameError, match="did you mean 'drag_mean_n'"):
        study.describe("drag_mean")


def test_results_of_an_edited_study_are_named(project: Path) -> None:
    study = project / "studies/edited/study.yaml"
    study.parent.mkdir(parents=True)
    shutil.copy(SMALL_STUDY, study)
    known = Project(project)
    cases = known.cases("edited")
    process, report = project / "results/edited/process", known.report("edited")
    (project.parent / "disk/process").mkdir(parents=True)
    (project / "results/edited").symlink_to(project.parent / "disk")
    (project / "results/small/process/deep-1").rename(process / "deep-1")
    _edit(process / "deep-1/case.json", {"run": PROCESS.run_id(cases[0])})

    def warned() -> str:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            load("edited")
        return " ".join(str(warning.message) for warning in said)

    assert warned() == ""
    report.parent.mkdir()
    report.touch()
    report.with_name("complete").write_text(known.state(cases))
    assert warned() == ""
    own_template(cases[0], '{% extends "base/process.in.j2" %}{% block end %}run 1{% endblock %}')
    assert "the report is of other settings" in warned()
    study.write_text(f"{study.read_text()}seed: 2\n")
    assert "runs of other settings than those of the study now" in warned()


def test_filling_and_drop_test_of_a_run(project: Path) -> None:
    run = load("small").run("deep")
    with pytest.raises(DocumentError, match=r"filling-00000000.case\.json"):
        run.upstream("filling")
    make_run(project / "results", upstream_case("filling", "filling-00000000"), FILLING, [])
    make_run(project / "results", upstream_case("drop_test", "drop-00000000"), DROP, [])
    assert run.upstream("filling").name == "10 mm <workpiece>"
    impacts = pd.DataFrame({"impact": [1], "restitution": [0.7]})
    drop = run.upstream("drop_test")
    impacts.to_parquet(drop.folder / "tables/impacts.parquet")
    assert drop.impacts["restitution"].tolist() == [0.7]
    assert drop.units["restitution"] == "1"
    with pytest.raises(UnknownNameError, match="has no filling"):
        drop.upstream("filling")
    with pytest.raises(TableError, match="the scene is drop_test"):
        _ = drop.findings


def test_findings_are_those_of_the_report(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = load("small").run("deep")
    assert not (run.folder / FINDINGS_FILE).exists()
    computed = run.findings
    counted = run.force.loc[run.force["in_statistics"], "drag_n"]
    assert run.values.drag.run.value == pytest.approx(counted.mean())
    written = write_findings(run)
    monkeypatch.setattr("dragchain.results.process_findings", _never)
    again = load("small").run("deep").findings
    assert again.model_dump_json() == computed.model_dump_json() == written.model_dump_json()


def _never(run: object) -> None:
    raise AssertionError("findings.json was there")


def test_tables_carry_study_run_units_and_basis(project: Path) -> None:
    write_summary(project)
    study = load("small")
    run = study.run("deep")
    about = run.force.attrs
    assert (about["study"], about["run"]) == (run.case.study_name, run.case.run)
    assert (about["units"]["drag_n"], about["units"]["time_s"]) == ("N", "s")
    assert "more and smaller contact forces" in about["basis"]
    assert run.table("network", ["step"]).attrs["units"] == {"step": "1"}
    assert study.summary.attrs["units"]["drag_mean_n"] == "N"
    assert study.summary.attrs["basis"][run.case.run] == about["basis"]

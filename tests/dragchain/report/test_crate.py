"""An RO-Crate lists every file with its size and checksum, and nothing of this machine."""

import hashlib
import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from report_files import DROP, FILLING, case_json, change_scripts, make_run, process_findings

from dragchain.errors import ExportError
from dragchain.report import crate
from dragchain.report.crate import write_crate
from dragdeck.errors import RejectedRunError
from dragdeck.shipped import SHIPPED

rocrate = pytest.importorskip("rocrate.rocrate")
RUNS = [Path(f"results/small/{run}") for run in ("filling/f-1", "drop_test/d-1", "process/p-1")]
REPORT = Path("results/small/report")
OUT = Path("results/small/crate")
STUDY = Path('studies/small/a study\'s "files"/s\N{LATIN SMALL LETTER O WITH DIAERESIS}.yaml')


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with a study of one case, its runs and report, as the present folder."""
    monkeypatch.chdir(tmp_path)
    results = Path("results")
    make_run(results, case_json("filling", "f-1"), FILLING, [])
    make_run(results, case_json("drop_test", "d-1"), DROP, ["drop_test"])
    process = make_run(results, case_json("process", "p-1"), process_findings(), ["forces"])
    for name in ("in.liggghts", "columns.json", "workpiece.stl", "contacts.1.dump", "state.json"):
        (process / name).write_text(f"{tmp_path}" if name == "state.json" else name)
    for name in ("logs/run.log", "export/paraview/run.pvd", "archive/1/run.json", ".lock"):
        (process / name).parent.mkdir(parents=True, exist_ok=True)
        (process / name).write_text(f"{tmp_path}")
    (process / "tables/contacts.parquet").write_bytes(b"0123456789")
    REPORT.mkdir()
    for name in ("report.html", "summary.csv", "complete", "logs/report.log"):
        (REPORT / name).parent.mkdir(exist_ok=True)
        (REPORT / name).write_text(name)
    STUDY.parent.mkdir(parents=True)
    STUDY.write_text("title: small")
    return tmp_path


def listed(folder: Path) -> dict[str, Any]:
    """The entities of a crate by their identity."""
    graph = json.loads((folder / "ro-crate-metadata.json").read_text())["@graph"]
    return {entity["@id"]: entity for entity in graph}


def sums(folder: Path) -> dict[str, tuple[int, str]]:
    """Size and SHA-256 of all files of a folder."""
    return {
        str(file.relative_to(folder)): (
            file.stat().st_size, hashlib.sha256(file.read_bytes()).hexdigest()
        )
        for file in folder.rglob("*") if file.is_file()
    }  # fmt: skip


def test_raw_outputs_and_large_files_are_named_only(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (RUNS[2] / "tables/force.parquet").write_bytes(b"x" * crate.LARGEST_BYTES)
    (RUNS[2] / "tables/contacts.parquet").write_bytes(b"x" * (crate.LARGEST_BYTES + 1))
    write_crate(OUT, RUNS, REPORT)
    left_out = pd.read_csv(OUT / crate.LEFT_OUT).set_index("file")
    assert {Path(file).name for file in left_out.index} == {"contacts.1.dump", "contacts.parquet"}
    for file, row in left_out.iterrows():
        assert not (OUT / str(file)).exists()
        assert (row["bytes"], row["sha256"]) == sums(Path())[str(file)]
    assert (OUT / RUNS[2] / "tables/force.parquet").exists()


def test_files_of_dragdeck_have_their_paths_in_it(project: Path) -> None:
    template = Path("templates/base.in.j2")
    write_crate(OUT, RUNS, REPORT, inputs=[STUDY, SHIPPED / template])
    assert str(template) in listed(OUT)
    assert (OUT / template).read_bytes() == (SHIPPED / template).read_bytes()
    assert (OUT / STUDY).is_file()


def test_what_templates_changed_is_told(project: Path) -> None:
    change_scripts(RUNS[2], "base.in.j2 (contact_model)")
    write_crate(OUT, RUNS, REPORT)
    found = {name: one.get("description") for name, one in listed(OUT).items() if name[0] == "#"}
    line = "input scripts changed by templates: base.in.j2 (contact_model)"
    assert found["#process-p-1"] == line and found["#filling-f-1"] is None


def test_rocrate_reads_it(project: Path) -> None:
    write_crate(OUT, RUNS, REPORT, [STUDY], "CC-BY-4.0")
    found = rocrate.ROCrate(OUT)
    root = found.root_dataset
    assert root["license"].id == "https://spdx.org/licenses/CC-BY-4.0"
    assert {"name", "description", "datePublished"} <= root.properties().keys()
    action = found.get("#process-p-1")
    assert {Path(one.id).name for one in action["object"]} == {
        "in.liggghts", "columns.json", "case.json", "workpiece.stl"
    }  # fmt: skip
    assert {one.id for one in action["result"]} >= {f"{RUNS[2]}/run.json"}
    software = {(one["name"], one["version"]) for one in action["instrument"]}
    assert software == {("LIGGGHTS", "Engine 3.8"), ("dragdeck", "0.1.0")}
    write_crate(OUT, RUNS, REPORT)
    assert "license" not in listed(OUT)["./"]


def test_a_crate_replaces_an_earlier_one_and_nothing_else(project: Path) -> None:
    write_crate(OUT, RUNS, REPORT, [STUDY])
    (OUT / "ro-crate-metadata.json").unlink()  # as Snakemake does
    write_crate(OUT, RUNS[:2], REPORT)
    assert not (OUT / STUDY).exists() and not (OUT / RUNS[2]).exists()
    with pytest.raises(ExportError, match="not a crate"):
        write_crate(REPORT, RUNS, REPORT)
    assert (REPORT / "report.html").exists()


def test_a_failure_keeps_the_earlier_crate(project: Path) -> None:
    write_crate(OUT, RUNS, REPORT)
    before = sums(OUT)
    (RUNS[2] / "run.json").unlink()
    with pytest.raises(RejectedRunError):
        write_crate(OUT, RUNS, REPORT)
    assert sums(OUT) == before
    assert {path.name for path in OUT.parent.iterdir()} == {
        "crate", "report", "filling", "drop_test", "process"
    }  # fmt: skip


@pytest.mark.parametrize("file", ["../study.yaml", "/etc/hostname"])
def test_files_of_other_folders_are_refused(project: Path, file: str) -> None:
    with pytest.raises(ExportError, match="is not below"):
        write_crate(OUT, RUNS, REPORT, [Path(file)])
    assert not OUT.exists()

"""The whole workflow on the real engine: a small study from its file to its report."""

import contextlib
import json
import shutil
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import pyvista as pv
import yaml
from pages import stands_alone
from paths import PROJECT, ROOT, SMALL_STUDY
from snakemake_calls import jobs, snakemake, succeed

from dragchain import read_dump
from dragchain.quantities.registry import REPORTED
from dragchain.report.cases import ReportedCase, read_study_runs
from dragchain.tables.columns import _rows
from dragchain.tables.network_contacts import contact_rows
from dragchain.tables.run_folder import Run
from dragdeck.errors import InputError
from dragdeck.scenes.process import SCENES
from dragdeck.study.check import validate
from dragdeck.study.contact_law import FrictionLimit

pytestmark = [pytest.mark.engine, pytest.mark.slow]


TOTAL_FORCES = """{% extends "base/process.in.j2" %}
{% block extra %}
dump total_forces all custom {{ deck.thermo_steps }} total_forces.${part}.dump id fx fy fz
{% endblock %}
"""
"""Writes the force that moves each particle, weight included, with every network frame."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which the small study was run."""
    folder = tmp_path_factory.mktemp("project")
    for name in set(PROJECT) - {"templates"}:
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "templates", folder / "templates")
    data: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    data["sweep"] = {"motion.immersion_depth_m": [0.012, 0.016]}
    data["licence"] = "CC-BY-4.0 $(touch run-by-shell)"
    (folder / "studies/small/templates").mkdir(parents=True)
    (folder / "studies/small/templates/process.in.j2").write_text(TOTAL_FORCES)
    (folder / "studies/small/study.yaml").write_text(yaml.safe_dump(data))
    succeed(folder, "all", "--config", "study=small")
    return folder


TYPES = {
    "number": "double",
    "integer": "int64",
    "flag": "bool",
    "text": ("large_string", "dictionary<values=string"),
    "list of integers": "list<element: int64",
    "list of texts": "list<element: string",
    "any": "",
}
"""Types of the reference, and how those of Parquet begin."""

STUDY = ("all", "--config", "study=small")


def test_the_report_has_a_row_a_case(finished: Path) -> None:
    report = finished / "results/small/report"
    summary = pd.read_parquet(report / "summary.parquet")
    assert len(summary) == len(pd.read_csv(report / "summary.csv")) == 2
    assert (summary.drag_mean_ci95_low_n < summary.drag_mean_n).all()
    assert (summary.drag_mean_n < summary.drag_mean_ci95_high_n).all()
    assert summary.bed_height_m.nunique() == 1
    assert 0.5 < summary.solid_fraction[0] < 0.64
    networks = [file.name for file in report.glob("network-*.html")]
    assert len(networks) == 2
    page = stands_alone((report / "report.html").read_text(), networks)
    assert page.images and set(networks) <= set(page.references)


def test_cases_share_their_filling_and_drop_and_the_forces_on_the_workpiece_close(
    finished: Path,
) -> None:
    results = finished / "results/small"
    for place, count in (("filling", 1), ("drop_test", 1), ("process", 2)):
        assert len(list((results / place).iterdir())) == count
    for file in results.glob("process/*/tables/closure.json"):
        assert json.loads(file.read_text())["verdict"] == "pass"


def test_a_search_may_name_each_quantity_that_a_run_has_and_no_other(finished: Path) -> None:
    """Of the registry of the report: any other would make every setting infeasible."""
    run = next((finished / "results/small/process").iterdir())
    values, file = ReportedCase((read_study_runs(run),)).values, finished / "studies/small"
    study = yaml.safe_load(SMALL_STUDY.read_text()) | {"sweep": {"seed": [1, 2]}}
    bounds, accepted = {"motion.speed_m_s": [0.01, 0.02]}, set()
    for quantity in REPORTED:
        search = {"vary": bounds, "objective": {"quantity": quantity.name}}
        with contextlib.suppress(InputError):
            validate(study | {"search": search}, file / "study.yaml", whole=True)
            accepted.add(quantity.name)
    assert accepted == {standing.quantity.name for standing in values.standings}
    assert {quantity.name for quantity in REPORTED} - accepted == {"torque_mean"}


def test_the_workpiece_goes_where_it_should(finished: Path) -> None:
    (run,) = (finished / "results/small/process").glob("*0.016*")
    force = pd.read_parquet(run / "tables/workpiece_force.parquet")
    filling = yaml.safe_load(
        next((finished / "results/small/filling").iterdir())
        .joinpath("tables/packing.json")
        .read_text()
    )
    drag = force[force.phase == "drag"]
    assert abs(drag.ref_z_m - (filling["bed_height_m"] - 0.016)).max() < 1e-6
    radius = (drag.ref_x_m**2 + drag.ref_y_m**2) ** 0.5
    assert abs(radius - 0.010).max() < 1e-6


def test_particles_that_stick_to_the_workpiece_move_with_it(finished: Path) -> None:
    """Below the limit of friction a particle's surface follows the workpiece's, however that
    moves."""
    for run in (finished / "results/small/process").iterdir():
        contacts = pd.read_parquet(run / "tables/workpiece_contacts.parquet")
        pressed = contacts[contacts["in_statistics"] & (contacts["normal_force_n"] > 5e-3)]
        slip = (pressed[["slip_x_m_s", "slip_y_m_s", "slip_z_m_s"]] ** 2).sum(axis=1) ** 0.5
        most = 0.28 * pressed["normal_force_n"]
        sticks = pressed["tangential_force_n"] < 0.8 * most
        slides = pressed["tangential_force_n"] > 0.99 * most
        assert sticks.sum() > 30
        assert slip[sticks].median() < 0.1 * slip[slides].median()
        assert (run / "tables/workpiece.vtp").is_file()


def unbalanced(folder: Path, friction: float) -> np.ndarray:
    """Contact forces and weight minus inertia of every particle over the frame's mean contact."""
    run = Run.open(folder)
    names = ("fx", "fy", "fz")
    moving = {
        frame.step: frame.vectors(*names)[np.argsort(frame.ids("id"))]
        for frame in read_dump(folder / "total_forces.1.dump")
    }
    beside = {pair.step: pair for pair in run.workpiece_pairs()}
    found = []
    for contacts, particles in zip(run.frames("contacts"), run.frames("particles"), strict=True):
        if contacts.opening:  # evaluated before the first step of the drag
            continue
        particles = particles.take(np.argsort(particles.ids("particle_id")))
        touching = beside[contacts.step].join()
        limit, walls = FrictionLimit(friction, wall=False), run.case.bowl.walls
        rows = contact_rows(particles, contacts, touching.workpiece, touching.bowl, walls, limit)
        weight = 2656 * 4 / 3 * np.pi * particles.columns["radius_m"] ** 3 * 9.81
        force = np.column_stack([0 * weight, 0 * weight, -weight]) - moving[contacts.step]
        between = rows.b_id > 0
        np.add.at(force, rows.a_id - 1, rows.force_n)
        np.add.at(force, rows.b_id[between] - 1, -rows.force_n[between])
        found.append(np.linalg.norm(force, axis=1) / rows.normal_force_n.mean())
    return np.concatenate(found)


def test_contact_forces_weight_and_inertia_of_every_particle_balance(finished: Path) -> None:
    """What is left is the damping of half a step; the dumped forces alone miss by far more."""
    (folder,) = (finished / "results/small/process").glob("*0.016*")
    cut, written = (np.quantile(unbalanced(folder, mu), 0.9) for mu in (0.34, 1e9))
    assert cut < 0.02
    assert cut < 0.25 * written


@pytest.mark.parametrize(
    "file", sorted((ROOT / "docs/examples").glob("*.ipynb")), ids=lambda f: f.stem
)
def test_a_notebook_runs(finished: Path, file: Path) -> None:
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(file, as_version=4)
    first = next(cell for cell in notebook.cells if cell.cell_type == "code")
    first.source = 'study_name = "small"'
    folder = {"metadata": {"path": str(finished / "studies")}}
    NotebookClient(notebook, timeout=None, resources=folder).execute()
    outputs = [one for cell in notebook.cells for one in cell.get("outputs", [])]
    pictures = [one for one in outputs if "image/png" in one.get("data", {})]
    assert len(pictures) == sum("plt." in cell.source for cell in notebook.cells)
    assert not [one for one in outputs if "Warning" in one.get("text", "")]
    shown = "".join(one.get("data", {}).get("text/plain", "") for one in outputs)
    runs = [folder.name for folder in (finished / "results/small/process").iterdir()]
    assert any(run.rsplit("-", 1)[0] in shown for run in runs)


def test_every_column_has_a_unit_a_description_and_the_type_that_the_reference_states(
    finished: Path,
) -> None:
    rows = pd.read_csv(ROOT / "analysis/dragchain/tables/columns.csv", dtype=str)
    of_tables = set(zip(rows["column"], rows["tables"], strict=True))
    of_quantities = [
        column for column, tables, _ in _rows() if (column, " ".join(tables)) not in of_tables
    ]
    kinds = ["flag" if column.endswith("_reliable") else "number" for column in of_quantities]
    rows = pd.concat(
        [rows, pd.DataFrame({"column": of_quantities, "tables": "summary", "type": kinds})]
    )
    files = list((finished / "results/small").rglob("*.parquet"))
    assert {file.stem for file in files} >= {"thermo", "impacts", "facets", "chains", "summary"}
    wrong = set()
    for file in files:
        of_table = rows[[file.stem in tables.split() for tables in rows["tables"]]]
        for field in pq.read_schema(file):
            named = [fnmatchcase(field.name, column) for column in of_table["column"]]
            kinds = [TYPES[kind] for kind in of_table["type"][named]]
            if not {b"unit", b"description"} <= set(field.metadata or {}):
                wrong.add(f"{file.stem}.{field.name}: no unit or description")
            if not kinds or not str(field.type).startswith(kinds[0]):
                wrong.add(f"{file.stem}.{field.name}: {field.type}")
    assert not wrong


def test_nothing_is_left_to_do(finished: Path) -> None:
    assert jobs(finished, *STUDY) == set()


def test_a_deleted_table_is_made_again(finished: Path) -> None:
    results = finished / "results/small"
    for place, scene in SCENES.items():
        run, *_ = (results / place).iterdir()
        deleted = run / "tables" / scene.tables[-1]
        kept = deleted.rename(run / "kept")
        wanted = jobs(finished, place, "--config", "study=small")
        kept.rename(deleted)
        assert wanted == {place, f"tabulate_{place}"}


def test_frames_are_exported_when_asked_for(finished: Path) -> None:
    export = ("export", "--config", "study=small")
    assert jobs(finished, *export) == {"export", "export_paraview"}
    succeed(finished, *export)
    for run in (finished / "results/small/process").iterdir():
        times = set(pd.read_parquet(run / "tables/particles.parquet", columns=["time_s"])["time_s"])
        assert pv.PVDReader(run / "export/paraview/run.pvd").time_values == sorted(times)
    assert jobs(finished, *export) == set()
    succeed(finished, *export, "--forcerun", "export_paraview")


def test_the_study_becomes_a_crate(finished: Path) -> None:
    pytest.importorskip("rocrate")
    odd = finished / "studies/small/a 'file' {of} $(touch run-by-shell).csv"
    odd.write_text("x\n1\n")
    crate = ("crate", "--config", "study=small")
    assert jobs(finished, *crate) == {"crate", "write_crate"}
    succeed(finished, *crate)
    folder = finished / "results/small/crate"
    graph = json.loads((folder / "ro-crate-metadata.json").read_text())["@graph"]
    named = {unquote(entity["@id"]): entity for entity in graph}
    wanted = ["studies/small/study.yaml", "templates/process.in.j2", "templates/filling.in.j2"]
    wanted += ["studies/small/templates/process.in.j2", str(odd.relative_to(finished))]
    wanted += [f"results/small/report/summary.{end}" for end in ("csv", "parquet", "xlsx")]
    for name in wanted:
        assert named[name]["sha256"] == sha256((folder / name).read_bytes()).hexdigest()
    assert named["./"]["license"] == "CC-BY-4.0 $(touch run-by-shell)"
    assert not list(finished.rglob("run-by-shell"))
    for file in (file for file in folder.rglob("*") if file.is_file()):
        assert str(finished).encode() not in file.read_bytes()
    assert jobs(finished, *crate) == set()
    odd.unlink()


def edited(project: Path, *depths_m: float) -> None:
    """Let the study have these depths."""
    file = project / "studies/small/study.yaml"
    data = yaml.safe_load(file.read_text())
    data["sweep"]["motion.immersion_depth_m"] = list(depths_m)
    file.write_text(yaml.safe_dump(data))


def test_a_new_case_runs_alone(finished: Path) -> None:
    edited(finished, 0.012, 0.016, 0.014)
    wanted = jobs(finished, "process", "--config", "study=small")
    assert wanted == {"render_process", "run_process", "tabulate_process", "process"}


FAILS = """{% block run %}
{% if '0.013' in deck.run %}quit
{% endif %}
{{ super() }}{% endblock %}
"""


def test_an_edited_template_runs_what_depends_on_it_and_a_failed_case_is_listed(
    finished: Path,
) -> None:
    """The others are reported; of them only a remark has changed, so that LIGGGHTS need not run."""
    edited(finished, 0.012, 0.016, 0.013)
    template = finished / "templates/process.in.j2"
    text = template.read_text()
    template.write_text(text.replace("{% block run %}", "{% block run %}\n# a remark"))
    with (finished / "studies/small/templates/process.in.j2").open("a") as own_template:
        own_template.write(FAILS)
    done = snakemake(finished, *STUDY)
    told = done.stdout + done.stderr
    assert done.returncode != 0 and "1 run(s) have no result" in told
    assert "rule run_process" in told
    assert "rule run_filling" not in told and "rule render_filling" not in told
    logs = [file.read_text() for file in finished.glob("results/small/process/*/logs/run.log")]
    assert sorted("already complete with these inputs" in log for log in logs) == [
        False,
        True,
        True,
    ]
    report = finished / "results/small/report"
    assert len(pd.read_parquet(report / "summary.parquet")) == 2
    assert "LIGGGHTS ended normally" in (report / "report.html").read_text()
    edited(finished, 0.012, 0.016)
    wanted = jobs(finished, *STUDY)
    assert "write_report" in wanted and not wanted & {"render_process", "run_process"}

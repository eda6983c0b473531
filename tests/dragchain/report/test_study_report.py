import base64
import html
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from loading_files import made_contacts, write_run, write_without_picture
from made_run import particles_kept, run_json, with_motion
from pages import stands_alone
from report_files import (
    DROP,
    FILLING,
    PICTURES,
    PNG,
    case_json,
    change_scripts,
    make_run,
    page_of,
    process_findings,
    write_measured,
    write_quantities,
)

from dragchain.errors import MissingRunsError, TableError
from dragchain.report import study_report
from dragchain.report.coarse_grained import NO_RULE, Extrapolation
from dragchain.report.study_report import write_study_report
from dragchain.report.summary import main_numbers
from dragchain.statistics.estimate import Estimate


@pytest.fixture
def process(tmp_path: Path) -> Path:
    """Return a process run with its fill and its drop."""
    results = tmp_path / "results"
    make_run(results, case_json("filling", "filling-1"), FILLING, [])
    make_run(results, case_json("drop_test", "drop-1"), DROP, ["drop_test"])
    upstream = {"filling": "filling-1", "drop_test": "drop-1"}
    case = case_json("process", "workpiece-1", upstream=upstream)
    return make_run(results, case, process_findings(), PICTURES)


@pytest.fixture
def other(process: Path) -> Path:
    """Return a second process run, which names no filling and no drop test."""
    case = case_json("process", "workpiece-2", case="second")
    return make_run(process.parents[2], case, process_findings(), PICTURES, -3.0)


def test_summary_has_the_numbers_of_run_filling_and_drop(process: Path, tmp_path: Path) -> None:
    write_study_report(tmp_path, [process])
    (row,) = pd.read_parquet(tmp_path / "summary.parquet").to_dict("records")
    expected = {
        "case": "10 mm <workpiece>", "input_media_count": 1422,
        "input_motion_plunge_at_m": "[0.0, 0.0]",
        "fidelity_youngs_modulus_scale": 0.01, "drag_mean_n": -2.5, "drag_mean_ci95_low_n": -2.6,
        "drag_against_experiment_percent": pytest.approx(100 * (2.5 / 2.59 - 1)),
        "peak_max_n": -3.9, "bed_height_m": 0.0703, "restitution_effective": 0.71,
        "restitution_input": 0.68,
    }  # fmt: skip
    assert {name: row[name] for name in expected} == expected
    assert row["drag_mean_reliable"] and "ahead_behind" not in row


def test_what_templates_change_in_any_run_is_told_everywhere(process: Path, tmp_path: Path) -> None:
    write_study_report(tmp_path, [process])
    assert "changed by templates" not in (tmp_path / "report.html").read_text(encoding="utf-8")
    change_scripts(process, "base.in.j2 (contact_model)")
    filling = process.parents[1] / "filling/filling-1"
    change_scripts(filling, "base.in.j2 (contact_model)", "filling.in.j2 (integration)")
    write_study_report(tmp_path, [process])
    line = "changed by templates: base.in.j2 (contact_model); filling.in.j2 (integration)"
    assert f"Input scripts {line}." in summary_box(tmp_path)
    row = pd.read_csv(tmp_path / "summary.csv").iloc[0]
    assert row["changed_scripts"] == line.partition(": ")[2]
    assert row["headline"].endswith(f"; input scripts {line}") and line in row["settings"]
    assert line in main_numbers(tmp_path)


def test_page_is_whole_and_needs_nothing_else(process: Path, tmp_path: Path) -> None:
    write_study_report(tmp_path, [process])
    page = stands_alone((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert len(page.images) == len(PICTURES) + 1
    assert all(image.startswith("data:image/png;base64,") for image in page.images)
    assert base64.b64decode(page.images[0].split(",")[1]) == PNG


def test_each_case_has_its_own_page_on_the_contact_network(
    process: Path, other: Path, tmp_path: Path
) -> None:
    (other / "network.html").write_text("the second")
    write_study_report(tmp_path / "out", [process, other])
    assert (tmp_path / "out/network-workpiece-2.html").read_text() == "the second"
    page = page_of(tmp_path / "out")
    assert "network-workpiece-2.html" in page.references
    assert "network-workpiece-1.html" not in page.references
    write_study_report(tmp_path / "one", [other])
    stands_alone((tmp_path / "one/report.html").read_text(encoding="utf-8"), ["network.html"])


def test_values_at_the_true_size_have_a_table_and_a_file(
    process: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "complete").touch()
    write_study_report(tmp_path, [process])
    assert not (tmp_path / "true_size.csv").exists()
    assert not (tmp_path / "complete").exists(), "whether it has all runs, the workflow says"
    known = Extrapolation(
        "first", "drag_mean", "mean drag", "N", Estimate(-1.25, -1.5, -1.0), None, "1.5 (2), 2 (2)",
        "not tested",
    )  # fmt: skip
    rows = [known, replace(known, quantity="events", value=None, linearity=NO_RULE)]
    monkeypatch.setattr(study_report, "coarse_grained", lambda _: rows)
    write_study_report(tmp_path, [process])
    table = pd.read_csv(tmp_path / "true_size.csv")
    assert table["value"].tolist()[0] == -1.25 and np.isnan(table["value"][1])
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    section = text.partition('id="first-true-size"')[2].partition("<h2")[0]
    assert "1.25" in section and "not simulated" in section and "contact events" not in section


def test_no_process_run_is_no_report(process: Path, tmp_path: Path) -> None:
    with pytest.raises(TableError, match="no folder of a process run"):
        write_study_report(tmp_path / "report", [process.parent.parent / "filling" / "filling-1"])


@pytest.mark.parametrize("scene", ["process/workpiece-1", "filling/filling-1"])
def test_a_run_that_failed_a_check_is_listed_and_the_others_are_reported(
    process: Path, other: Path, tmp_path: Path, scene: str
) -> None:
    file = process.parent.parent / scene / "state.json"
    file.write_text(json.dumps(run_json(state="failed", checks=[particles_kept(1421)])))
    (file.parent / "run.json").unlink()
    with pytest.raises(MissingRunsError, match=r"(?s)no particle lost: 1421.*timestep_fraction"):
        write_study_report(tmp_path / "report", [process, other])
    table = pd.read_parquet(tmp_path / "report" / "summary.parquet")
    assert table["drag_mean_n"].tolist() == [-3.0]
    words = page_of(tmp_path / "report").words
    assert "no particle lost: 1421 (limit: 1422)" in words
    assert "smaller timestep_fraction" in words
    assert "without a result" in words


def test_a_drop_test_without_a_result_takes_no_process_along(process: Path, tmp_path: Path) -> None:
    (process.parent.parent / "drop_test/drop-1/run.json").unlink()
    with pytest.raises(MissingRunsError, match=r"1 run\(s\) have no result.*\n  drop_test"):
        write_study_report(tmp_path / "report", [process])
    table = pd.read_parquet(tmp_path / "report" / "summary.parquet")
    assert table["restitution_effective"].isna().all()


def test_a_run_that_was_never_written_points_to_the_run_before_it(
    process: Path, other: Path, tmp_path: Path
) -> None:
    filling, never = process.parents[1] / "filling/filling-2", process.parent / "third-0123"
    (filling / "logs").mkdir(parents=True)
    (filling / "logs/run.log").write_text(
        "step 5\ndragdeck: results: no engine\n  remedy: install it\n"
    )
    with pytest.raises(MissingRunsError) as caught:
        write_study_report(tmp_path / "report", [process, never, filling])
    assert str(caught.value).splitlines()[1:] == [
        "  filling filling-2: results: no engine",
        "    remedy: install it",
        "  process third-0123: not run, since a run before it has no result",
        "    remedy: see that run",
    ]


@pytest.mark.parametrize(("log", "said"), [
    ("render.log", "would reach below the floor"), ("tabulate.log", "ends inside a frame"),
])  # fmt: skip
def test_the_step_that_failed_says_why(
    process: Path, other: Path, tmp_path: Path, log: str, said: str
) -> None:
    (process / "tables" / "findings.json").unlink()
    (process / "logs").mkdir()
    (process / "logs" / log).write_text(
        f"line\ndragchain: it {said}\n  value: 3\n  remedy: do so\n"
    )
    with pytest.raises(MissingRunsError, match=rf"it {said} value: 3\n    remedy: do so"):
        write_study_report(tmp_path / "report", [process, other])


def test_without_any_result_there_is_no_report(process: Path, tmp_path: Path) -> None:
    (process / "run.json").unlink()
    with pytest.raises(MissingRunsError, match="there is no report"):
        write_study_report(tmp_path / "report", [process])
    assert not (tmp_path / "report").exists()


# --- what the page says follows from the settings ---------------------------------------------


def with_settings(process: Path, **settings: float) -> Path:
    """The process run with other settings and with its loading."""
    case = json.loads((process / "case.json").read_text())
    case["fidelity"] |= settings
    circle = {"kind": "circle", "radius_m": 0.02}
    case = with_motion(case, circle, 0.01, orientation="follow_path")
    (process / "case.json").write_text(json.dumps(case))
    made = write_run(process.parent / "made", made_contacts())
    write_without_picture(made)
    (process / "tables/loading.json").write_bytes((made / "tables/loading.json").read_bytes())
    shutil.rmtree(made)
    return process


def summary_box(out: Path) -> str:
    """The words of the first screen."""
    page = (out / "report.html").read_text(encoding="utf-8")
    return words_of(page[page.index('<div class="box says">') : page.index("<h2 id=")])


def words_of(page: str) -> str:
    return " ".join(html.unescape(re.sub("<[^>]+>", " ", page)).split())


def test_a_faster_run_says_so_first_and_gives_contacts_of_the_run_only(
    process: Path, tmp_path: Path
) -> None:
    """Fewer and larger contact forces, not more and smaller; times are those of the process."""
    run = with_settings(process, youngs_modulus_scale=1.0, speed_factor=5.0)
    write_quantities(run)
    write_study_report(tmp_path, [run])
    words = summary_box(tmp_path)
    assert "2 mm/s; simulated at 10 mm/s" in words
    assert "fewer and larger contact forces" in words and "more and smaller" not in words
    row = pd.read_csv(tmp_path / "summary.csv").iloc[0]
    own = float(row["workpiece_contacts"])
    assert f"contacts on the workpiece at a time {own:#.3g}, this run only" in row["headline"]
    assert "this run only" in row["headline"] and "not available" not in row["headline"]
    assert f"{own:.2f} contacts on the workpiece at a time , this run only" in words
    assert "not available" not in words
    assert row["normal_impulse_n_s_per_m"] == pytest.approx(5 * 2.0)


def test_the_numbers_from_windows_come_first(process: Path, tmp_path: Path) -> None:
    run = with_settings(process, youngs_modulus_scale=0.01)
    write_quantities(run, corrected=0.8)
    write_study_report(tmp_path, [run])
    row = pd.read_csv(tmp_path / "summary.csv").iloc[0]
    own = float(row["workpiece_contacts"])
    assert row["extrapolated_workpiece_contacts"] == pytest.approx(0.8 * own)
    words = summary_box(tmp_path)
    assert f"through {0.8 * own:.2f} contacts at a time" in words
    assert "as simulated: \N{MINUS SIGN}2.50 N" in words
    (line,) = main_numbers(tmp_path).splitlines()[1:2]
    assert "mean drag -2.00 N (95 % CI -2.20 to -1.80 N) from 3 windows" in line


def test_forces_of_a_short_series_are_marked_everywhere(process: Path, tmp_path: Path) -> None:
    write_measured(process, vertical_mean=Estimate(-2.5, -2.6, -2.4, reliable=False))
    write_study_report(tmp_path, [process])
    words = page_of(tmp_path).words
    row = words[words.index("mean vertical force (N)") :]
    assert "too short for a reliable interval" in row[:300]
    assert not pd.read_csv(tmp_path / "summary.csv").iloc[0]["vertical_mean_reliable"]


def test_the_torque_of_a_workpiece_that_spins_stands_with_the_forces(
    process: Path, tmp_path: Path
) -> None:
    write_study_report(tmp_path, [process])
    assert "torque" not in page_of(tmp_path).words.partition("Definitions")[0]
    assert "torque_mean_n_m" not in pd.read_csv(tmp_path / "summary.csv")
    write_measured(process, torque_mean=Estimate(-0.003, -0.004, -0.002))
    write_study_report(tmp_path, [process])
    words, minus = page_of(tmp_path).words, "\N{MINUS SIGN}"
    ends = f"{minus}0.0030 ({minus}0.0040 to {minus}0.0020)"
    assert f"mean torque about the workpiece's axis (N m)\n{ends}" in words
    row = pd.read_csv(tmp_path / "summary.csv").iloc[0]
    assert row["torque_mean_ci95_low_n_m"] == pytest.approx(-0.004)


def test_an_inclined_rod_has_the_diameter_of_its_study(process: Path, tmp_path: Path) -> None:
    reach = {"kind": "mesh", "radius_m": 0.0137, "length_m": 0.08, "immersion_depth_m": 0.05}
    case = case_json("process", "run-1", {"workpiece.shape.radius_m": 0.005}, workpiece=reach)
    case = with_motion(case, {"kind": "circle", "radius_m": 0.02}, 0.01, tilt_deg=10)
    run = make_run(process.parents[2], case, process_findings(), PICTURES)
    write_study_report(tmp_path, [run])
    words = page_of(tmp_path).words
    assert "cylinder, diameter 10 mm" in words
    assert "inclined by 10\N{DEGREE SIGN}" in words


# --- several packings -------------------------------------------------------------------------


@pytest.fixture
def packings(process: Path) -> list[Path]:
    """Three runs that differ in their seeds and MPI ranks alone, and one of another case."""
    found = []
    for seed, drag in enumerate((-2.4, -2.5, -2.9), 1):
        case = case_json("process", f"run-{seed}", {"seed": seed}, case=f"draft_seed-{seed}")
        case["fidelity"]["ranks"] = seed
        found.append(make_run(process.parents[2], case, process_findings(), PICTURES, drag))
    other = case_json("process", "run-9", {"media.count": 900}, case="other")
    return [*found, make_run(process.parents[2], other, process_findings(), PICTURES, -1.0)]


def test_packings_of_one_case_have_one_headline_and_another_case_its_own(
    packings: list[Path], tmp_path: Path
) -> None:
    """Mean -2.6 with a standard error of 0.153: Student's t with 2 degrees of freedom, 4.303."""
    write_study_report(tmp_path / "one", packings[:3])
    words = summary_box(tmp_path / "one")
    low, high = (f"\N{MINUS SIGN}{value:.2f}" for value in (2.6 + 0.6572, 2.6 - 0.6572))
    assert "mean force of 2.60 N" in words and f"mean drag , 95 % CI {low} to {high}" in words
    write_study_report(tmp_path / "two", packings)
    headlines = pd.read_csv(tmp_path / "two/summary.csv").groupby("case")["headline"].nunique()
    assert headlines.tolist() == [1, 1, 1, 1] and "-2.60" in main_numbers(tmp_path / "two")
    assert main_numbers(tmp_path / "two").count("mean drag") == 2

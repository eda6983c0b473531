from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from loading_files import made_contacts, write_run
from pages import stands_alone
from report_files import (
    DROP,
    FILLING,
    PICTURES,
    PNG,
    case_json,
    make_run,
    page_of,
    particles_kept,
    process_findings,
    run_json,
)

from dragchain.errors import DocumentError, RejectedRunError, TableError
from dragchain.loading.write import write_loading
from dragchain.report.run_figures import FIGURES
from dragchain.report.study_report import write_report
from dragchain.report.summary import input_column
from dragchain.run.completeness import RunRecord, refusal
from dragchain.tables.corrections import Corrections


@pytest.fixture
def process(tmp_path: Path) -> Path:
    """Return a process run with its fill and its drop."""
    results = tmp_path / "results"
    make_run(results, case_json("filling", "filling-1"), FILLING, [])
    make_run(results, case_json("drop_test", "drop-1"), DROP, ["drop_test"])
    upstream = {"filling": "filling-1", "drop_test": "drop-1"}
    case = case_json("process", "workpiece-1", upstream=upstream)
    return make_run(results, case, process_findings(), PICTURES)


def test_summary_has_the_numbers_of_run_filling_and_drop(process: Path, tmp_path: Path) -> None:
    out = tmp_path / "report"
    write_report(out, [process])
    table = pd.read_parquet(out / "summary.parquet")
    assert len(table) == 1
    row = table.iloc[0]
    assert row["case"] == "10 mm <workpiece>"
    assert row["input_media_count"] == 1422
    assert row["input_seeds"] == "[1, 2]"
    assert row["fidelity_youngs_modulus_scale"] == 0.01
    assert row["drag_mean_n"] == -2.5
    assert row["drag_ci95_low_n"] == -2.6
    assert row["drag_against_measured_percent"] == -3.47
    assert row["peak_max_n"] == -3.9
    assert row["bed_height_m"] == 0.0703
    assert row["restitution_effective"] == 0.71
    assert row["restitution_input"] == 0.68
    assert pd.isna(row["ahead_behind_ratio"])
    assert all(re.fullmatch("[a-z][a-z0-9_]*", name) for name in table.columns)


def test_csv_and_parquet_hold_the_same(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path / "report", [process])
    table = pd.read_parquet(tmp_path / "report" / "summary.parquet")
    text = pd.read_csv(tmp_path / "report" / "summary.csv")
    assert list(text.columns) == list(table.columns)
    assert text["drag_mean_n"].tolist() == table["drag_mean_n"].tolist()
    assert sorted(path.name for path in (tmp_path / "report").iterdir()) == [
        "report.html", "summary.csv", "summary.parquet",
    ]  # fmt: skip


def test_page_is_whole_and_needs_nothing_else(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path, [process])
    page = stands_alone((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert len(page.images) == len(PICTURES) + 1
    assert all(image.startswith("data:image/png;base64,") for image in page.images)
    assert base64.b64decode(page.images[0].split(",")[1]) == PNG


def test_page_shows_the_contacts_on_the_workpiece_if_they_are_known(
    process: Path, tmp_path: Path
) -> None:
    write_report(tmp_path / "without", [process])
    assert "force \N{MULTIPLICATION SIGN} sliding" not in page_of(tmp_path / "without").words
    made = write_run(tmp_path / "made", made_contacts())
    write_loading(made)
    for file in ("tables/loading.json", "figures/workpiece.png"):
        (process / file).write_bytes((made / file).read_bytes())
    write_report(tmp_path / "with", [process])
    page = page_of(tmp_path / "with")
    assert page.open == []
    assert len(page.images) == len(PICTURES) + 2
    html = (tmp_path / "with" / "report.html").read_text(encoding="utf-8")
    words = " ".join(re.sub("<[^>]+>", " ", html).split())
    assert "impact 2 0.33 % (" in words
    assert "resting 1 17 % (" in words
    assert "normal impulse (N s) 0.856" in words
    assert "friction work (J) 0.00200" in words


def test_page_says_how_many_contacts_were_corrected(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path / "without", [process])
    assert "Corrected contact forces" not in page_of(tmp_path / "without").words
    counts = np.array([1000, 171, 250, 10, 96, 4, 0.02, 1.0])
    Corrections.of(0.34, counts).write(process / "tables/corrections.json")
    write_report(tmp_path / "with", [process])
    words = page_of(tmp_path / "with").words
    assert "cut to the limit in 17 % of the contacts between particles (4.0 % of those" in words
    assert "removes 2.0 % of the sum" in words
    assert "for the workpiece, 4.0 % were the second contact" in words


def test_page_says_what_counts(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path, [process])
    words = page_of(tmp_path).words
    for expected in (
        "10 mm <workpiece>", "\N{MINUS SIGN}3.5 %", "\N{MINUS SIGN}7.3 % to +0.4 %", "assumed",
        "a plausible fraction", "bowl.radius_m", "Engine 3.8", "every particle kept", "passed",
        "a paper",
        "70.3 mm", "Peters et al. (2005)", "Thornton 2000",
    ):  # fmt: skip
        assert expected in words


def test_two_cases_have_two_rows_and_an_overview(process: Path, tmp_path: Path) -> None:
    case = case_json("process", "workpiece-2", case="second")
    other = make_run(tmp_path / "results", case, process_findings(-3.0), PICTURES)
    write_report(tmp_path, [process, other])
    table = pd.read_parquet(tmp_path / "summary.parquet")
    assert table["drag_mean_n"].tolist() == [-2.5, -3.0]
    assert table["solid_fraction"].isna().tolist() == [False, True]
    page = page_of(tmp_path)
    assert len(page.images) == 2 * len(PICTURES) + 2
    assert "#workpiece-2" in page.references


def test_folders_of_filling_and_drop_may_be_given_too(process: Path, tmp_path: Path) -> None:
    small = process.parent.parent
    write_report(
        tmp_path, [small / "filling" / "filling-1", process, small / "drop_test" / "drop-1"]
    )
    assert len(pd.read_parquet(tmp_path / "summary.parquet")) == 1


def test_no_process_run_is_no_report(process: Path, tmp_path: Path) -> None:
    with pytest.raises(TableError, match="no folder of a process run"):
        write_report(tmp_path / "report", [process.parent.parent / "filling" / "filling-1"])


@pytest.mark.parametrize("scene", ["process/workpiece-1", "filling/filling-1", "drop_test/drop-1"])
def test_a_run_that_failed_a_check_is_refused_with_what_it_saw(
    process: Path, tmp_path: Path, scene: str
) -> None:
    file = process.parent.parent / scene / "run.json"
    file.write_text(json.dumps(run_json(checks=[particles_kept(1421)])))
    out = tmp_path / "report"
    with pytest.raises(
        RejectedRunError, match=rf"{scene} is refused.*every particle kept.*1421.*1422"
    ):
        write_report(out, [process])
    assert not out.exists()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"state": "stopped"}, "state is 'stopped'"),
        ({"state": "failed"}, "state is 'failed'"),
        ({"checks": []}, "no acceptance checks"),
    ],
)
def test_refusal_gives_its_reason(change: dict[str, Any], reason: str) -> None:
    assert reason in (refusal(RunRecord.model_validate(run_json(**change))) or "")
    assert refusal(RunRecord.model_validate(run_json())) is None


def test_a_run_without_record_is_refused(process: Path, tmp_path: Path) -> None:
    (process / "run.json").unlink()
    with pytest.raises(RejectedRunError, match=r"run\.json"):
        write_report(tmp_path / "report", [process])


def test_a_missing_picture_names_the_command(process: Path, tmp_path: Path) -> None:
    (process / "figures" / "forces.png").unlink()
    with pytest.raises(TableError, match=r"forces\.png.*dragchain figures"):
        write_report(tmp_path / "report", [process])


def test_missing_findings_name_the_command(process: Path, tmp_path: Path) -> None:
    (process / "tables" / "figures.json").unlink()
    with pytest.raises(DocumentError, match=r"(?s)figures\.json.*dragchain figures"):
        write_report(tmp_path / "report", [process])


def test_input_columns_are_names() -> None:
    assert input_column("motion.speed_m_s") == "input_motion_speed_m_s"


def test_every_figure_of_a_run_has_a_caption(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path, [process])
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    shown = re.findall(r'<img src="[^"]*" alt="(\w+)"><figcaption>[A-Z]', html)
    assert set(FIGURES["process"]) | set(FIGURES["drop_test"]) <= set(shown)

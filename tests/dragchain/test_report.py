from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from pages import Page, stands_alone
from removal_files import made_contacts, write_run

from dragchain.errors import GateError, TableError
from dragchain.removal import write_removal
from dragchain.report import input_column, refusal, write_report

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
PICTURES = ["forces", "force_around_rod", "force_depth", "chains_peaks", "network_xy", "network_xz"]


def case_json(scene: str, run: str, **more: Any) -> dict[str, Any]:
    return {
        "schema": 1, "study": "small", "scene": scene, "run": run, "case": "10 mm <rod>",
        "upstream": {}, "timestep_s": 2.5e-5, "rayleigh_time_s": 3.2e-5, "gravity_m_s2": 9.81,
        "fidelity": {
            "name": "draft", "youngs_modulus_scale": 0.01, "timestep_fraction": 0.77,
            "speed_factor": 1.0, "skin_m": 0.0003, "ranks": 2,
        },
        "inputs": {"media.count": 1422, "motion.speed_m_s": 0.01, "seeds": [1, 2]},
        "media": {"count": 1422, "radius_mean_m": 0.00327, "radius_sd_m": 0.0,
                  "density_kg_m3": 2656.0},
        "bowl": {"radius_m": 0.04, "walls": "primitive"},
        "tool": {"kind": "cylinder", "radius_m": 0.005, "length_m": 0.08, "mesh": "rod.stl",
                 "submersion_m": 0.05},
        "surface_m": 0.07,
        "motion": {"kind": "circle", "speed_m_s": 0.01, "radius_m": 0.02, "sense": 1,
                   "turns_with_path": True, "start_heading_rad": 1.57},
        "phases": [], "statistics": {"run_in_s": 0.5}, "restitution": 0.68,
        "assumptions": [{"field": "bowl.radius_m", "value": 0.04, "why": "a plausible fraction"}],
        "reference": None, "versions": {"dragdeck": "0.1.0"},
    } | more  # fmt: skip


def run_json(**more: Any) -> dict[str, Any]:
    return {
        "schema": 1, "state": "complete", "engine_version": "Engine 3.8", "ranks": 2,
        "steps": 160000, "steps_per_s": 2100.0, "wall_time_s": 76.0,
        "started": "2026-01-01T00:00:00", "parts": [1],
        "gates": [{"name": "no ball lost", "passed": True, "seen": "1422", "limit": "1422"}],
    } | more  # fmt: skip


def estimate(value: float | None) -> dict[str, float | None]:
    return {"value": value, "low": value, "high": value}


def process_findings(drag: float = -2.5) -> dict[str, Any]:
    force = {
        "mean": drag,
        "sd": 0.5,
        "samples": 1000.0,
        "autocorrelation_samples": 5.0,
        "effective_samples": 100.0,
        "standard_error": 0.05,
        "ci_low": drag - 0.1,
        "ci_high": drag + 0.1,
        "confidence": 0.95,
        "reliable": True,
    }
    against = {
        "label": "measured",
        "mean_n": -2.59,
        "sd_n": 0.66,
        "difference_percent": -3.47,
        "low": -7.3,
        "high": 0.4,
        "source": "a paper",
    }
    network = dict.fromkeys(
        [
            "coordination_number",
            "mechanical_coordination_number",
            "rattler_share",
            "normal_force_mean_n",
            "ball_rod_contacts",
        ],
        4.5,
    )
    chains = dict.fromkeys(
        [
            "peters_per_frame",
            "peters_balls_mean",
            "rod_paths_per_frame",
            "rod_paths_to_side_share",
            "dominant_bottleneck_mean_n",
            "dominant_bottleneck_max_n",
            "dominant_balls_mean",
            "dominant_altitude_mean_m",
            "dominant_azimuth_mean_rad",
        ],
        0.25,
    )
    sides = dict.fromkeys(["ahead_n", "behind_n", "share_ahead"], estimate(1.0))
    return {
        "schema": 1, "scene": "process",
        "forces": {name: force for name in ("drag_n", "lateral_n", "vertical_n")},
        "comparison": [against], "peaks": {"count": 4, "largest_n": -3.9},
        "network": network | {"frames": 31}, "chains": chains,
        "association": {"rank_correlation": 0.4, "p_value": 0.2},
        "ahead_behind": sides | {"ratio": estimate(None)}, "depth": {"slope_n_m": estimate(5.0)},
    }  # fmt: skip


FILL = {"bed": {"fill_height_m": 0.0703, "solid_fraction": 0.592}}
DROP = {"restitution": {"mean": 0.71, "lowest": 0.7, "highest": 0.72, "input": 0.68}}


def make_run(
    results: Path, case: dict[str, Any], findings: dict[str, Any], names: list[str]
) -> Path:
    folder = results / "small" / case["scene"] / case["run"]
    (folder / "tables").mkdir(parents=True)
    (folder / "figures").mkdir()
    (folder / "case.json").write_text(json.dumps(case))
    (folder / "run.json").write_text(json.dumps(run_json()))
    (folder / "tables" / "figures.json").write_text(json.dumps(findings))
    for name in names:
        (folder / "figures" / f"{name}.png").write_bytes(PNG)
    return folder


@pytest.fixture
def process(tmp_path: Path) -> Path:
    """Return a process run with its fill and its drop."""
    results = tmp_path / "results"
    make_run(results, case_json("fill", "fill-1"), FILL, [])
    make_run(results, case_json("drop", "drop-1"), DROP, ["drop"])
    upstream = {"fill": "fill-1", "drop": "drop-1"}
    case = case_json("process", "rod-1", upstream=upstream)
    return make_run(results, case, process_findings(), PICTURES)


def page_of(out: Path) -> Page:
    return Page((out / "report.html").read_text(encoding="utf-8"))


def test_summary_has_the_numbers_of_run_fill_and_drop(process: Path, tmp_path: Path) -> None:
    out = tmp_path / "report"
    write_report(out, [process])
    table = pd.read_parquet(out / "summary.parquet")
    assert len(table) == 1
    row = table.iloc[0]
    assert row["case"] == "10 mm <rod>"
    assert row["input_media_count"] == 1422
    assert row["input_seeds"] == "[1, 2]"
    assert row["fidelity_youngs_modulus_scale"] == 0.01
    assert row["drag_mean_n"] == -2.5
    assert row["drag_ci95_low_n"] == -2.6
    assert row["drag_against_measured_percent"] == -3.47
    assert row["peak_max_n"] == -3.9
    assert row["fill_height_m"] == 0.0703
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


def test_page_shows_the_contacts_on_the_tool_if_they_are_known(
    process: Path, tmp_path: Path
) -> None:
    write_report(tmp_path / "without", [process])
    assert "force \N{MULTIPLICATION SIGN} sliding" not in page_of(tmp_path / "without").words
    made = write_run(tmp_path / "made", made_contacts())
    write_removal(made)
    for file in ("tables/removal.json", "figures/rod.png"):
        (process / file).write_bytes((made / file).read_bytes())
    write_report(tmp_path / "with", [process])
    page = page_of(tmp_path / "with")
    assert page.open == []
    assert len(page.images) == len(PICTURES) + 2
    html = (tmp_path / "with" / "report.html").read_text(encoding="utf-8")
    words = " ".join(re.sub("<[^>]+>", " ", html).split())
    assert "impact 2 0.33 % (" in words
    assert "resting 1 17 % (" in words
    assert "normal impulse in N s 0.856" in words
    assert "friction work in J 0.00200" in words


def test_page_says_what_counts(process: Path, tmp_path: Path) -> None:
    write_report(tmp_path, [process])
    words = page_of(tmp_path).words
    for expected in (
        "10 mm <rod>", "\N{MINUS SIGN}3.5 %", "\N{MINUS SIGN}7.3 % to +0.4 %", "assumed",
        "a plausible fraction", "bowl.radius_m", "Engine 3.8", "no ball lost", "passed", "a paper",
        "70.3 mm", "Peters et al. (2005)", "Thornton 2000",
    ):  # fmt: skip
        assert expected in words


def test_two_cases_have_two_rows_and_an_overview(process: Path, tmp_path: Path) -> None:
    case = case_json("process", "rod-2", case="second")
    other = make_run(tmp_path / "results", case, process_findings(-3.0), PICTURES)
    write_report(tmp_path, [process, other])
    table = pd.read_parquet(tmp_path / "summary.parquet")
    assert table["drag_mean_n"].tolist() == [-2.5, -3.0]
    assert table["solid_fraction"].isna().tolist() == [False, True]
    page = page_of(tmp_path)
    assert len(page.images) == 2 * len(PICTURES) + 2
    assert "#rod-2" in page.references


def test_folders_of_fill_and_drop_may_be_given_too(process: Path, tmp_path: Path) -> None:
    small = process.parent.parent
    write_report(tmp_path, [small / "fill" / "fill-1", process, small / "drop" / "drop-1"])
    assert len(pd.read_parquet(tmp_path / "summary.parquet")) == 1


def test_no_process_run_is_no_report(process: Path, tmp_path: Path) -> None:
    with pytest.raises(TableError, match="no folder of a process run"):
        write_report(tmp_path / "report", [process.parent.parent / "fill" / "fill-1"])


@pytest.mark.parametrize("scene", ["process/rod-1", "fill/fill-1", "drop/drop-1"])
def test_a_run_that_failed_a_gate_is_refused_with_what_it_saw(
    process: Path, tmp_path: Path, scene: str
) -> None:
    gates = [{"name": "no ball lost", "passed": False, "seen": "1421", "limit": "1422"}]
    file = process.parent.parent / scene / "run.json"
    file.write_text(json.dumps(run_json(gates=gates)))
    out = tmp_path / "report"
    with pytest.raises(GateError, match=rf"{scene} is refused.*no ball lost.*1421.*1422"):
        write_report(out, [process])
    assert not out.exists()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"state": "stopped"}, "state is 'stopped'"),
        ({"state": "failed"}, "state is 'failed'"),
        ({"gates": []}, "no gates"),
        ({"schema": 2}, "schema of run.json is 2"),
    ],
)
def test_refusal_gives_its_reason(change: dict[str, Any], reason: str) -> None:
    assert reason in (refusal(run_json(**change)) or "")
    assert refusal(run_json()) is None


def test_a_run_without_record_is_refused(process: Path, tmp_path: Path) -> None:
    (process / "run.json").unlink()
    with pytest.raises(GateError, match=r"run\.json"):
        write_report(tmp_path / "report", [process])


def test_a_missing_picture_names_the_command(process: Path, tmp_path: Path) -> None:
    (process / "figures" / "forces.png").unlink()
    with pytest.raises(TableError, match=r"forces\.png.*dragchain figures"):
        write_report(tmp_path / "report", [process])


def test_missing_findings_name_the_command(process: Path, tmp_path: Path) -> None:
    (process / "tables" / "figures.json").unlink()
    with pytest.raises(TableError, match=r"figures\.json.*dragchain figures"):
        write_report(tmp_path / "report", [process])


def test_input_columns_are_names() -> None:
    assert input_column("motion.speed_m_s") == "input_motion_speed_m_s"

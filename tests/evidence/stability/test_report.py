"""A coarse map on the real engine."""

import contextlib
import json
import math
import shutil
from pathlib import Path

import pandas as pd
import pytest
from pages import stands_alone
from paths import DATA, ROOT

from dragdeck.records.stability import StabilityFile
from evidence.__main__ import main as evidence
from evidence.stability.judge import ENERGY, REFUSED, STABLE, TOLERANCE, UNSTABLE
from evidence.stability.safe_steps import restitution_errors

pytestmark = [pytest.mark.engine, pytest.mark.slow]


def run_coarse_map(results: Path) -> None:
    """Run the coarse map in a project and judge it."""
    map_file = str(DATA / "coarse_map.yaml")
    with contextlib.chdir(results.parent.parent):
        assert (
            evidence(["stability", "--map", map_file, "--out", str(results), "--cores", "2"]) == 0
        )


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The coarse map, run on the engine and classified."""
    root = tmp_path_factory.mktemp("map")
    study = root / "studies" / "stability"
    study.mkdir(parents=True)
    shutil.copy(ROOT / "studies" / "stability" / "study.yaml", study)
    results = root / "results" / "stability"
    run_coarse_map(results)
    return results


def points_of(results: Path) -> pd.DataFrame:
    return pd.read_parquet(results / "points.parquet")


def test_a_coarse_map_on_the_engine(coarse: Path) -> None:
    rows = points_of(coarse)
    kinds = {
        (row["regime"], row["label"], row["fraction"]): row["class"]
        for row in rows.to_dict("records")
    }
    assert kinds["impact", "base point", 0.2] == STABLE
    assert kinds["impact", "base point", 4] == ENERGY
    assert kinds["impact", "e 0.05", 0.2] == REFUSED
    assert kinds["settle", "base point", 0.8] == STABLE
    assert kinds["settle", "base point", 3] in UNSTABLE
    assert kinds["column", "base point", 0.6] == STABLE
    assert kinds["column", "base point", 1.2] == ENERGY
    assert kinds["drag", "base point", 3] in UNSTABLE
    why = rows.loc[rows["label"] == "e 0.05", "why"]
    assert why.str.contains("coefficientRestitution").all()


def test_a_stack_breaks_at_the_critical_step_of_its_network(coarse: Path) -> None:
    rows = points_of(coarse)
    stack = rows[rows["regime"] == "column"].set_index("fraction")
    assert stack.loc[0.6, "fraction_of_critical"] < 1.0 < stack.loc[1.2, "fraction_of_critical"]


def test_an_elastic_impact_is_that_of_hertz(coarse: Path) -> None:
    """Peak force of Johnson 1985, eq. 11.22 f.: 4/3 E* R^(1/2) d^(3/2) at the largest overlap d."""
    rows = points_of(coarse)
    (row,) = rows[(rows["label"] == "e 1") & rows["reference"]].to_dict("records")
    case = json.loads((coarse / row["folder"] / "case.json").read_text())
    radius, density = case["media"]["radius_mean_m"], case["media"]["density_kg_m3"]
    mass, speed = 4 / 3 * math.pi * radius**3 * density, case["impact"]["speed_m_s"]
    modulus = case["contact_moduli"]["particle"]["modulus_pa"]
    overlap = (15 * mass * speed**2 / (16 * math.sqrt(radius) * modulus)) ** 0.4
    force = 4 / 3 * modulus * math.sqrt(radius) * overlap**1.5
    assert row["peak_force_n"] == pytest.approx(force, rel=1e-3)
    assert row["restitution_mean"] == pytest.approx(1.0, abs=1e-3)
    assert row["overlap_ratio"] == pytest.approx(overlap / radius, rel=1e-3)


def test_fewer_steps_in_a_contact_make_a_larger_error(coarse: Path) -> None:
    errors = restitution_errors(points_of(coarse)).worst
    assert len(errors) >= 2 and errors[0] > TOLERANCE > errors[-1]


def test_the_report_stands_alone(coarse: Path) -> None:
    assert stands_alone((coarse / "report.html").read_text()).images
    document = StabilityFile.read(coarse / "stability.json")
    safe = document.regimes["settle"].safe_fraction
    assert document.engine_versions and safe is not None and safe >= 0.8


def test_points_that_were_run_are_not_run_again(coarse: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in coarse.glob("impact/*/state.json")}
    run_coarse_map(coarse)
    after = {file: file.stat().st_mtime_ns for file in coarse.glob("impact/*/state.json")}
    failed_too = any(json.loads(file.read_text())["state"] == "failed" for file in after)
    assert failed_too
    assert {f: t for f, t in after.items() if t != before[f]} == {}

"""Classes and safe steps of the stability map, and a coarse map on the real engine."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pages import stands_alone
from paths import DATA, ROOT

from dragchain.cli import main as dragchain
from dragchain.stability.classes import (
    ENERGY,
    ENERGY_LIMITS,
    INACCURATE,
    LOST,
    OVERLAP,
    OVERLAP_LIMIT,
    REFUSED,
    STABLE,
    TOLERANCE,
    UNSTABLE,
    Error,
    Seen,
    classify,
    conditions,
    error_table,
    regimes,
    safe_fraction,
)
from dragchain.stability.runs import _touching


def seen(**changes: Any) -> Seen:
    return Seen(**{"regime": "impact", "state": "complete", "steps": 1000, **changes})


def failed(**checks: str) -> Seen:
    names = {"error": "no engine error", "kept": "every particle kept",
    "limits": "within its limits",
             "rest": "bed at rest", "lists": "no dangerous neighbour builds"}  # fmt: skip
    return seen(state="failed", failed={names[name]: saw for name, saw in checks.items()})


@pytest.mark.parametrize(
    ("point", "kind"),
    [
        (seen(), STABLE),
        (seen(energy_ratio=ENERGY_LIMITS["impact"]), STABLE),
        (seen(energy_ratio=ENERGY_LIMITS["impact"] * 1.001), ENERGY),
        (seen(regime="column", energy_ratio=9.0), STABLE),
        (seen(overlap_ratio=OVERLAP_LIMIT * 1.01), OVERLAP),
        (seen(errors={"restitution": Error(0.06, 0.06, 0.06)}), INACCURATE),
        (seen(errors={"restitution": Error(-0.06, -0.06, -0.06)}), INACCURATE),
        (seen(errors={"mean drag": Error(0.3, -0.1, 0.7)}), STABLE),
        (seen(errors={"mean drag": Error(0.3, 0.04, 0.56)}), STABLE),
        (seen(errors={"mean drag": Error(0.3, 0.06, 0.54)}), INACCURATE),
        (seen(errors={"mean drag": Error(0.3, -math.inf, math.inf)}), STABLE),
        (seen(state="refused", steps=0, refused="too soft"), REFUSED),
        (failed(error="ERROR: Lost atoms: original 300 current 12", kept="12"), LOST),
        (failed(limits="12 particles at step 40"), LOST),
        (failed(limits="a mean kinetic energy of 9 J a particle at step 40"), ENERGY),
        (failed(rest="NOT SETTLED: energy ratio 1e-3 after 3 s"), ENERGY),
        (failed(lists="12"), INACCURATE),
    ],
)
def test_classes(point: Seen, kind: str) -> None:
    assert classify(point)[0] == kind


def test_an_error_before_the_first_step_is_a_refusal_with_its_text() -> None:
    text = "ERROR: 0.05 < coefficientRestitution <= 1 required"
    point = seen(
        state="failed", steps=0, failed={"no engine error": text, "every particle kept": "0"}
    )
    assert classify(point) == (REFUSED, text)


def test_the_worse_of_two_classes_counts() -> None:
    point = seen(energy_ratio=2.0, overlap_ratio=1.0, errors={"restitution": Error(1, 1, 1)})
    assert classify(point)[0] == ENERGY
    kind, why = classify(seen(overlap_ratio=0.2, errors={"restitution": Error(1, 1, 1)}))
    assert kind == OVERLAP and "0.2" in why


def table(*classes: str) -> pd.DataFrame:
    return pd.DataFrame({"fraction": [0.1, 0.2, 0.4, 0.8][: len(classes)], "class": classes})


@pytest.mark.parametrize(
    ("classes", "safe"),
    [
        ((STABLE, STABLE, INACCURATE, LOST), 0.4),
        ((STABLE, ENERGY, STABLE, STABLE), 0.1),
        ((STABLE, STABLE, STABLE, STABLE), 0.8),
        ((LOST, STABLE, STABLE, STABLE), None),
    ],
)
def test_a_safe_step_has_no_unsafe_step_below(classes: tuple[str, ...], safe: float | None) -> None:
    assert safe_fraction(table(*classes).sample(frac=1, random_state=1), UNSTABLE) == safe


def points(condition: str, classes: list[str], restitution: float = 0.9) -> pd.DataFrame:
    fractions = [0.1, 0.2, 0.4, 0.8][: len(classes)]
    return pd.DataFrame(
        {
            "regime": "settle",
            "condition": condition,
            "axis": "base" if condition == "a" else "restitution",
            "label": condition,
            "fraction": fractions,
            "reference": [n == 0 for n in range(len(classes))],
            "class": classes,
            "why": "",
            "rayleigh_time_s": 2e-5,
            "critical_step_s": 1e-5,
            "damped_fraction": 1.0,
            "setting_restitution": restitution,
        }
    )


def test_a_regime_is_as_safe_as_its_worst_condition() -> None:
    found = conditions(
        pd.concat(
            [
                points("a", [STABLE, STABLE, STABLE, LOST]),
                points("b", [STABLE, STABLE, ENERGY, LOST], restitution=0.1),
                points("c", [OVERLAP, STABLE, STABLE, STABLE]),
            ]
        )
    )
    (row,) = regimes(found)
    assert row["conditions"] == 3 and row["usable"] == 2
    assert row["base_fraction"] == 0.4 and row["ordinary_fraction"] == 0.4
    assert row["safe_fraction"] == 0.2 and row["limited_by"] == "b"
    assert row["safe_critical"] == pytest.approx(0.4)  # the critical step is half the Rayleigh time
    assert row["over_rule"] == pytest.approx(1.0)
    assert row["recommended_fraction"] == pytest.approx(0.16)


def test_particles_that_touch_are_found_with_their_overlaps() -> None:
    centre = np.array([[0.0, 0.0, 0.9], [1.9, 0.0, 1.0], [1.9, 0.0, 3.1]])
    found = _touching(centre, np.ones(3), bowl_radius=2.7)
    rows = sorted(zip(found.a.tolist(), found.b.tolist(), found.overlap.tolist(), strict=True))
    assert [row[:2] for row in rows] == [(0, -1), (0, 1), (1, -1), (2, -1)]
    gap = math.hypot(1.9, 0.1)
    assert [row[2] for row in rows] == pytest.approx([0.1, 2 - gap, 0.2, 0.2])


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The coarse map, run on the engine and classified."""
    from dragdeck.campaigns.stability_map import bed_names, map_runs

    root = tmp_path_factory.mktemp("map")
    study = root / "studies" / "stability"
    study.mkdir(parents=True)
    shutil.copy(ROOT / "studies" / "stability" / "study.yaml", study)
    results = root / "results" / "stability"
    runs = map_runs(study / "study.yaml", results, ROOT / "templates", lambda line: None)
    points = DATA / "coarse_map.yaml"
    runs.settle_beds(points)
    for bed in bed_names(points):
        assert dragchain(["tables", str(results / "filling" / bed)]) == 0
    kept = [
        str(runs.run_points(points, regime)) for regime in ("impact", "settle", "column", "drag")
    ]
    assert dragchain(["step", "stability", "--out", str(results), *kept]) == 0
    return results


def found(results: Path) -> pd.DataFrame:
    return pd.read_parquet(results / "points.parquet")


@pytest.mark.engine
@pytest.mark.slow
def test_a_coarse_map_on_the_engine(coarse: Path) -> None:
    rows = found(coarse)
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


@pytest.mark.engine
@pytest.mark.slow
def test_a_stack_breaks_at_the_critical_step_of_its_network(coarse: Path) -> None:
    rows = found(coarse)
    stack = rows[rows["regime"] == "column"].set_index("fraction")
    assert stack.loc[0.6, "fraction_of_critical"] < 1.0 < stack.loc[1.2, "fraction_of_critical"]


@pytest.mark.engine
@pytest.mark.slow
def test_an_elastic_impact_is_that_of_hertz(coarse: Path) -> None:
    """Peak force of Johnson 1985, eq. 11.22 f.: 4/3 E* R^(1/2) d^(3/2) at the largest overlap d."""
    rows = found(coarse)
    (row,) = rows[(rows["label"] == "e 1") & rows["reference"]].to_dict("records")
    case = json.loads((coarse / row["folder"] / "case.json").read_text())["impact"]
    mass, radius = case["effective_mass_kg"], case["effective_radius_m"]
    modulus, speed = case["effective_modulus_pa"], case["speed_m_s"]
    overlap = (15 * mass * speed**2 / (16 * math.sqrt(radius) * modulus)) ** 0.4
    force = 4 / 3 * modulus * math.sqrt(radius) * overlap**1.5
    assert row["peak_force_n"] == pytest.approx(force, rel=1e-3)
    assert row["restitution_mean"] == pytest.approx(1.0, abs=1e-3)
    assert row["overlap_ratio"] == pytest.approx(overlap / radius, rel=1e-3)


@pytest.mark.engine
@pytest.mark.slow
def test_fewer_steps_in_a_contact_make_a_larger_error(coarse: Path) -> None:
    errors = error_table(found(coarse))["worst"]
    assert len(errors) >= 2 and errors[0] > TOLERANCE > errors[-1]


@pytest.mark.engine
@pytest.mark.slow
def test_the_report_stands_alone(coarse: Path) -> None:
    assert stands_alone((coarse / "report.html").read_text()).images
    known = json.loads((coarse / "stability.json").read_text())
    assert known["engine_versions"] and known["regimes"]["settle"]["safe_fraction"] >= 0.8


@pytest.mark.engine
@pytest.mark.slow
def test_points_that_were_run_are_not_run_again(coarse: Path) -> None:
    from dragdeck.campaigns.stability_map import map_runs

    before = {file: file.stat().st_mtime_ns for file in coarse.glob("impact/*/state.json")}
    study = coarse.parent.parent / "studies" / "stability" / "study.yaml"
    tests = DATA / "coarse_map.yaml"
    map_runs(study, coarse, ROOT / "templates", lambda line: None).run_points(tests, "impact")
    after = {file: file.stat().st_mtime_ns for file in coarse.glob("impact/*/state.json")}
    failed_too = any(json.loads(file.read_text())["state"] == "failed" for file in after)
    assert failed_too
    assert {f: t for f, t in after.items() if t != before[f]} == {}

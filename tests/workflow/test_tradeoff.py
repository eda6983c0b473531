"""A small trade through the workflow, on the real engine."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from pages import stands_alone
from snakemake_calls import copy_of_project, jobs, succeed

pytestmark = [pytest.mark.engine, pytest.mark.slow]

PLAN: dict[str, Any] = {
    "base": {
        "fidelity.youngs_modulus_scale": 1e-4,
        "fidelity.timestep_fraction": 0.5,
        "fidelity.skin_m": 1e-3,  # the default is now and then too thin for so soft particles
        "fidelity.ranks": 1,
    },
    "reference": {"vary": {"fidelity.youngs_modulus_scale": [1e-3]}},
    "seeds": 2,
    "cost_rounds": 0,
    "points": [{"vary": {"fidelity.timestep_fraction": [0.5, 1.9]}}],
    "drop_test": {"drop_test.timestep_fraction": [0.1]},
}
EVIDENCE = ("--snakefile", "evidence/Snakefile")
TRADEOFF = ("tradeoff", *EVIDENCE, "--config", "study=small", "plan=plan.yaml")


@pytest.fixture(scope="module")
def traded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which the plan was run on the small study."""
    folder = copy_of_project(tmp_path_factory.mktemp("tradeoff"))
    (folder / "plan.yaml").write_text(yaml.safe_dump(PLAN))
    succeed(folder, *TRADEOFF)
    return folder


def test_softer_particles_overlap_more(traded: Path) -> None:
    errors = pd.read_parquet(traded / "results/small/tradeoff/plan/errors.parquet")
    soft = (errors.youngs_modulus_scale == 1e-4) & (errors.timestep_fraction == 0.5)
    overlap = errors[soft & (errors.quantity == "workpiece_overlap")].iloc[0]
    hertz = 10 ** (2 / 3) - 1.0  # at the same force
    assert 0.0 < overlap.ci95_low < hertz < overlap.ci95_high
    assert overlap.significant and overlap.runs == 2
    assert overlap.relative_cost < 0.6  # a longer step by the root of ten


def test_a_point_that_fails_is_a_finding(traded: Path) -> None:
    runs = pd.read_parquet(traded / "results/small/tradeoff/plan/runs.parquet")
    failed = runs[runs.timestep_fraction == 1.9]
    assert len(failed) == 2 and not failed.complete.any()
    assert failed.failure.str.contains("energy and speed within limits").all()
    assert runs[runs.timestep_fraction == 0.5].complete.all()


def test_the_record_says_what_made_it(traded: Path) -> None:
    folder = traded / "results/small/tradeoff/plan"
    tradeoff = json.loads((folder / "tradeoff.json").read_text())
    assert tradeoff["commands"] == ["./run tradeoff --config study=small plan=plan.yaml"]
    assert tradeoff["runs"] == 6 and tradeoff["reference"]["youngs_modulus_scale"] == 1e-3
    assert tradeoff["scene"]["workpiece_to_particle"] == pytest.approx(0.008 / 0.00654, rel=0.01)
    assert len(tradeoff["drop_test"]) == 2
    page = (folder / "report.html").read_text()
    assert "<img" in page and "not significant" in page


def test_nothing_is_left_to_do_in_the_tradeoff(traded: Path) -> None:
    assert jobs(traded, *TRADEOFF) - {"tradeoff"} == set()


VALIDATION = ("validate", *EVIDENCE, "--config", "study=small", "plan=thick.yaml")
THICK = {"vary": {}, "one_by_one": {"workpiece.shape.radius_m": [0.008]}}


@pytest.fixture(scope="module")
def validated(traded: Path) -> Path:
    """The validation of the same points, and of a thicker workpiece."""
    plan = PLAN | {"points": [*PLAN["points"], THICK]}
    (traded / "thick.yaml").write_text(yaml.safe_dump(plan))
    succeed(traded, *VALIDATION)
    return traded / "results/small/validation"


@pytest.mark.long
def test_a_validation_shares_the_runs_of_a_tradeoff(validated: Path, traded: Path) -> None:
    packings = pd.read_parquet(validated / "packings.parquet")
    assert packings.seed.tolist() == [1, 2]
    assert (packings.drag_mean < 0.0).all()
    assert jobs(traded, *VALIDATION) - {"validate"} == set()
    assert jobs(traded, *TRADEOFF) - {"tradeoff"} == set()


@pytest.mark.long
def test_a_thicker_workpiece_meets_more_drag(validated: Path) -> None:
    effects = pd.read_parquet(validated / "effects.parquet")
    (row,) = effects[(effects.field != "") & (effects.quantity == "drag_mean")].to_dict("records")
    assert (row["field"], row["value"]) == ("workpiece.shape.radius_m", "0.008")
    assert row["reference_value"] == "0.004" and row["runs"] == 2
    assert row["change"] > 0.0


@pytest.mark.long
def test_the_page_of_a_validation_stands_alone(validated: Path) -> None:
    page = stands_alone((validated / "report.html").read_text())
    assert page.images

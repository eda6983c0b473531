"""Predictions of planted runs, verdicts, and a design that the product can run."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dragdeck.scenes.angles import AngleRun, angle_scene
from dragdeck.scenes.process import process_scene
from dragdeck.sweep.design import Design
from evidence.beds import Repeated, designed
from evidence.published.predict import DESIGN, LIFTED, RESULTS, compare, predictions, write_verdicts

PLATES = {"plate_flat": 400e3, "plate_upright": 160e3}
WORK = {1: 1.0, 3: 1.2, 5: 1.05, 11: 0.8}
"""By the gap of two bars."""

LIFTS = dict(zip(LIFTED, (1.0, 0.5, -0.2, 1.5), strict=True))
FRICTION_EXPONENT, DIAMETER_EXPONENT = 0.3, -0.1


def rows(result: str, noise: np.random.Generator, **columns: Any) -> list[dict[str, Any]]:
    """A run of each of three packings, with a scatter of 1 %."""
    value = columns.pop("value")
    return [
        {"result": result, "seed": seed, "value": value * noise.normal(1, 0.01), **columns}
        for seed in (1, 2, 3)
    ]


@pytest.fixture
def runs() -> pd.DataFrame:
    """Planted: a ratio of 2.5, lifts, a largest force at 40 degrees, reductions, exponents."""
    noise, made = np.random.default_rng(7), []
    for body, stress in PLATES.items():
        made += rows("plate", noise, body=body, value=stress)
    for body, lift in LIFTS.items():
        made += rows("lift", noise, body=body, value=lift)
    for gap, work in WORK.items():
        made += rows("bars", noise, body=f"pair_{gap:02d}", value=work)
    at = np.radians(40)
    second = -np.cos(2 * at) / (2 * np.cos(4 * at))  # where the derivative of the series vanishes
    for angle in (15, 25, 35, 50, 65):
        force = np.sin(2 * np.radians(angle)) + second * np.sin(4 * np.radians(angle))
        made += rows("angle", noise, body=f"bar_{angle}", value=-force)
    for friction, left in ((0.1, 0.8), (0.6, 0.5)):
        made += rows("spin", noise, friction=friction, spin_rpm=0.0, value=10.0, deeper=20.0)
        made += rows(
            "spin", noise, friction=friction, spin_rpm=382.0, value=10 * left, deeper=20 * left + 2
        )
    for friction, radius in ((0.35, 3e-3), (0.2, 3e-3), (0.6, 3e-3), (0.35, 2e-3)):
        steep = friction**FRICTION_EXPONENT * radius**DIAMETER_EXPONENT
        made += rows("repose", noise, friction=friction, radius_m=radius, value=steep)
    return pd.DataFrame(made)


@pytest.mark.parametrize(
    ("quantity", "planted"),
    [
        ("plate_ratio", 2.5),
        *((f"lift_{body}_n", lift) for body, lift in LIFTS.items()),
        ("work_of_two_bars", 3.0),
        ("work_rise_of_two_bars", 0.5),
        ("angle_of_largest_force_deg", 40.0),
        ("spin_reduction", 0.2),
        ("spin_friction_effect", 0.3),
        ("spin_depth_effect", 0.1),
        ("repose_friction_exponent", FRICTION_EXPONENT),
        ("repose_diameter_exponent", DIAMETER_EXPONENT),
    ],
)
def test_planted_values_are_predicted(runs: pd.DataFrame, quantity: str, planted: float) -> None:
    known = predictions(runs).set_index("quantity").loc[quantity]
    assert known.predicted == pytest.approx(planted, rel=0.05, abs=0.03)
    assert known.low <= known.predicted <= known.high


@pytest.mark.parametrize(
    ("kind", "published", "low", "high", "verdict"),
    [
        ("value", 2.7, 2.5, 2.9, "confirmed"),
        ("value", 2.7, 2.8, 2.9, "contradicted"),
        ("sign", -1, -2.0, -0.1, "confirmed"),
        ("sign", -1, -2.0, 0.1, "not confirmed"),
        ("sign", 1, -2.0, -0.1, "contradicted"),
    ],
)
def test_verdicts(kind: str, published: float, low: float, high: float, verdict: str) -> None:
    row = {"quantity": "a", "predicted": (low + high) / 2, "low": low, "high": high}
    known = pd.DataFrame([{"quantity": "a", "published": published, "kind": kind}])
    assert list(compare(pd.DataFrame([row]), known).verdict) == [verdict]


def test_a_result_has_the_verdicts_of_its_quantities(tmp_path: Path) -> None:
    files = {
        "runs": "result,cpu_time_s\nlift,90\nlift,30\n",
        "labels": "quantity,no,result,statement,label,short\nup,a,lift,Lift,up:,up\n"
        "down,a,lift,Lift,down:,down\ngap,b,bars,Gap,,\n",
        "predictions": "quantity,predicted,low,high\nup,1.0,0.5,1.5\ndown,0.1,-0.5,0.7\n",
        "published": "quantity,published,kind,said\nup,1,sign,up\n"
        "down,-1,sign,down\ngap,3,value,3\n",
    }
    for name, text in files.items():
        (tmp_path / f"{name}.csv").write_text(text)
    write_verdicts(tmp_path)
    lift, bars = pd.read_csv(tmp_path / "results.csv").to_dict("records")
    assert lift["verdict"] == "up: confirmed; down: not confirmed"
    assert lift["predicted"] == "up: 1 (0.5 to 1.5); down: 0.1 (-0.5 to 0.7)"
    assert lift["cpu_min"] == 2 and bars["verdict"] == "not run"


@pytest.mark.parametrize("result", RESULTS)
def test_the_product_can_run_the_design(result: str) -> None:
    cases = [case for _, case in designed(Design[Repeated], DESIGN, result)]
    for case in (case for case in cases if case.study.seed == 1):
        if result == "repose":
            run = AngleRun(rig="repose", friction=0.3, rolling_friction=0.1, seed=1)
            assert angle_scene(case, run).case.media.count
        else:
            assert process_scene(case).case.workpiece.immersion_depth_m > 0

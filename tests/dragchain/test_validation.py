"""A validation on runs whose forces are known."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dragchain.case import load_case
from dragchain.errors import SeriesError, TableError
from dragchain.validation import force, statements
from dragchain.validation.claims import FAILS, HOLDS, OPEN, Claim
from dragchain.validation.fills import Point, Points, over_fills

RATE_HZ = 1000.0
DIAMETER_M = 2 * 8.76e-3


def made_point(
    tiny_run: Path,
    folder: Path,
    seed: int,
    drag: np.ndarray[Any, Any],
    *,
    knobs: tuple[float, float] = (1.0, 0.64),
    changed: dict[str, Any] | None = None,
) -> Point:
    """A run of the tiny case with this drag."""
    (folder / "tables").mkdir(parents=True)
    table = pd.DataFrame({"time_s": np.arange(len(drag)) / RATE_HZ, "drag_n": drag})
    table["lateral_n"], table["vertical_n"] = 0.1 * drag, -0.2 * drag
    table["counted"] = True
    table.to_parquet(folder / "tables" / "rod_force.parquet")
    case = dataclasses.replace(
        load_case(tiny_run),
        run=folder.name,
        reference={
            "measured_drag_mean_n": -2.5,
            "measured_drag_sd_n": 0.5,
            "published_drag_mean_n": -2.0,
        },
    )
    measures = {
        "inputs": {"seed": seed, "bowl.radius_m": 0.04, **(changed or {})},
        "fidelity": {
            "youngs_modulus_scale": knobs[0], "timestep_fraction": knobs[1], "speed_factor": 1.0,
        },
        "bed": f"bed-{seed}-{knobs[0]}-{changed}",
        "single": {"fill_height": 0.07},
        "arc_m": 20 * DIAMETER_M,
        "cost": {"steps": 1000, "cpu_time_s": 60.0},
        "started": "2026-01-01T00:00:00+00:00",
        "complete": True,
    }  # fmt: skip
    return Point(folder, case, measures, changed or {})


def series(mean: float, rng: np.random.Generator, count: int = 4000) -> np.ndarray[Any, Any]:
    """An autocorrelated drag (first order, about 20 samples) of standard deviation 0.5."""
    noise = rng.normal(0.0, 0.5 * math.sqrt(1.0 - 0.95**2), count)
    found = np.empty(count)
    found[0] = rng.normal(0.0, 0.5)
    for step in range(1, count):
        found[step] = 0.95 * found[step - 1] + noise[step]
    return mean + found


@pytest.fixture
def points(tiny_run: Path, tmp_path: Path) -> Points:
    """Four fills, a control that is 10 % up, and soft runs with and without a wider bowl."""
    rng = np.random.default_rng(7)

    def run(name: str, seed: int, factor: float, **more: Any) -> Point:
        return made_point(tiny_run, tmp_path / name, seed, factor * series(-2.5, rng), **more)

    fills = [run(f"fill-{seed}", seed, 1.0) for seed in (1, 2, 3, 4)]
    soft: dict[str, Any] = {"knobs": (1e-3, 0.5)}
    others = [run("control", 1, 1.1, knobs=(1.0, 0.2))]
    for seed in (1, 2, 3):
        others.append(run(f"soft-{seed}", seed, 1.05, **soft))
        wider = {"bowl.radius_m": 0.08}
        others.append(run(f"wide-{seed}", seed, 1.05 * 0.5, **soft, changed=wider))
    return Points(fills, others)


def test_the_interval_over_fills_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    trials = 2000
    found = [over_fills(rng.normal(2.0, 0.3, 4).tolist()) for _ in range(trials)]
    covered = sum(one.low <= 2.0 <= one.high for one in found)
    low, high = stats.binom.interval(0.999, trials, 0.95)
    assert low <= covered <= high


def test_ratios_are_averaged_by_their_logarithms() -> None:
    found = over_fills([0.5, 2.0], ratio=True)
    assert found.value == pytest.approx(1.0)
    assert found.low * found.high == pytest.approx(1.0)


def test_one_fill_has_no_interval() -> None:
    with pytest.raises(SeriesError, match="needs 2 of them, not 1"):
        over_fills([1.0])


def test_the_mean_over_fills_is_that_of_the_drag(points: Points) -> None:
    found = force.of_fills(points)
    drag = found["together"]["drag_n"]
    assert drag["mean"]["low"] < -2.5 < drag["mean"]["high"]
    assert drag["mean"]["value"] == pytest.approx(-2.5, abs=0.15)  # 4 s.e. of 4 fills
    assert drag["sd"]["value"] == pytest.approx(0.5, rel=0.1)
    assert found["together"]["lateral_n"]["mean"]["value"] == pytest.approx(
        0.1 * drag["mean"]["value"]
    )
    assert found["alike"]["p_value"] > 0.01


def test_fills_that_differ_are_seen(tiny_run: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    fills = [
        made_point(tiny_run, tmp_path / f"far-{seed}", seed, series(-2.5 - seed, rng))
        for seed in (1, 2, 3)
    ]
    assert force.of_fills(Points(fills, []))["alike"]["p_value"] < 1e-6


def test_half_of_a_sine_of_variance_lies_at_its_wave(tiny_run: Path, tmp_path: Path) -> None:
    count = 4000
    path = np.linspace(0.0, 20.0, count, endpoint=False)  # ball diameters
    fills = [
        made_point(tiny_run, tmp_path / f"sine-{seed}", seed, np.sin(2 * np.pi * path / 2.0))
        for seed in (1, 2)
    ]
    found = force.spectrum(fills)
    assert found["half_wave"]["value"] == pytest.approx(2.0, rel=0.1)
    peak = int(np.argmax(found["density"]["mean"]))
    assert found["waves_per_diameter"][peak] == pytest.approx(0.5)


def test_the_comparison_has_the_sign_of_more_drag(points: Points) -> None:
    mean, sd = ({"value": v, "low": lo, "high": hi} for v, lo, hi in
                ((-2.75, -3.0, -2.5), (0.6, 0.5, 0.7)))  # fmt: skip
    measured, published = force.compare(mean, sd, points.fills[0].case)
    assert measured["difference"] == pytest.approx({"value": 0.1, "low": 0.0, "high": 0.2})
    assert measured["sd_ratio"] == pytest.approx({"value": 1.2, "low": 1.0, "high": 1.4})
    assert published["difference"]["value"] == pytest.approx(0.375)
    assert "sd_ratio" not in published


def test_effects_are_found_against_what_they_change(points: Points) -> None:
    table = force.effects(points)
    mean = table[table["quantity"] == "drag_mean"]
    control, soft, wide = (mean.iloc[i] for i in range(3))
    assert (control.timestep_fraction, control.field, control.runs) == (0.2, "", 1)
    assert control.low < 0.1 < control.high
    assert soft.low < 0.05 < soft.high and soft.runs == 3
    assert (wide.field, wide.value, wide.reference_value) == ("bowl.radius_m", 0.08, 0.04)
    assert wide.high < 0.0 and wide.low < -0.5 < wide.high
    assert wide.exponent_low < -1.0 < wide.exponent_high  # half the drag at twice the radius
    spread = table[table["quantity"] == "drag_sd"]
    assert (spread.low < spread.change).all() and (spread.change < spread.high).all()


def test_a_shorter_run_counts_less(points: Points) -> None:
    def half_width(arc_m: float) -> float:
        control, *others = points.others
        shorter = dataclasses.replace(control, measures={**control.measures, "arc_m": arc_m})
        row = force.effects(Points(points.fills, [shorter, *others])).iloc[0]
        return float(row.high - row.low)

    whole = points.fills[0].measures["arc_m"]
    assert half_width(whole / 4.0) > 1.4 * half_width(whole)


@pytest.mark.parametrize(
    ("low", "high", "verdict"), [(1.1, 1.5, HOLDS), (0.5, 0.9, FAILS), (0.9, 1.5, OPEN)]
)
def test_a_verdict_is_the_interval_against_no_effect(low: float, high: float, verdict: str) -> None:
    estimate = {"value": (low + high) / 2, "low": low, "high": high}
    assert Claim("it grows", "ratio", estimate, 1.0).verdict == verdict


def test_a_number_without_interval_is_not_resolved() -> None:
    assert (
        Claim("it grows", "ratio", {"value": 2.0, "low": None, "high": None}, 1.0).verdict == OPEN
    )


# --- statements --------------------------------------------------------------------------------


def with_contacts(points: Points, seed: int = 0) -> list[Point]:
    """Contacts on the tool: three ahead for one behind, force 1 N/m times the depth more."""
    rng = np.random.default_rng(seed)
    for point in points.fills:
        tool = point.case.tool
        assert tool is not None
        ahead = rng.uniform(-np.pi / 2, np.pi / 2, 3000)
        behind = rng.uniform(np.pi / 2, np.pi, 1000) * rng.choice([-1.0, 1.0], 1000)
        depth = rng.uniform(0.0, tool.submersion_m, 4000)
        table = pd.DataFrame(
            {
                "bearing_rad": np.concatenate([ahead, behind]),
                "depth_m": depth,
                "normal_force_n": 1.0 + depth,
                "counted": True,
            }
        )
        table.to_parquet(point.folder / "tables" / "rod_contacts.parquet")
    return points.fills


def test_contacts_around_the_tool(points: Points) -> None:
    rows = [statements._around_tool(point) for point in with_contacts(points)]
    assert [row["ratio"] for row in rows] == pytest.approx([3.0] * 4, rel=0.01)
    assert [row["slope"] for row in rows] == pytest.approx([1.0] * 4)
    assert sum(rows[0]["bearing"]["value"]) == pytest.approx(1.0)
    assert rows[0]["front_share"] == pytest.approx(0.375, abs=0.03)
    assert rows[0]["front_over_flank"] == pytest.approx(1.0, abs=0.1)


def test_silent_contacts_do_not_count(points: Points) -> None:
    (point, *_) = with_contacts(points)
    file = point.folder / "tables" / "rod_contacts.parquet"
    before = statements._around_tool(point)
    table = pd.read_parquet(file)
    silent = table.assign(normal_force_n=0.0, bearing_rad=0.0)
    pd.concat([table, silent]).to_parquet(file)
    assert statements._around_tool(point) == before


def test_the_corridor_is_along_the_motion(tmp_path: Path) -> None:
    contacts = pd.DataFrame(
        {
            "point_x_m": [0.0, 0.0, 0.03],
            "point_y_m": [0.03, -0.02, 0.0],
            "ref_x_m": 0.0,
            "ref_y_m": 0.02,
            "heading_rad": np.pi / 2,
        }
    )
    along, across, turned = statements._relative(contacts)
    assert along == pytest.approx([0.01, -0.04, -0.02])
    assert across == pytest.approx([0.0, 0.0, -0.03])
    assert np.abs(turned) == pytest.approx([0.0, np.pi, np.pi / 2])


def test_the_reach_lies_where_half_of_the_excess_is_left() -> None:
    corridor = statements._Corridor(
        edges=np.arange(0.0, 3.0, 0.5),
        ahead=np.array([3.0, 2.5, 1.5, 1.0, 1.0]),
        behind=np.ones(5),
        far=1.0,
        wall=2.5,
    )
    assert statements._half_reach(corridor) == pytest.approx(1.0)  # 2 N is half of the excess
    flat = dataclasses.replace(corridor, ahead=np.full(5, 3.0))
    assert statements._half_reach(flat) is None


def test_a_reference_that_is_not_measured_is_named(tmp_path: Path) -> None:
    from dragchain.validation.fills import read_points

    with pytest.raises(TableError, match=r"measures.json is not there"):
        read_points([tmp_path])

"""A validation on runs whose forces are known."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from changed import changed
from scipy import stats
from tradeoff_files import measures

from dragchain.quantities.document import RunQuantities
from dragchain.run.case import study_of
from dragchain.statistics.estimate import Estimate
from dragdeck.records.case import load_case
from dragdeck.study.reference import Drag, Reference
from evidence.validation import force
from evidence.validation.force import effect_table, setting_effects
from evidence.validation.runs import MeasuredRun, RunsByBed, packing_mean

RATE_HZ = 1000.0
DIAMETER_M = 2 * 8.76e-3
PUBLISHED = Reference(
    source="a paper",
    experiment=Drag(drag_mean_n=-2.5, drag_std_n=0.5),
    simulation=Drag(drag_mean_n=-2.0),
)


def made_run(
    tiny_run: Path,
    folder: Path,
    seed: int,
    drag: np.ndarray[Any, Any],
    *,
    parameters: tuple[float, float] = (1.0, 0.64),
    varied: dict[str, Any] | None = None,
) -> MeasuredRun:
    """A run of the tiny case with this drag."""
    (folder / "tables").mkdir(parents=True)
    table = pd.DataFrame({"time_s": np.arange(len(drag)) / RATE_HZ, "drag_n": drag})
    table["lateral_n"], table["vertical_n"] = 0.1 * drag, -0.2 * drag
    table["in_statistics"] = True
    table.to_parquet(folder / "tables" / "workpiece_force.parquet")
    case = load_case(tiny_run)
    case = changed(case, run=folder.name, study=changed(study_of(case), reference=PUBLISHED))
    study = {"bowl.radius_m": 0.04, **(varied or {})}
    content = measures((*parameters, 1.0), seed, np.random.default_rng(1), study=study)
    content |= {"run": folder.name, "arc_m": 20 * DIAMETER_M}
    return MeasuredRun(folder, case, RunQuantities.model_validate(content), varied or {})


def series(mean: float, rng: np.random.Generator, count: int = 4000) -> np.ndarray[Any, Any]:
    """An autocorrelated drag (first order, about 20 samples) of standard deviation 0.5."""
    noise = rng.normal(0.0, 0.5 * math.sqrt(1.0 - 0.95**2), count)
    found = np.empty(count)
    found[0] = rng.normal(0.0, 0.5)
    for step in range(1, count):
        found[step] = 0.95 * found[step - 1] + noise[step]
    return mean + found


@pytest.fixture
def runs(tiny_run: Path, tmp_path: Path) -> RunsByBed:
    """Four fills, a control that is 10 % up, and soft runs with and without a wider bowl."""
    rng = np.random.default_rng(7)

    def run(name: str, seed: int, factor: float, **more: Any) -> MeasuredRun:
        return made_run(tiny_run, tmp_path / name, seed, factor * series(-2.5, rng), **more)

    packings = [run(f"filling-{seed}", seed, 1.0) for seed in (1, 2, 3, 4)]
    soft: dict[str, Any] = {"parameters": (1e-3, 0.5)}
    others = [run("control", 1, 1.1, parameters=(1.0, 0.2))]
    for seed in (1, 2, 3):
        others.append(run(f"soft-{seed}", seed, 1.05, **soft))
        wider = {"bowl.radius_m": 0.08}
        others.append(run(f"wide-{seed}", seed, 1.05 * 0.5, **soft, varied=wider))
    return RunsByBed(packings, others)


def test_the_interval_over_packings_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    trials = 2000
    found = [packing_mean(rng.normal(2.0, 0.3, 4).tolist()) for _ in range(trials)]
    covered = sum(one.ci95_low <= 2.0 <= one.ci95_high for one in found)
    low, high = stats.binom.interval(0.999, trials, 0.95)
    assert low <= covered <= high


def test_ratios_are_averaged_by_their_logarithms() -> None:
    found = packing_mean([0.5, 2.0], ratio=True)
    assert found.value == pytest.approx(1.0)
    assert found.ci95_low * found.ci95_high == pytest.approx(1.0)


def test_the_mean_over_packings_is_that_of_the_drag(runs: RunsByBed) -> None:
    found = force.force_of_packings(runs.packings)
    drag, lateral = found.together["drag_n"], found.together["lateral_n"]
    assert drag.mean.contains(-2.5)
    assert drag.mean.value == pytest.approx(-2.5, abs=0.15)  # 4 s.e. of 4 packings
    assert drag.std.value == pytest.approx(0.5, rel=0.1)
    assert lateral.mean.value == pytest.approx(0.1 * drag.mean.value)
    assert found.alike.p_value > 0.01


def test_packings_that_differ_are_seen(tiny_run: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    packings = [
        made_run(tiny_run, tmp_path / f"far-{seed}", seed, series(-2.5 - seed, rng))
        for seed in (1, 2, 3)
    ]
    assert force.force_of_packings(packings).alike.p_value < 1e-6


def test_the_comparison_has_the_sign_of_more_drag(runs: RunsByBed) -> None:
    drag = force.Together(mean=Estimate(-2.75, -3.0, -2.5), std=Estimate(0.6, 0.5, 0.7))
    measured, published = force.compare_drag(drag, runs.packings[0].case)
    assert vars(measured.difference) == pytest.approx(vars(Estimate(0.1, 0.0, 0.2)))
    assert measured.std_ratio is not None and published.std_ratio is None
    assert vars(measured.std_ratio) == pytest.approx(vars(Estimate(1.2, 1.0, 1.4)))
    assert published.difference.value == pytest.approx(0.375)


def test_effects_are_found_against_what_they_change(runs: RunsByBed) -> None:
    table = effect_table(setting_effects(runs))
    mean = table[table["quantity"] == "drag_mean"]
    control, soft, wide = (mean.iloc[i] for i in range(3))
    assert (control.timestep_fraction, control.field, control.runs) == (0.2, "", 1)
    assert control.ci95_low < 0.1 < control.ci95_high
    assert soft.ci95_low < 0.05 < soft.ci95_high and soft.runs == 3
    assert (wide.field, wide.value, wide.reference_value) == ("bowl.radius_m", 0.08, 0.04)
    assert wide.ci95_high < 0.0 and wide.ci95_low < -0.5 < wide.ci95_high
    assert (
        wide.exponent_ci95_low < -1.0 < wide.exponent_ci95_high
    )  # half the drag at twice the radius
    spread = table[table["quantity"] == "drag_std"]
    assert (spread.ci95_low < spread.change).all() and (spread.change < spread.ci95_high).all()


def test_an_input_may_be_text(runs: RunsByBed, tmp_path: Path) -> None:
    *others, last = runs.others
    steel = dataclasses.replace(last, changed={"workpiece.material": "steel"})
    table = effect_table(setting_effects(RunsByBed(runs.packings, [*others, steel])))
    table.to_parquet(tmp_path / "effects.parquet")
    assert {"0.08", "steel"} <= set(table["value"])


def test_a_shorter_run_counts_less(runs: RunsByBed) -> None:
    def half_width(arc_m: float) -> float:
        control, *others = runs.others
        shorter = dataclasses.replace(control, measures=changed(control.measures, arc_m=arc_m))
        row = setting_effects(RunsByBed(runs.packings, [shorter, *others]))[0]
        return row.ci95_high - row.ci95_low

    whole = runs.packings[0].measures.arc_m
    assert half_width(whole / 4.0) > 1.4 * half_width(whole)

"""What a run is expected to take, and what the things that it leaves out would."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from made_tradeoff import cost as priced
from made_tradeoff import made_tradeoff

from dragdeck.cases.case import Case
from dragdeck.outlook.explain import expected_cost, explanation, measured_speeds, price_of
from dragdeck.scenes.bed_space import particles_step_s
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.process import PROCESS, process_scene


def measured(results: Path, name: str, particles: int, steps_per_s: float) -> None:
    folder = results / name
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps({"steps_per_s": steps_per_s}))
    (folder / "case.json").write_text(json.dumps({"media": {"count": particles}}))


def test_without_a_measured_run_the_speed_is_assumed(case: Case, tmp_path: Path) -> None:
    speeds = measured_speeds(tmp_path / "none")
    assert "assumed" in expected_cost(FILLING, filling_scene(case), speeds).source


def test_runs_with_as_many_particles_count_alone(case: Case, tmp_path: Path) -> None:
    scene = filling_scene(case)
    measured(tmp_path, "same", case.study.media.count, 500.0)
    measured(tmp_path, "big", 1000 * case.study.media.count, 2.0)
    cost = expected_cost(FILLING, scene, measured_speeds(tmp_path))
    assert cost.wall_time_s == pytest.approx(scene.steps / 500.0)
    assert cost.source.startswith("1 run(s)")


def test_other_runs_count_by_their_particles(case: Case, tmp_path: Path) -> None:
    scene = filling_scene(case)
    measured(tmp_path, "big", 10 * case.study.media.count, 50.0)
    cost = expected_cost(FILLING, scene, measured_speeds(tmp_path))
    assert cost.wall_time_s == pytest.approx(scene.steps / 500.0)


def test_particles_of_large_beds_cost_more_each() -> None:
    small, medium, large, huge = (
        particles_step_s(count, 7e6) / count for count in (1_000, 10_000, 100_000, 1_000_000)
    )
    assert small == pytest.approx(1 / 7e6) == medium
    assert large / medium == pytest.approx(huge / large) == pytest.approx(1.65, rel=0.01)


def test_a_price_is_quoted_with_engine_and_date() -> None:
    costs = [priced("bowl_facets", 1.9, ci95_low=1.85, ci95_high=1.951), priced("bowl_fine", 1.9)]
    tradeoff = made_tradeoff(costs=costs)
    said = "enabling it costs 1.9x (1.85 to 1.95), LIGGGHTS 3.8.0, 2026-01-02"
    assert price_of("bowl_facets", tradeoff) == said
    assert price_of("bowl_fine", tradeoff).startswith("enabling it costs 1.9x, LIGGGHTS")
    assert "not measured" in price_of("two_ranks", tradeoff)


@pytest.mark.parametrize(
    ("high", "unit", "scene", "shown"),
    [(0.95, "per_second", "process", True), (1.01, "per_second", "process", False),
     (None, "per_second", "process", False), (0.95, "per_step", "process", False),
     (0.95, "per_second", "filling", False)],
)  # fmt: skip
def test_explain_names_what_is_surely_cheaper(
    case: Case, high: float | None, unit: str, scene: str, shown: bool
) -> None:
    low = None if high is None else 0.85
    wide = priced("wide facets", 0.9, scene=scene, unit=unit, ci95_low=low, ci95_high=high)
    tradeoff = made_tradeoff(costs=[wide])
    table = explanation(process_scene(case), tradeoff)
    assert ("wide facets" in list(table.columns[1].cells)) == shown
    assert any("not measured" in str(cell) for cell in table.columns[2].cells)


def with_facets(case: Case, size_m: float) -> Case:
    shape = case.study.workpiece.shape.model_copy(
        update={"facet_size_m": size_m, "facet_length_m": size_m}
    )
    workpiece = case.study.workpiece.model_copy(update={"shape": shape})
    return replace(case, study=case.study.model_copy(update={"workpiece": workpiece}))


def test_facets_cost_time_and_too_many_are_warned_of(case: Case) -> None:
    """Far finer: the wall time grows, and the size that would do is near the old."""
    coarse, fine = (process_scene(with_facets(case, size)) for size in (1.5e-3, 2e-4))
    few, many = (expected_cost(PROCESS, one, []).wall_time_s for one in (coarse, fine))
    assert fine.facets > 10_000 and coarse.facets < 5000
    assert many > 10 * few
    codes = [{one.code for one in scene.warnings} for scene in (coarse, fine)]
    assert "facets" not in codes[0] and "facets" in codes[1]
    (text,) = [one.text for one in fine.warnings if one.code == "facets"]
    found = re.search(r"facet_size_m: (\S+) would do", text)
    assert found is not None
    would_do = process_scene(with_facets(case, float(found[1])))
    assert "facets" not in {one.code for one in would_do.warnings}

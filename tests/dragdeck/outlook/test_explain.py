"""What a run is expected to take."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dragdeck.cases.case import Case
from dragdeck.outlook.explain import expected_cost
from dragdeck.scenes.filling import FILLING, filling_scene


def measured(results: Path, name: str, particles: int, steps_per_s: float) -> None:
    folder = results / name
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps({"steps_per_s": steps_per_s}))
    (folder / "case.json").write_text(json.dumps({"media": {"count": particles}}))


def test_without_a_measured_run_the_speed_is_assumed(case: Case, tmp_path: Path) -> None:
    assert "assumed" in expected_cost(FILLING, filling_scene(case), tmp_path / "none").source


def test_runs_with_as_many_particles_count_alone(case: Case, tmp_path: Path) -> None:
    scene = filling_scene(case)
    measured(tmp_path, "same", case.study.media.count, 500.0)
    measured(tmp_path, "big", 1000 * case.study.media.count, 2.0)
    cost = expected_cost(FILLING, scene, tmp_path)
    assert cost.wall_time_s == pytest.approx(scene.steps / 500.0)
    assert cost.source.startswith("1 run(s)")


def test_other_runs_count_by_their_particles(case: Case, tmp_path: Path) -> None:
    scene = filling_scene(case)
    measured(tmp_path, "big", 10 * case.study.media.count, 50.0)
    cost = expected_cost(FILLING, scene, tmp_path)
    assert cost.wall_time_s == pytest.approx(scene.steps / 500.0)

"""Limits that a healthy run never meets, and what is said of a run that did."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dragdeck.cases import Case, load_cases
from dragdeck.errors import GateError
from dragdeck.limits import ENERGY_FACTOR, SPEED_FACTOR, breach, held, read_samples, run_limits
from dragdeck.project import Project
from dragdeck.render import environment, write_run
from dragdeck.runner import run
from dragdeck.scenes import Bed, fill_scene, process_scene

COLUMNS = ["step", "time_s", "balls", "kinetic_energy_j", "rotational_energy_j", "fastest_ball_m_s"]
LIMITS = run_limits(balls=10, mass_kg=1e-3, gravity_m_s2=10.0, height_m=0.5, speed_m_s=2.0)


def test_the_energy_limit_is_that_of_a_fall_and_a_push() -> None:
    """m g H + m v^2 / 2 = 5 mJ + 2 mJ."""
    assert LIMITS["mean_kinetic_energy_j"] == pytest.approx(ENERGY_FACTOR * 7e-3, rel=1e-12)


def test_the_speed_limit_is_that_of_the_same_energy() -> None:
    """Square root of 2 (g H + v^2 / 2) = sqrt(14) m/s."""
    assert LIMITS["speed_m_s"] == pytest.approx(SPEED_FACTOR * 14**0.5, rel=1e-12)


def samples(*rows: str) -> list[Any]:
    return read_samples(rows, COLUMNS)


def test_a_calm_run_meets_no_limit() -> None:
    assert breach(samples("10 0.1 10 0.2 0.07 1.0"), LIMITS) is None
    assert held(LIMITS).passed


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("20 0.2 10 0.2 0.09 1.0", "a mean kinetic energy of 0.029 J a ball at step 20"),
        ("20 0.2 10 0.2 0.01 15.0", "a ball at 15 m/s at step 20"),
        ("20 0.2 9 0.1 0.0 1.0", "9 balls at step 20"),
        ("20 0.2 10 nan 0.0 1.0", "a kinetic energy of nan at step 20"),
        ("20 0.2 10 inf 0.0 1.0", "a kinetic energy of inf at step 20"),
        ("20 0.2 0 0.0 0.0 1.0", "0 balls at step 20"),
    ],
)
def test_the_first_row_past_a_limit_is_named(row: str, said: str) -> None:
    gate = breach(samples("10 0.1 10 0.1 0.0 1.0", row, "30 0.3 1 9.0 9.0 1.0"), LIMITS)
    assert gate is not None and not gate.passed
    assert gate.seen == said


def test_rows_that_are_not_whole_yet_are_left_alone() -> None:
    assert samples("step time_s balls", "10 0.1 10 0.1", "20 0.2 10 0.1 0.0e", "") == []


def test_every_bed_has_limits_above_what_it_starts_with(case: Case) -> None:
    fill = fill_scene(case).case["limits"]
    process = process_scene(case, Bed(0.04, 0.045)).case["limits"]
    assert fill["balls"] == process["balls"] == case.study.media.count
    mass = 4 / 3 * 3.14159 * 3.27e-3**3 * 2656
    assert fill["mean_kinetic_energy_j"] > process["mean_kinetic_energy_j"] > mass * 9.81 * 0.1


@pytest.fixture
def unstable(small: dict[str, Any], write_study: Callable[..., Path], project: Project) -> Path:
    """A rendered fill with three times the Rayleigh time as its step."""
    (case,) = load_cases(write_study(small))
    folder = project.run_folder(case, "fill")
    scene = fill_scene(case)
    write_run(scene, folder, environment(project.templates))
    deck = folder / "in.liggghts"
    step = f"timestep {scene.deck.timestep_s!r}\n"
    assert step in deck.read_text()
    unstable = f"timestep {3 * scene.case['rayleigh_time_s']!r}\n"
    deck.write_text(deck.read_text().replace(step, unstable))
    return folder


def failed_gates(folder: Path) -> dict[str, str]:
    gates = json.loads((folder / "state.json").read_text())["gates"]
    return {gate["name"]: gate["seen"] for gate in gates if not gate["passed"]}


@pytest.mark.engine
def test_an_unstable_run_is_stopped_early_with_the_reason(unstable: Path) -> None:
    """The engine is told to ignore lost balls: it would go on for ten seconds of the process."""
    deck = unstable / "in.liggghts"
    assert "thermo_modify lost error" in deck.read_text()
    deck.write_text(deck.read_text().replace("lost error", "lost ignore"))
    with pytest.raises(GateError, match=r"within its limits: .* at step .*limit: "):
        run(unstable, lambda line: None)
    state = json.loads((unstable / "state.json").read_text())
    assert state["state"] == "failed"
    assert list(failed_gates(unstable)) == ["within its limits"]
    assert state["stopped_early"] is True
    assert not (unstable / "run.json").exists()


@pytest.mark.engine
def test_an_unstable_run_fails_fast_as_it_is_rendered(unstable: Path) -> None:
    """Whoever is first, the engine or the watcher: the run fails in its first steps."""
    with pytest.raises(GateError):
        run(unstable, lambda line: None)
    failed = failed_gates(unstable)
    assert "within its limits" in failed or "Lost atoms" in failed.get("no engine error", "")
    assert (json.loads((unstable / "state.json").read_text())["steps"] or 0) < 5000


@pytest.mark.engine
def test_a_healthy_run_says_that_it_met_no_limit(case: Case, project: Project) -> None:
    folder = project.run_folder(case, "fill")
    write_run(fill_scene(case), folder, environment(project.templates))
    gates = json.loads(run(folder, lambda line: None).read_text())["gates"]
    (gate,) = [gate for gate in gates if gate["name"] == "within its limits"]
    assert gate["passed"] is True

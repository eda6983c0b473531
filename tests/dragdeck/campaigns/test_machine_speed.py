"""The short run that tells how fast this machine is."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from made_tradeoff import cost, made_tradeoff

from dragdeck.advice.advise import step_cost
from dragdeck.campaigns.machine_speed import (
    DRAG_STEPS,
    last_loop,
    measure_machine_speed,
    short_case,
)
from dragdeck.cases.case import Case
from dragdeck.decks.templates import environment
from dragdeck.errors import EngineError
from dragdeck.project import Project
from dragdeck.records.advice import Speed
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.study.model import Fidelity

SPEED = Speed(
    filling_steps_per_s=1000.0,
    drag_steps_per_s=600.0,
    particles=300,
    ranks=1,
    engine_version="3.8.0",
)
STIFF = Fidelity(youngs_modulus_scale=0.1, timestep_fraction=0.4, speed_factor=2.0, ranks=1)


@pytest.fixture
def stiff(case: Case) -> Case:
    return replace(case, study=case.study.model_copy(update={"fidelity": STIFF}))


def drag_way_m(case: Case) -> float:
    """Way of the workpiece in one step of the drag."""
    scene = process_scene(case)
    return scene.deck.legs[-1].speed_m_s * scene.deck.timestep_s  # type: ignore[attr-defined]


def test_a_step_of_the_short_run_is_like_one_of_the_real_run(stiff: Case) -> None:
    short = short_case(stiff)
    rounded = 0.5 / DRAG_STEPS  # each drag takes a whole number of steps
    assert drag_way_m(short) == pytest.approx(drag_way_m(stiff), rel=rounded)
    real, quick = (process_scene(case).deck.outputs for case in (stiff, short))
    for ours, theirs in zip(quick, real, strict=True):
        assert ours.name == theirs.name and ours.period_steps <= theirs.period_steps
    force = {output.name: output.period_steps for output in quick}["workpiece_force"]
    assert force == {output.name: output.period_steps for output in real}["workpiece_force"]


def test_the_short_run_is_short(stiff: Case) -> None:
    legs = process_scene(short_case(stiff)).deck.legs  # type: ignore[attr-defined]
    drag = legs[-1].end_step - legs[-1].start_step
    assert DRAG_STEPS <= drag <= DRAG_STEPS + 1000
    assert legs[-1].end_step < 3 * DRAG_STEPS < process_scene(stiff).steps
    assert filling_scene(short_case(stiff)).steps < filling_scene(stiff).steps


def test_steps_per_second_are_those_of_the_last_run_command() -> None:
    text = (
        "Loop time of 4 on 1 procs for 100 steps with 300 atoms\n"
        "Loop time of 2.5 on 2 procs for 500 steps with 300 atoms\n"
    )
    assert last_loop(text) == 200.0
    with pytest.raises(EngineError, match="no duration"):
        last_loop("ERROR\n")


def test_twice_the_particles_take_twice_the_time() -> None:
    found = SPEED.of(600)
    assert (found.filling_steps_per_s, found.drag_steps_per_s, found.particles) == (
        500.0,
        300.0,
        600,
    )


@pytest.mark.engine
def test_the_speed_is_that_of_the_engine(case: Case, project: Project, tmp_path: Path) -> None:
    templates = environment(project.templates)
    found = measure_machine_speed(case, tmp_path / "short", templates, lambda line: None)
    assert found.ranks == 1 and found.particles == 300
    (process,) = (tmp_path / "short" / "process").iterdir()
    record = json.loads((process / "run.json").read_text())
    # the drag is the slowest leg: the workpiece is in contact all the way
    assert 0 < found.drag_steps_per_s < 3 * record["steps_per_s"]
    assert math.isfinite(found.filling_steps_per_s) and found.filling_steps_per_s > 0


def test_steps_of_softer_particles_cost_what_was_timed() -> None:
    modulus = "youngs_modulus_scale"
    costs = [
        cost("stiff", parameter=modulus, level=1.0, per_step=0.8),
        cost("soft", parameter=modulus, level=1e-4, per_step=1.6),
        cost("fast", parameter="speed_factor", level=5.0, per_step=3.0),
        cost("plain", per_step=9.0),
    ]
    tradeoff = made_tradeoff(costs=costs)
    assert step_cost(1.0, tradeoff) == pytest.approx(0.8)
    assert step_cost(1e-6, tradeoff) == pytest.approx(1.6)
    assert step_cost(0.01, tradeoff) == pytest.approx((0.8 * 1.6) ** 0.5)
    assert step_cost(0.01, made_tradeoff()) == 1.0

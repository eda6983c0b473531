"""What the runs of a study are expected to take, and how their lines are made."""

from dataclasses import replace
from pathlib import Path

import pytest

from dragdeck.cases.case import Case
from dragdeck.engine.space import expected_bytes
from dragdeck.engine.status import RunStatus
from dragdeck.outlook.explain import Cost
from dragdeck.outlook.runs import (
    StudyRun,
    alike_but_for_seed,
    by_their_speeds,
    done_fraction,
    expected_runs,
    plan_in_words,
    time_left,
)
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS


def a_run(
    name: str, wall_s: float, status: RunStatus | None = None, ranks: int = 1, after: str = ""
) -> StudyRun:
    cost = Cost(1000, wall_s, "assumed: nothing measured")
    filling = Path("filling", after) if after else None
    scene = "process" if after else "filling"
    return StudyRun(
        scene, Path(scene, name), filling, ranks, cost, 1e6, status or RunStatus("waiting")
    )


def test_runs_share_the_cores_and_wait_for_their_filling() -> None:
    filling = a_run("f", 10.0)
    drags = [a_run(name, 30.0, after="f") for name in ("a", "b", "c", "d")]
    assert time_left([filling, drags[0]], 8) == 40.0
    assert time_left([filling, *drags], 2) == 65.0
    assert time_left([filling, a_run("a", 30.0, ranks=8, after="f")], 4) == 40.0
    done = replace(filling, status=RunStatus("complete", final=True))
    assert time_left([done, drags[0]], 8) == 30.0
    assert time_left([], 2) == 0.0


def test_a_running_run_needs_what_its_own_speed_says() -> None:
    run = a_run("a", 30.0, RunStatus("running", step=400, last=2000, steps_per_s=100.0), after="f")
    assert run.left_s == 16.0
    assert run.fraction == 0.2
    assert str(run) == "process a: running, 20 %, 100 steps/s, about 16 s left"
    assert run.basis == "measured"


@pytest.mark.parametrize(
    ("speed", "ranks", "said"),
    [
        (1.0, 2, "15 times slower than estimated: other processes may occupy the cores; MPI ranks"),
        (1.0, 1, "15 times slower than estimated: other processes may occupy the cores"),
        (3.8, 2, ""),  # four times slower at 3.75 steps/s
        (None, 2, ""),
    ],
)
def test_a_run_far_slower_than_estimated_is_told(
    speed: float | None, ranks: int, said: str
) -> None:
    status = RunStatus("running", step=40, last=1000, steps_per_s=speed)
    run = a_run("a", 1000 / 15, status, ranks, after="f")
    assert run.slow.startswith(said) and bool(run.slow) == bool(said)
    assert ("fewer fidelity.ranks" in run.slow) == (ranks > 1 and bool(said))
    assert str(run).endswith(f"\n  {run.slow}") == bool(said)
    ending = replace(status, step=950)
    assert replace(run, status=ending).slow == ""  # soon over
    assert replace(run, status=replace(status, state="interrupted")).slow == ""


def test_where_a_filling_ends_is_an_estimate() -> None:
    status = RunStatus("running", step=250, steps_per_s=50.0, energy=3e-4, at_rest=1e-5)
    run = a_run("a", 30.0, status)
    assert run.cells == (*("~25 %", "50 steps/s, energy 3.0e-04 > 1e-05", "about 15 s left"),)
    late = replace(run, status=replace(status, step=1200))
    assert late.fraction < 1
    assert late.cells[2] == "longer than expected"


def test_nothing_is_said_of_what_is_not_expected() -> None:
    nothing = Cost(0, 0.0, "assumed")
    status = RunStatus("running", step=40, steps_per_s=20.0)
    run = replace(a_run("a", 1.0, status), cost=nothing)
    assert str(run) == "filling a: running, 20 steps/s"
    complete = replace(run, status=RunStatus("complete", step=40, final=True, steps_per_s=20.0))
    assert by_their_speeds([run, complete]) == [run, complete]
    assert time_left([run, complete], 2) == 0.0


def test_a_failed_run_takes_no_time_and_is_not_done() -> None:
    failed = a_run("a", 30.0, RunStatus("failed", step=100, final=True))
    assert failed.left_s == 0.0
    assert failed.fraction == 0.1


def test_waiting_runs_take_the_measured_speed_of_their_scene() -> None:
    fast = a_run("a", 10.0, RunStatus("running", step=100, last=1000, steps_per_s=10.0), after="f")
    runs = by_their_speeds([fast, a_run("b", 20.0, after="f"), a_run("f", 5.0)])
    assert runs[1].cost.wall_time_s == pytest.approx(200.0)
    assert runs[1].cost.basis == "measured"
    assert runs[2].cost.wall_time_s == 5.0


def test_what_is_done_counts_by_its_expected_time() -> None:
    complete = a_run("a", 30.0, RunStatus("complete", step=1000, final=True))
    assert done_fraction([complete, a_run("b", 10.0)]) == 0.75
    assert done_fraction([]) == 1.0


def test_the_plan_counts_what_is_left() -> None:
    complete = a_run("a", 30.0, RunStatus("complete", final=True), after="f")
    lines = plan_in_words([a_run("f", 10.0), complete, a_run("b", 30.0, after="f")], 1)
    assert lines == [
        "2 runs, about 40 s on 1 core, 2 MB (estimates; speed assumed)",
        "filling: 1 run, about 10 s, 1 MB",
        "process: 1 run, about 30 s, 1 MB",
        "1 already ended: repeated only if the input script has changed",
    ]


def test_disk_and_time_are_those_of_the_other_estimates(case: Case, project: Project) -> None:
    (run,) = expected_runs(PROCESS, project.run_folders([case], PROCESS))
    scene = PROCESS.build(case, None)
    outputs = {output.name: output.as_part() for output in scene.deck.outputs}
    assert run.size_bytes == expected_bytes(outputs, case.study.media.count)
    assert run.cost.steps == scene.steps
    assert run.after == project.run_folder(case, FILLING)


def test_runs_that_differ_in_the_seed_are_built_once(case: Case) -> None:
    other = replace(case, study=case.study.model_copy(update={"seed": 7}))
    deeper = case.study.motion.model_copy(update={"immersion_depth_m": 0.01})
    third = replace(case, study=case.study.model_copy(update={"motion": deeper}))
    groups = alike_but_for_seed({Path("a"): case, Path("b"): other, Path("c"): third})
    assert [list(group) for group in groups] == [[Path("a"), Path("b")], [Path("c")]]

"""Kill -9 in every phase: the same call goes on, and gives the same tables."""

import random
from functools import partial
from pathlib import Path

import pytest
from attack.calls import Call, is_engine, kill
from attack.ground import SEED, Undisturbed
from attack.judge import ENDS_WITHIN_S, ENGINE_PHASES, MOST_TRIES, PHASES, assert_no_engine, finish

pytestmark = [pytest.mark.engine, pytest.mark.slow]

VICTIMS = ("runner", "engine", "everything")
Kill = tuple[str, str, float, bool]


def kills() -> dict[str, Kill]:
    """Kills at seeded random times: a fraction of the processor time that a phase takes."""
    chance = random.Random(f"kills {SEED}")
    made = {}
    for phase in PHASES:
        for number in range(15 if phase in ENGINE_PHASES else 5):
            victim = VICTIMS[number % 3] if phase in ENGINE_PHASES else "runner"
            fraction, at_once = round(chance.uniform(0.05, 0.95), 3), bool(number // 3 % 2)
            again = "called again at once" if at_once else "called again"
            name = f"{phase}: {victim} killed at {fraction:.1%} of its time, {again}"
            made[name] = (phase, victim, fraction, at_once)
    return made


_KILLS = kills()


@pytest.mark.attack(sample=1)
@pytest.mark.parametrize(("name", "victim", "fraction", "at_once"), _KILLS.values(), ids=_KILLS)
def test_a_kill_costs_nothing_but_time(
    name: str, victim: str, fraction: float, at_once: bool, study: Undisturbed, tmp_path: Path
) -> None:
    phase = study.phases[name]
    for number in range(MOST_TRIES):
        project = study.copy_before(phase, tmp_path / f"project-{number}")
        running = Call(phase.words, project, tmp_path / "first.log")
        moment = fraction * 0.8**number * phase.cpu_s
        if running.wait_until(partial(_is_due, running, moment, victim)):
            break
        running.wait()  # it was quicker than it was undisturbed: earlier, then
    else:
        pytest.fail("not killed in time")
    tree = running.tree()
    hit = {"runner": tree[:1], "engine": [each for each in tree if is_engine(each)]}
    kill(hit.get(victim, tree))
    first = running.wait()
    if not at_once:
        assert_no_engine(project, ENDS_WITHIN_S)
    finish(study, phase, project, said_before=first.tail)


def _is_due(running: Call, moment_s: float, victim: str) -> bool:
    if running.spent_s() < moment_s:
        return False
    return victim != "engine" or any(is_engine(each) for each in running.tree())

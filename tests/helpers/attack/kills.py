"""Kills at random times in every phase, then the same call again."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from attack.calls import Call, engines, gone_within, is_engine, kill, main_of
from attack.case import Attack, Got
from attack.ground import CleanRuns, Ground, Phase, differences, resumed_at

SAME = "same tables"
ENGINE_PHASES = ("drop test", "filling", "process")
OTHER_PHASES = ("tables", "chains", "loading", "figures", "report")
PHASES = (*ENGINE_PHASES, *OTHER_PHASES)

ENDS_WITHIN_S = 5.0
"""An engine whose runner was killed is gone after this time, s."""

VICTIMS = ("runner", "engine", "everything")
MOST_TRIES = 4


@dataclass(frozen=True)
class Arena:
    """What an attack on the finished study works with."""

    folder: Path
    ground: Ground
    clean: CleanRuns


def kill_attacks(seed: int, per_engine_phase: int = 15, per_phase: int = 5) -> Iterator[Attack]:
    """Kills at seeded random times: a fraction of the processor time that a phase takes."""
    chance = random.Random(f"kills {seed}")
    for phase in PHASES:
        count = per_engine_phase if phase in ENGINE_PHASES else per_phase
        for number in range(count):
            victim = VICTIMS[number % 3] if phase in ENGINE_PHASES else "runner"
            fraction, at_once = round(chance.uniform(0.05, 0.95), 3), bool(number // 3 % 2)
            again = "called again at once" if at_once else "called again"
            name = f"{phase}: {victim} killed at {fraction:.1%} of its time, {again}"
            act = partial(_kill, phase, victim, fraction, at_once)
            yield Attack("kill", name, act, (SAME,), 12.0 if phase in ENGINE_PHASES else 5.0)


def _kill(phase_name: str, victim: str, fraction: float, at_once: bool, arena: Arena) -> Got:
    phase = arena.ground.phases[phase_name]
    for number in range(MOST_TRIES):
        project = arena.ground.copy_before(phase, arena.folder / f"project-{number}")
        running = Call(phase.words, project, arena.folder / "first.log")
        moment = fraction * 0.8**number * phase.cpu_s
        if running.wait_until(partial(_is_due, running, moment, victim)):
            return _after_kill(arena, phase, project, running, victim, at_once)
        running.wait()  # it was quicker than it was undisturbed: earlier, then
    return Got("not killed in time")


def _is_due(running: Call, moment_s: float, victim: str) -> bool:
    if running.spent_s() < moment_s:
        return False
    return victim != "engine" or any(is_engine(each) for each in running.tree())


def _after_kill(
    arena: Arena, phase: Phase, project: Path, running: Call, victim: str, at_once: bool
) -> Got:
    tree = running.tree()
    hit = {"runner": tree[:1], "engine": [each for each in tree if is_engine(each)]}
    kill(hit.get(victim, tree))
    first = running.wait()
    if not at_once and not gone_within(project, ENDS_WITHIN_S):
        kill(engines(project))
        return Got(f"engine still runs {ENDS_WITHIN_S:.0f} s after its runner was killed")
    return finish(arena, phase, project, said_before=first.tail)


def finish(arena: Arena, phase: Phase, project: Path, said_before: str = "") -> Got:
    """The same call again, and whether it gives the tables that nobody disturbed."""
    running = Call(phase.words, project, arena.folder / "again.log")
    before: set[int] = set()

    def doubled() -> bool:
        """Two of them at two looks: one look takes longer than an engine takes to follow."""
        nonlocal before
        found = {engine.pid for engine in engines(project)}
        both, before = found & before, found
        return len(both) > 1

    if phase.engine and running.wait_until(doubled, poll_s=0.1):
        kill([*running.tree(), *engines(project)])
        running.wait()
        return Got("two engines in one folder", said_before)
    again = running.wait()
    if again.has_traceback:
        return Got("traceback", again.tail)
    if again.status != 0:
        outcome = "no answer" if again.status is None else "refused after the kill"
        return Got(outcome, f"{said_before}\nthen:\n{again.tail}")
    if phase.engine and not gone_within(project, 1.0):
        kill(engines(project))
        return Got("an engine is left over", again.tail)
    return same_tables(arena, phase, project)


def same_tables(arena: Arena, phase: Phase, project: Path) -> Got:
    """Whether a phase has made what it makes undisturbed, to the last bit of every column."""
    wanted = arena.ground.root / phase.run
    steps: list[int] = []
    if phase.engine:
        made = main_of("dragchain", ["tables", phase.run], project)
        if made.status != 0:
            return Got("complete, but tables refuse", made.tail)
        steps = resumed_at(project / phase.run)
        found = project / phase.run / "tables"
        wanted = arena.clean.tables(Path(phase.run).parent.name, steps)
    else:
        found = project / phase.run
        wanted = _only_so_far(wanted, phase, arena)
    problems = differences(found, wanted) + _missing(project, phase, arena.ground)
    seen = f"resumed at {steps}\n" + "\n".join(problems)
    return Got("other tables", seen) if problems else Got(SAME, seen)


def _only_so_far(wanted: Path, phase: Phase, arena: Arena) -> Path:
    """The undisturbed folder with the files that there are after a phase."""
    order = list(arena.ground.phases.values())
    place = [each.name for each in order].index(phase.name)
    if place + 1 == len(order):
        return wanted
    later = order[place + 1]
    folder = arena.folder / "wanted"
    return arena.ground.copy_before(later, folder) / phase.run


def _missing(project: Path, phase: Phase, ground: Ground) -> list[str]:
    """Figures and pages that were not made, or are cut."""
    if phase.name not in ("figures", "report", "loading"):
        return []
    made = [*(ground.root / phase.run).rglob("*.png"), *(ground.root / phase.run).rglob("*.html")]
    if phase.name == "loading":
        made = [file for file in made if file.stem == "workpiece"]
    if phase.name == "figures":
        made = [file for file in made if file.stem != "workpiece"]
    problems = []
    for file in made:
        other = project / file.relative_to(ground.root)
        if not other.is_file():
            problems.append(f"{file.name} is missing")
        elif other.stat().st_size < 0.9 * file.stat().st_size:
            problems.append(f"{file.name} is truncated")
    return problems

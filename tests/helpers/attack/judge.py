"""How the end of an attack on the finished study is judged."""

from pathlib import Path

import pytest

from attack.calls import LARGEST_FILE, Call, Said, engines, gone_within, kill, main_of
from attack.ground import Phase, Undisturbed, differences, resumed_at

ENGINE_PHASES = ("drop test", "filling", "process")
PHASES = (*ENGINE_PHASES, "tables", "chains", "loading", "quantities", "figures", "report")

ENDS_WITHIN_S = 5.0
"""An engine whose runner was killed is gone after this time, s."""

MOST_TRIES = 4


def again(phase: Phase, project: Path) -> Said:
    """Make the same call again: it answers, and one engine at most runs, and to its end."""
    running = Call(phase.words, project, project.with_suffix(".again.log"))
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
        pytest.fail("two engines in one folder")
    said = running.wait()
    assert not said.has_traceback, said.tail
    assert said.status is not None, f"no answer: {said.tail}"
    assert_no_engine(project, 1.0)
    assert_bounded(project)
    return said


def finish(study: Undisturbed, phase: Phase, project: Path, said_before: str = "") -> None:
    """The same call again gives the tables that nobody disturbed."""
    said = again(phase, project)
    assert said.status == 0, f"refused: {said_before}\nthen: {said.tail}"
    assert_same_tables(study, phase, project)


def assert_same_tables(study: Undisturbed, phase: Phase, project: Path) -> None:
    """A phase has made what it makes undisturbed, to the last bit of every column."""
    run, steps = project / phase.run, []
    if phase.engine:
        made = main_of("dragchain", ["tables", phase.run], project)
        assert made.status == 0, f"complete, but tables refuse: {made.tail}"
        steps = resumed_at(run)
        problems = differences(run / "tables", study.tables(run.parent.name, steps))
    else:
        there = f"{phase.run}/"
        files = study.after(phase)
        names = [name.removeprefix(there) for name in files if name.startswith(there)]
        problems = differences(run, study.root / phase.run, names)
        for name in sorted(set(files) - set(phase.before)):
            if name.endswith((".png", ".html")) and _size(project / name) < 0.9 * _size(
                study.root / name
            ):
                problems.append(f"{name} is missing or cut")
    assert not problems, f"resumed at {steps}: {problems}"


def _size(file: Path) -> int:
    return file.stat().st_size if file.is_file() else 0


def assert_no_engine(project: Path, within_s: float) -> None:
    """No engine of a project goes on for more than some seconds of processor time."""
    left = not gone_within(project, within_s)
    kill(engines(project))
    assert not left, "an engine is left over"


def assert_bounded(project: Path) -> None:
    """Nothing wrote without end until the limit of a file's size."""
    files = [file for file in project.rglob("*") if file.is_file()]
    endless = [file.name for file in files if file.stat().st_size >= 0.9 * LARGEST_FILE]
    assert not endless, f"endless output: {endless}"

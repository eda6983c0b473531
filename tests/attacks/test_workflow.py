"""Attacks on the whole: ./run killed, called twice or wrongly, on disks that cannot be written."""

import json
import os
import random
import re
import signal
import stat
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from attack.calls import Call, Said, call, kill, main_of, refused
from attack.ground import (
    PLACES,
    SEED,
    STUDY,
    Undisturbed,
    differences,
    new_project,
    resumed_at,
    tiny_study,
    write_study,
)
from attack.judge import ENDS_WITHIN_S, assert_no_engine
from entry import write_entry
from preloaded import PACKAGES

pytestmark = [pytest.mark.engine, pytest.mark.slow]

_PATIENCE_S = 600.0
_TOOLS = {
    "python": "{python}",
    "snakemake": "{python} -m snakemake",
    "dragdeck": "{python} -m dragdeck.cli",
    "dragchain": "{python} -m dragchain.cli",
}


def entry(folder: Path) -> Path:
    """A project with the script ``run`` and an environment that it takes for its own."""
    project = new_project(folder, whole=True)
    programs = write_entry(project)
    for name, words in _TOOLS.items():
        command = words.format(python=sys.executable)
        (programs / name).write_text(f'#!/bin/sh\nPYTHONPATH="{PACKAGES}" exec {command} "$@"\n')
        (programs / name).chmod(0o755)
    write_study(project, tiny_study())
    return project


def words_of(project: Path, target: str = "all", *options: str) -> list[str]:
    """``./run``, with the tiny study."""
    return [str(project / "run"), target, "--config", f"study={STUDY}", *options]


def whole(project: Path, log: Path, target: str = "all") -> Said:
    """What ``./run`` says in the end."""
    return call(words_of(project, target), project, log, _PATIENCE_S)


# --- kills of the whole ---------------------------------------------------------------


def kills(number: int = 6) -> dict[str, tuple[str, float]]:
    """SIGKILL to Snakemake's process group, or to all that it started, at seeded times."""
    chance = random.Random(f"workflow {SEED}")
    made = {}
    for place in range(number):
        fraction = round((place + chance.random()) / number, 3)
        victim = ("group", "everything")[place % 2]
        made[f"./run all: {victim} killed at {fraction:.1%} of its time"] = victim, fraction
    return made


_KILLS = kills()


@pytest.mark.attack(sample=0)
@pytest.mark.parametrize(("victim", "fraction"), _KILLS.values(), ids=_KILLS)
def test_a_killed_workflow_goes_on(
    victim: str, fraction: float, study: Undisturbed, tmp_path: Path
) -> None:
    project = entry(tmp_path / "project")
    running = Call(words_of(project), project, tmp_path / "first.log")
    moment = 2.0 + fraction * 1.1 * sum(phase.cpu_s for phase in study.phases.values())
    assert running.wait_until(lambda: running.spent_s() > moment), "not killed in time"
    tree = running.tree()
    if victim == "group":
        os.killpg(running.process.pid, signal.SIGKILL)
    else:
        kill(tree)
    running.wait()
    assert_no_engine(project, ENDS_WITHIN_S)
    said = whole(project, tmp_path / "again.log")
    assert said.status == 0, said.tail
    problems = _unlike_undisturbed(study, project)
    report = project / "results" / STUDY / "report"
    for name in ("summary.csv", "summary.parquet", "report.html"):
        assert (report / name).is_file(), f"{name} is missing"
    assert not problems, problems


_OF_NETWORK = r"(chains|network|clusters|facets|contact_events|loading|quantities|figures)"


def _unlike_undisturbed(study: Undisturbed, project: Path) -> list[str]:
    """The runs' own tables against what their inputs give when nobody disturbs the engine.

    A filling that was resumed is another bed, from which another process follows: see the kills of
    single runs for that.
    """
    problems = []
    for place in PLACES:
        (run,) = (project / "results" / STUDY / place).iterdir()
        steps = resumed_at(run)
        found = differences(run / "tables", study.tables(place, steps))
        problems += [
            f"{place} resumed at {steps}: {problem}"
            for problem in found
            if not re.match(_OF_NETWORK, problem)
        ]
        if place == "filling" and steps:
            break
    return problems


# --- other attacks ---------------------------------------------------------------------


def _of_another_user(study: Undisturbed, tmp_path: Path) -> None:
    """Results that may be read but not written."""
    project = study.copy(tmp_path / "project")
    _open_way(project)
    said = main_of("dragchain", ["tables", study.run("process")], project, user=_NOBODY)
    assert refused(said, "permission|write"), said.tail


def _unreadable(study: Undisturbed, tmp_path: Path) -> None:
    """A study that may not be read."""
    project = new_project(tmp_path / "project")
    file = write_study(project, tiny_study())
    _open_way(project)
    file.chmod(0)
    said = main_of("dragdeck", ["check", STUDY], project, user=_NOBODY)
    assert refused(said, r"study\.yaml"), said.tail


_NOBODY = 65534


def _open_way(project: Path) -> None:
    """Let others come to a folder and look at it."""
    for folder in [project, *project.parents]:
        if folder.stat().st_uid == os.geteuid() and folder != Path("/"):
            folder.chmod(folder.stat().st_mode | stat.S_IXOTH | stat.S_IROTH | stat.S_IXGRP)


def _emptied_state(study: Undisturbed, tmp_path: Path) -> None:
    """What Snakemake keeps of a study is lost or damaged: nothing is run again for nothing."""
    project = entry(tmp_path / "project")
    first = whole(project, tmp_path / "first.log", "drop_test")
    assert first.status == 0, first.tail
    for file in (project / ".snakemake").rglob("*"):
        if file.is_file():
            os.truncate(file, 0)
    said = whole(project, tmp_path / "again.log", "drop_test")
    assert said.status == 0, said.tail
    assert not said.has_traceback, said.tail
    (run,) = (project / "results" / STUDY / "drop_test").iterdir()
    assert len(json.loads((run / "run.json").read_text())["parts"]) == 1, "it runs again"


_PLACES = {
    "results of another user": _of_another_user,
    "a study that may not be read": _unreadable,
    "what Snakemake keeps is emptied": _emptied_state,
}


@pytest.mark.attack(sample=0)
@pytest.mark.parametrize("attack", _PLACES.values(), ids=_PLACES)
def test_the_workflow_goes_on_or_says_why(
    attack: Callable[[Undisturbed, Path], None], study: Undisturbed, tmp_path: Path
) -> None:
    if attack in (_of_another_user, _unreadable) and os.geteuid() != 0:
        pytest.skip("only root can be another user")
    attack(study, tmp_path)

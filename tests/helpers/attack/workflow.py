"""Attacks on ./run: killed, called twice or wrongly, on disks that cannot be written."""

import json
import os
import random
import re
import shutil
import signal
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pandas as pd
from paths import ROOT

from attack.calls import (
    REFUSED,
    UNNAMED,
    Call,
    call,
    engines,
    gone_within,
    judged,
    kill,
    main_of,
)
from attack.case import Attack, Got
from attack.disks import NO_ROOT, small_disk
from attack.ground import (
    PLACES,
    STUDY,
    CleanRuns,
    Ground,
    differences,
    files_of,
    new_project,
    resumed_at,
    tiny_study,
    write_study,
)
from attack.kills import ENDS_WITHIN_S, SAME, Arena

WHOLE_S = 90.0
"""About how long ``./run all`` takes, s."""

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
    for name in ("run", "pyproject.toml", "constraints.txt"):
        shutil.copy2(ROOT / name, project / name)
    (project / ".venv/bin").mkdir(parents=True)
    paths = os.pathsep.join([str(ROOT / "workflow"), str(ROOT / "analysis"), str(ROOT)])
    for name, words in _TOOLS.items():
        tool = project / ".venv/bin" / name
        command = words.format(python=sys.executable)
        tool.write_text(f'#!/bin/sh\nPYTHONPATH="{paths}" exec {command} "$@"\n')
        tool.chmod(0o755)
    sums = subprocess.run(
        "cat pyproject.toml constraints.txt | cksum",
        shell=True, cwd=project, capture_output=True, text=True, check=True,
    )  # fmt: skip
    (project / ".venv/dragdeck-stamp").write_text(f"{project.resolve()}\n{sums.stdout}")
    write_study(project, tiny_study())
    return project


def words_of(project: Path, *arguments: str) -> list[str]:
    """``./run``, with the tiny study."""
    return [str(project / "run"), *(arguments or ("all",)), "--config", f"study={STUDY}"]


def workflow_attacks(seed: int, kills: int = 6) -> Iterator[Attack]:
    """Kills of the whole workflow, wrong calls, and places that cannot be written."""
    chance = random.Random(f"workflow {seed}")
    for number in range(kills):
        seconds = round((number + chance.random()) / kills, 3)
        victim = ("group", "everything")[number % 2]
        name = f"./run all: {victim} killed at {seconds:.1%} of its time"
        yield Attack("workflow", name, partial(_killed, victim, seconds), (SAME,), 2 * WHOLE_S)
    for name, act, expected in _ATTACKS:
        yield Attack("workflow", name, act, expected, WHOLE_S)
    for name, arguments, named in _WRONG_CALLS:
        yield Attack("workflow", name, partial(_wrong, arguments, named), (REFUSED,), 8.0)


# --- kills of the whole ---------------------------------------------------------------


def _killed(victim: str, fraction: float, arena: Arena) -> Got:
    """SIGKILL to Snakemake's process group, or to all that it started, then the same call."""
    project = entry(arena.folder / "project")
    running = Call(words_of(project), project, arena.folder / "first.log")
    moment = 2.0 + fraction * 1.1 * sum(phase.cpu_s for phase in arena.ground.phases.values())
    if not running.wait_until(lambda: running.spent_s() > moment):
        return Got("not killed in time", running.wait().tail)
    tree = running.tree()
    if victim == "group":
        os.killpg(running.process.pid, signal.SIGKILL)
    else:
        kill(tree)
    running.wait()
    if not gone_within(project, ENDS_WITHIN_S):
        kill(engines(project))
        return Got(f"engine still runs {ENDS_WITHIN_S:.0f} s after its runner was killed")
    said = call(words_of(project), project, arena.folder / "again.log", _PATIENCE_S)
    if said.status != 0:
        return Got("the same call does not go on", said.text[-2500:])
    return _same_study(arena, project)


def _same_study(arena: Arena, project: Path) -> Got:
    """Every table of the study against what its inputs give when nobody disturbs the engine.

    A filling that was resumed is another bed, from which another process follows: the tables
    of such a process are made again from its inputs.
    """
    problems = []
    bed: list[int] = []
    for place in PLACES:
        (run,) = (project / "results" / STUDY / place).iterdir()
        steps = resumed_at(run)
        bed = steps if place == "filling" else bed
        clean = arena.clean
        if place == "process" and bed:
            clean = CleanRuns(_with_this_bed(arena, project), arena.folder / "clean")
            clean.cache.mkdir()
        wanted = clean.tables(place, steps)
        found = [
            problem
            for problem in differences(run / "tables", wanted)
            if not re.match(
                r"(chains|network|clusters|facets|contact_events|loading|figures)", problem
            )
        ]
        problems += [f"{place} resumed at {steps}: {problem}" for problem in found]
    for name in ("summary.csv", "summary.parquet", "report.html"):
        if not (project / "results" / STUDY / "report" / name).is_file():
            problems.append(f"{name} is missing")
    return Got("other tables", "\n".join(problems)) if problems else Got(SAME)


def _with_this_bed(arena: Arena, project: Path) -> Ground:
    """The ground with the attacked project in place of the undisturbed one."""
    (run,) = (project / "results" / STUDY / "process").iterdir()
    process = arena.ground.phases["process"]
    own = [
        name
        for name in files_of(project)
        if "/process/" not in name
        or Path(name).name in ("in.liggghts", "case.json", "columns.json")
        or Path(name).suffix == ".stl"
    ]
    phase = type(process)(
        process.name, process.words, str(run.relative_to(project)), True, before=own
    )
    return Ground(project, {**arena.ground.phases, "process": phase})


# --- other attacks ---------------------------------------------------------------------


def _two_at_once(arena: Arena) -> Got:
    """A second call while the first runs: a live lock is respected."""
    project = entry(arena.folder / "project")
    first = Call(words_of(project), project, arena.folder / "first.log")
    if not first.wait_until(lambda: bool(list((project / ".snakemake/locks").glob("*")))):
        return Got("the first call took no lock", first.wait().tail)
    second = call(words_of(project), project, arena.folder / "second.log", _PATIENCE_S)
    said = first.wait(_PATIENCE_S)
    if second.status == 0:
        return Got("both ran", second.tail)
    if said.status != 0:
        return Got("the first call failed", said.tail)
    if second.has_traceback:
        return Got("traceback", second.tail)
    named = re.search("lock|another|already runs|running", second.text, re.IGNORECASE)
    return Got(REFUSED if named else UNNAMED, second.tail)


_FAILS = """\
{% extends "base/process.in.j2" %}
{% block extra %}
{% if "0.006" in deck.run %}
quit
{% endif %}
{% endblock %}
"""


def _one_fails(arena: Arena) -> Got:
    """A sweep of which one case fails: the report shows the other, and names this one."""
    project = entry(arena.folder / "project")
    data = tiny_study()
    data["sweep"] = {"motion.immersion_depth_m": [0.006, 0.007]}
    file = write_study(project, data).parent / "templates/process.in.j2"
    file.parent.mkdir()
    file.write_text(_FAILS)
    said = call(words_of(project), project, arena.folder / "first.log", _PATIENCE_S)
    if said.status in (0, None):
        return Got("the failed case was not told", said.tail)
    report = project / "results" / STUDY / "report"
    if not (report / "report.html").is_file():
        return Got("no report", said.text[-2500:])
    rows = len(pd.read_parquet(report / "summary.parquet"))
    page = (report / "report.html").read_text(encoding="utf-8")
    if "0.006" not in page or not re.search("LIGGGHTS ended normally|failed|rejected", page):
        return Got("the report does not list the failed case", f"{rows} rows")
    return Got("a report of the case that passed, and of the one that failed", f"{rows} rows")


def _read_only(arena: Arena) -> Got:
    """A repository on a disk that is mounted read-only."""
    with small_disk(arena.folder) as disk:
        if disk is None:
            return Got(NO_ROOT)
        project = entry(disk.folder / "project")
        words = ["mount", "-o", "remount,ro", str(disk.folder)]
        subprocess.run(words, check=True)
        said = call(words_of(project), project, arena.folder / "first.log", _PATIENCE_S)
        return judged(said, "read-only|cannot be written|permission|write")


def _full(arena: Arena) -> Got:
    """A repository on a disk without a byte left."""
    with small_disk(arena.folder) as disk:
        if disk is None:
            return Got(NO_ROOT)
        project = entry(disk.folder / "project")
        disk.hold(0)
        said = call(words_of(project), project, arena.folder / "first.log", _PATIENCE_S)
        return judged(said, "no space left|disk")


def _of_another_user(arena: Arena) -> Got:
    """Results that may be read but not written."""
    if os.geteuid() != 0:
        return Got(NO_ROOT)
    project = arena.ground.copy(arena.folder / "project")
    _open_way(project)
    run = arena.ground.run("process")
    said = main_of("dragchain", ["tables", run], project, user=65534)
    return judged(said, "permission|write")


def _unreadable(arena: Arena) -> Got:
    """A study that may not be read."""
    if os.geteuid() != 0:
        return Got(NO_ROOT)
    project = new_project(arena.folder / "project")
    file = write_study(project, tiny_study())
    _open_way(project)
    file.chmod(0)
    return judged(main_of("dragdeck", ["check", STUDY], project, user=65534), r"study\.yaml")


def _open_way(project: Path) -> None:
    """Let others come to a folder and look at it."""
    for folder in [project, *project.parents]:
        if folder.stat().st_uid == os.geteuid() and folder != Path("/"):
            folder.chmod(folder.stat().st_mode | stat.S_IXOTH | stat.S_IROTH | stat.S_IXGRP)


def _by_symlink(arena: Arena) -> Got:
    """The script called by a symlink that stands elsewhere."""
    project = entry(arena.folder / "project")
    link = arena.folder / "elsewhere" / "go"
    link.parent.mkdir()
    link.symlink_to(project / "run")
    words = [str(link), "all", "--config", f"study={STUDY}", "--dry-run"]
    said = call(words, link.parent, arena.folder / "first.log", 60.0)
    if said.status == 0 and "run_process" in said.text:
        return Got("it runs there")
    return judged(said, "symlink|symbolic link", accepted="it runs elsewhere")


def _emptied_state(arena: Arena) -> Got:
    """What Snakemake keeps of a study is lost or damaged: nothing is run again for nothing."""
    project = entry(arena.folder / "project")
    first = call(words_of(project, "drop_test"), project, arena.folder / "first.log", _PATIENCE_S)
    if first.status != 0:
        return Got("the first call failed", first.tail)
    for file in (project / ".snakemake").rglob("*"):
        if file.is_file():
            os.truncate(file, 0)
    said = call(words_of(project, "drop_test"), project, arena.folder / "again.log", _PATIENCE_S)
    if said.status != 0 or said.has_traceback:
        return Got("traceback" if said.has_traceback else "refused", said.text[-2500:])
    (run,) = (project / "results" / STUDY / "drop_test").iterdir()
    parts = json.loads((run / "run.json").read_text())["parts"]
    return Got("it goes on" if len(parts) == 1 else "it runs again")


_ATTACKS: tuple[tuple[str, Callable[[Arena], Got], tuple[str, ...]], ...] = (
    ("two calls at once", _two_at_once, (REFUSED,)),
    (
        "one case of a sweep fails",
        _one_fails,
        ("a report of the case that passed, and of the one that failed",),
    ),
    ("a read-only repository", _read_only, (REFUSED,)),
    ("a repository on a full disk", _full, (REFUSED,)),
    ("results of another user", _of_another_user, (REFUSED,)),
    ("a study that may not be read", _unreadable, (REFUSED,)),
    ("a symlink to run", _by_symlink, ("it runs there", REFUSED)),
    ("what Snakemake keeps is emptied", _emptied_state, ("it goes on",)),
)

_WRONG_CALLS: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    ("an unknown key of --config", (f"study={STUDY}", "fidelty=quick"), ("fidelty", "fidelity")),
    ("an unknown fidelity", (f"study={STUDY}", "fidelity=quik"), ("quik", "quick")),
    ("an unknown study", ("study=tny",), ("tny", STUDY)),
    ("a study out of the folder", ("study=../studies/tiny",), (r"\.\./studies/tiny",)),
    ("a study that is a command", ("study=tiny; touch pwned",), ("tiny; touch pwned",)),
    ("a study with a newline", ("study=tiny\ntouch pwned",), ("study",)),
    ("a study of 5000 letters", ("study=" + "a" * 5000,), ("study",)),
    ("a study that is a number", ("study=17",), ("17", STUDY)),
    ("a study that is nothing", ("study=",), ("study",)),
    ("an unknown plan", (f"study={STUDY}", "plan=nothing"), ("nothing",)),
    ("a record out of the project", (f"study={STUDY}", "record"), ("passwd|record",)),
    ("a plan that is no plan", (f"study={STUDY}", "plan=/etc/passwd"), ("passwd|plan",)),
)


def _wrong(config: tuple[str, ...], named: tuple[str, ...], arena: Arena) -> Got:
    project = entry(arena.folder / "project")
    target = "tradeoff" if "plan=" in config[-1] else "all"
    if config[-1] == "record":
        write_study(project, {**tiny_study(), "calibration": {"record": "/etc/passwd"}})
        config, target = config[:-1], "calibrate"
    words = [str(project / "run"), target, "--dry-run", "--config", *config]
    said = call(words, project, arena.folder / "first.log", 60.0)
    if list(project.rglob("pwned")):
        return Got("an input became code", said.tail)
    return judged(said, *named)

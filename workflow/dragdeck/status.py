"""What a study's runs will take, how far they are, and where its report is."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from dragdeck.cases.case import Case
from dragdeck.cases.ranks import cores_here
from dragdeck.engine.status import RunState
from dragdeck.errors import InputError
from dragdeck.outlook import runs as study_runs
from dragdeck.project import Project, find_project
from dragdeck.scenes.process import SCENES

_SHOWN = 8
"""Runs of a state that are listed without ``--verbose``."""

_ORDER: tuple[RunState, ...] = ("failed", "running", "interrupted", "waiting", "complete")


def status(study: str, fidelity: str | None, plan: str | None, verbose: bool) -> None:
    """Print how far the runs of a study, or of a plan, are; at any time, whoever runs them."""
    project = find_project(Path.cwd())
    points = project.points(study, plan) if plan else None
    every = [] if points else project.cases(study, fidelity)
    runs: list[study_runs.StudyRun] = []
    for kind in SCENES.values():
        cases = points.of(kind) if points else every
        folders = project.run_folders(cases, kind, of_plan=points is not None)
        runs += [run.now() for run in study_runs.expected_runs(kind, folders)]
    runs = study_runs.by_their_speeds(runs)
    for state in _ORDER:
        _show_state(state, [run for run in runs if run.status.state == state], verbose)
    left = [run for run in runs if not run.status.final]
    counts = {state: sum(run.status.state == state for run in runs) for state in _ORDER}
    said = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    cost = f"; still to run: {study_runs.cost_in_words(left, cores_here())}" if left else ""
    print(f"{study}: runs {100 * study_runs.done_fraction(runs):.0f} % done: {said}{cost}")
    if not plan:
        file = project.report(study)
        known = file if file.is_file() else "none yet"
        print("report:", f"{known}{_not_current(project, study, every)}")


def _not_current(project: Project, study: str, cases: Sequence[Case]) -> str:
    """What to say of a report that is not on the study as it stands; nothing of one that is."""
    if project.report_is_current(study, cases):
        return ""
    there = project.report(study).is_file()
    old = " is of other settings, or not of all runs" if there else ""
    return f"{old}; make it with: ./run all --config study={study}"


def _show_state(state: RunState, runs: Sequence[study_runs.StudyRun], verbose: bool) -> None:
    """Print the runs of a state, those that need attention with the reason."""
    shown = runs if verbose or state == "failed" else runs[:_SHOWN]
    for run in shown:
        print(run)
        if run.status.problem:
            print("  " + run.status.problem.replace("\n", "\n  "))
        if state == "interrupted" and "remedy:" not in run.status.problem:
            print("  remedy: give the same command again: the run resumes from its last checkpoint")
    if runs[len(shown) :]:
        print(f"and {len(runs) - len(shown)} more {state} (--verbose)")


def open_report(study: str) -> None:
    """Print the path of a study's report, and open it where there is a display.

    Raises
    ------
    InputError
        There is no such study, or no report yet.
    """
    project = find_project(Path.cwd())
    cases = project.cases(study)
    file = project.report(study)
    if not file.is_file():
        raise InputError(
            "there is no report yet",
            file=file,
            remedy=f"make it with: ./run all --config study={study}",
        )
    print(file)
    if old := _not_current(project, study, cases):
        print(f"warning: the report{old}", file=sys.stderr)
    viewer = shutil.which("xdg-open")
    if viewer and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        subprocess.Popen([viewer, str(file)], stderr=subprocess.DEVNULL, start_new_session=True)

"""Runs on the real engine: to the end, interrupted, killed, failed, changed."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from dragdeck.cases import Case, load_cases
from dragdeck.errors import EngineError, GateError, InputError
from dragdeck.project import Project
from dragdeck.render import environment, write_run
from dragdeck.runner import Progress, _Watcher, fingerprint, run
from dragdeck.scenes import drop_scene, fill_scene

pytestmark = pytest.mark.engine


def silent(line: str) -> None:
    """Report nothing."""


@pytest.fixture
def fill(case: Case, project: Project) -> Path:
    """A rendered fill, not yet run."""
    folder = project.run_folder(case, "fill")
    write_run(fill_scene(case), folder, environment(project.templates))
    return folder


def state(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "state.json").read_text())


def test_a_fill_keeps_every_ball_and_comes_to_rest(fill: Path) -> None:
    result = json.loads(run(fill, silent).read_text())
    assert result["state"] == "complete"
    assert all(gate["passed"] for gate in result["gates"])
    assert {gate["name"] for gate in result["gates"]} >= {"bed at rest", "every ball kept"}
    assert (fill / "fill.restart").is_file()
    assert not list(fill.glob("checkpoint.*"))


def test_a_complete_run_is_not_repeated(fill: Path) -> None:
    first = run(fill, silent).read_text()
    (fill / "run.json").unlink()  # as Snakemake does before it runs a rule again
    assert run(fill, silent).read_text() == first


def test_a_comment_in_the_deck_changes_nothing(fill: Path) -> None:
    before = fingerprint(fill)
    deck = fill / "in.liggghts"
    deck.write_text("# another title\n" + deck.read_text())
    assert fingerprint(fill) == before
    deck.write_text(deck.read_text().replace("timestep ", "timestep 0"))
    assert fingerprint(fill) != before


def test_a_changed_deck_moves_the_old_run_aside(
    fill: Path, small: dict[str, Any], write_study: Callable[..., Path], project: Project
) -> None:
    run(fill, silent)
    old = (fill / "balls.1.bin").read_bytes()
    deck = fill / "in.liggghts"
    deck.write_text(deck.read_text().replace("9.81", "9.80"))
    lines: list[str] = []
    run(fill, lines.append)
    (kept,) = (fill / "archive").iterdir()
    assert (kept / "balls.1.bin").read_bytes() == old
    assert "9.81" in (kept / "as_run/in.liggghts").read_text()
    assert any(str(kept) in line for line in lines)


def start(folder: Path) -> subprocess.Popen[bytes]:
    """Run in a process of its own, which can be signalled."""
    words = [sys.executable, "-m", "dragdeck.cli", "run", str(folder), "--every", "1"]
    return subprocess.Popen(words, stderr=subprocess.PIPE)


def wait_for(condition: Callable[[], object], seconds: float = 30) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def has_checkpoint(folder: Path) -> Callable[[], bool]:
    return lambda: len(list(folder.glob("checkpoint.*"))) > 1


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_leaves_a_checkpoint_and_the_run_goes_on(
    small: dict[str, Any],
    write_study: Callable[..., Path],
    project: Project,
    ranks: int,
    number: signal.Signals,
) -> None:
    small["fidelities"]["quick"].update(ranks=ranks, fill_timestep_fraction=0.05)
    (case,) = load_cases(write_study(small))
    folder = project.run_folder(case, "fill")
    write_run(fill_scene(case), folder, environment(project.templates))
    process = start(folder)
    wait_for(has_checkpoint(folder))
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert b"stopped as asked" in said
    assert b"checkpoint at step" in said
    assert state(folder)["state"] == "stopped"
    assert not (folder / "run.json").exists()

    result = json.loads(run(folder, silent).read_text())
    assert [part["part"] for part in result["parts"]] == [1, 2]
    assert result["parts"][1]["from_step"] > 0
    assert result["state"] == "complete"


def test_a_killed_engine_is_never_a_result(
    small: dict[str, Any], write_study: Callable[..., Path], project: Project
) -> None:
    small["fidelities"]["quick"].update(fill_timestep_fraction=0.05)
    (case,) = load_cases(write_study(small))
    folder = project.run_folder(case, "fill")
    write_run(fill_scene(case), folder, environment(project.templates))
    process = start(folder)
    wait_for(has_checkpoint(folder))
    for child in psutil.Process(process.pid).children(recursive=True):
        os.kill(child.pid, signal.SIGKILL)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert b"the engine was killed" in said
    assert not (folder / "run.json").exists()
    assert json.loads(run(folder, silent).read_text())["state"] == "complete"


def test_a_queue_that_signals_the_engine_too_stops_the_run(
    small: dict[str, Any], write_study: Callable[..., Path], project: Project
) -> None:
    small["fidelities"]["quick"].update(fill_timestep_fraction=0.05)
    (case,) = load_cases(write_study(small))
    folder = project.run_folder(case, "fill")
    write_run(fill_scene(case), folder, environment(project.templates))
    process = start(folder)
    wait_for(has_checkpoint(folder))
    (engine,) = psutil.Process(process.pid).children()
    engine.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert b"stopped as asked" in said
    assert state(folder)["parts"][0]["exit_status"] == 0
    assert not list(folder.glob("restart_forced_*"))

    (folder / "restart_forced_liggghts_7.data").touch()  # the runner was killed before it looked
    result = json.loads(run(folder, silent).read_text())
    assert result["parts"][1]["from_step"] > 0
    assert not (folder / "archive").exists()


def test_the_engines_error_reaches_the_user_and_is_not_retried(fill: Path) -> None:
    deck = fill / "in.liggghts"
    good = deck.read_text()
    deck.write_text(good.replace(" 0.86 ", " 0.01 "))
    with pytest.raises(GateError, match=r"ERROR.*[Rr]estitution"):
        run(fill, silent)
    assert not (fill / "run.json").exists()
    begun = state(fill)["started"]
    with pytest.raises(GateError, match="--again"):
        run(fill, silent)
    assert state(fill)["started"] == begun
    deck.write_text(good)
    assert run(fill, silent).is_file()


def test_a_truncated_output_fails_its_gate(fill: Path) -> None:
    deck = fill / "in.liggghts"
    deck.write_text(
        deck.read_text().replace(
            "write_restart fill.restart",
            "undump write_balls\nshell truncate -s -5 balls.1.bin\nwrite_restart fill.restart",
        )
    )
    with pytest.raises(GateError, match=r"balls whole: balls\.1\.bin is cut short"):
        run(fill, silent)


def test_a_lost_ball_fails(fill: Path) -> None:
    data = fill / "balls.data"
    lines = data.read_text().splitlines()
    first = lines.index("Velocities") + 2
    lines[first] = "1 0 0 50.0 0 0 0"  # straight up and out
    data.write_text("\n".join(lines) + "\n")
    # whoever sees it first: the engine, or the watcher of the run's limits
    with pytest.raises(GateError, match=r"Lost atoms|299 balls at step"):
        run(fill, silent)


def test_a_folder_without_a_deck_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no case\.json"):
        run(tmp_path, silent)


def test_a_missing_engine_leaves_no_trace(fill: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRAGDECK_ENGINE", "no-such-engine")
    with pytest.raises(EngineError):
        run(fill, silent)
    assert not (fill / "state.json").exists()


def test_a_drop_has_three_impacts(case: Case, project: Project) -> None:
    folder = project.run_folder(case, "drop")
    write_run(drop_scene(case), folder, environment(project.templates))
    run(folder, silent)
    rows = (folder / "impacts.1.txt").read_text().splitlines()
    assert rows.count(rows[0]) == 3
    forces = [float(row.split()[-1]) for row in rows if row != rows[0]]
    touching = [force > 0 for force in forces]
    starts = sum(now and not before for before, now in itertools.pairwise([False, *touching]))
    assert starts == 3


def test_progress_waits_for_the_first_row(tmp_path: Path) -> None:
    """The engine opens its file before it writes to it."""
    lines: list[str] = []
    columns = ["step", "time_s", "balls", "kinetic_energy_j", "rotational_energy_j"]
    thermo = {"pattern": "thermo.{part}.txt", "columns": columns}
    watch = _Watcher(tmp_path, {"outputs": {"thermo": thermo}}, 1, 0, 100, lines.append, 1.0)
    file = tmp_path / "thermo.1.txt"
    for seconds, text in ((1.0, ""), (2.0, "step time_s\n"), (3.0, "step time_s\n50 0.1 9 0 0\n")):
        file.write_text(text)
        watch(seconds)
    assert len(lines) == 1
    assert lines[0].startswith("step 50 of 100 (50 %)")


def test_progress_says_how_long() -> None:
    shown = str(Progress(step=250, steps=1000, steps_per_s=10.0))
    assert shown == "step 250 of 1,000 (25 %), 10 steps/s, 1 min 15 s left"

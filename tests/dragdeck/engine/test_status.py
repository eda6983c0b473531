"""How far a run is, seen from outside: files as a run leaves them, and the lock of a living one."""

import os
from pathlib import Path

import pytest
from made_scenes import rendered

from dragdeck.cases.case import Case
from dragdeck.engine.process import only_runner
from dragdeck.engine.reports import printable, shown_time, silent
from dragdeck.engine.status import run_status
from dragdeck.project import Project
from dragdeck.records.run import RunPart, RunRecord, State
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import PROCESS

HEAD = "step time_s n_particles kinetic_energy_j rotational_energy_j fastest_particle_m_s\n"


@pytest.fixture
def filling(case: Case, project: Project) -> Path:
    return rendered(case, project)


@pytest.fixture
def process(case: Case, project: Project) -> Path:
    return rendered(case, project, PROCESS)


def write_state(folder: Path, state: State, **more: object) -> None:
    record = RunRecord(
        state=state, inputs="", started="", engine_version="3.8.0", ranks=1,
        parts=[RunPart(part=1, checkpoint=None, from_step=more.pop("first", 0))],  # type: ignore[arg-type]
    )  # fmt: skip
    record.model_copy(update=more).write(folder / "state.json")


def write_thermo(folder: Path, step: int, energy_j: float, after_s: float) -> None:
    """Rows of a run that began so many seconds before."""
    file = folder / "thermo.1.txt"
    file.write_text(HEAD + f"1 0.1 300 1.0 0.0 0.0\n{step} 0.2 300 {energy_j} 0.0 0.0\n12 0.3 3")
    os.utime(folder / "state.json", (1000.0, 1000.0))
    os.utime(file, (1000.0 + after_s, 1000.0 + after_s))


def test_a_run_that_was_never_started_waits(tmp_path: Path, filling: Path) -> None:
    assert run_status(tmp_path / "none").state == "waiting"
    assert run_status(filling).state == "waiting"


def test_the_speed_is_that_of_the_part_that_runs(process: Path) -> None:
    write_state(process, "running", first=200)
    write_thermo(process, 1200, 1.0, after_s=4.0)
    with only_runner(process, silent):
        status = run_status(process)
    assert (status.state, status.step, status.steps_per_s) == ("running", 1200, 250.0)
    assert status.last is not None and status.last > 1200
    assert status.energy is None


def test_the_speed_of_a_stopped_run_is_that_of_the_time_in_which_it_ran(process: Path) -> None:
    write_state(process, "stopped", first=200, steps_per_s=125.0)
    for after_s in (-0.1, 3600.0):  # its record is written last; a copy may be touched later
        write_thermo(process, 1200, 1.0, after_s)
        status = run_status(process)
        assert (status.state, status.step, status.steps_per_s) == ("interrupted", 1200, 125.0)


def test_a_run_without_a_row_yet_has_no_speed(process: Path) -> None:
    write_state(process, "running")
    (process / "thermo.1.txt").write_text(HEAD[:20])
    with only_runner(process, silent):
        status = run_status(process)
    assert (status.state, status.step, status.steps_per_s) == ("running", 0, None)


def test_a_filling_has_its_energy_beside_the_criterion(case: Case, filling: Path) -> None:
    deck = filling_scene(case).deck
    write_state(filling, "running")
    write_thermo(filling, 50, 0.25 * deck.energy_unit_j, after_s=1.0)
    status = run_status(filling)
    assert status.energy == pytest.approx(0.25, rel=1e-6)
    assert status.at_rest == deck.energy_ratio
    assert status.last is None


def test_a_run_whose_process_was_killed_is_interrupted(process: Path) -> None:
    write_state(process, "running")
    assert run_status(process).state == "interrupted"
    with only_runner(process, silent):
        assert run_status(process).state == "running"
    assert run_status(process).state == "interrupted"


def test_looking_does_not_keep_a_runner_waiting(process: Path) -> None:
    said: list[str] = []
    run_status(process)
    with only_runner(process, said.append):
        run_status(process)
    with only_runner(process, said.append):
        pass
    assert said == []


def test_what_ended_a_run_before_its_start_is_in_its_log(process: Path) -> None:
    (process / "logs").mkdir()
    log = process / "logs/run.log"
    log.write_text("part 1\ndragdeck: no \x1b[31mengine\n  remedy: install it\n")
    status = run_status(process)
    assert not status.final
    assert (status.state, status.problem) == ("failed", "no [31mengine\n  remedy: install it")
    with only_runner(process, silent):
        assert run_status(process).state == "waiting"


@pytest.mark.parametrize("text", ["", "{", '{"schema": 1}', '{"schema": 2, "state": "?"}'])
def test_a_damaged_record_is_told_and_not_raised(process: Path, text: str) -> None:
    (process / "state.json").write_text(text)
    status = run_status(process)
    assert status.state == "failed"
    assert "state.json" in status.problem


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0 s"), (2.34, "2.3 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (75, "1 min 15 s"),
     (3600 * 2 + 65, "2 h 01 min"), (86400 * 3 + 7200, "3 d 02 h")],
)  # fmt: skip
def test_times_are_shown_in_two_units(seconds: float, text: str) -> None:
    assert shown_time(seconds) == text


def test_no_control_character_is_printed() -> None:
    assert printable("a\x1b]0;x\x07b\tc\r\n\x9bd") == "a]0;xb\tc\nd"

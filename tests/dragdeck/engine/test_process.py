"""Finding the engine, and what is said when it is not the right one."""

from pathlib import Path

import pytest

from dragdeck.engine.process import (
    ENGINE_VARIABLE,
    LAUNCHER_VARIABLE,
    Engine,
    command,
    execute,
    find_engine,
)
from dragdeck.errors import EngineError


def script(file: Path, text: str) -> str:
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)
    return str(file)


def test_a_missing_engine_names_package_and_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENGINE_VARIABLE, "no-such-engine")
    with pytest.raises(EngineError, match="package liggghts") as caught:
        find_engine()
    assert ENGINE_VARIABLE in str(caught.value)


def test_an_old_engine_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = script(tmp_path / "old", "echo 'LIGGGHTS (Version LIGGGHTS-PUBLIC 3.7.9, compiled'")
    monkeypatch.setenv(ENGINE_VARIABLE, old)
    with pytest.raises(EngineError, match=r"too old\n.*3\.7\.9"):
        find_engine()


def test_another_program_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENGINE_VARIABLE, script(tmp_path / "other", "echo 'LAMMPS (1 Jan 2020)'"))
    with pytest.raises(EngineError, match="is not recognised as LIGGGHTS"):
        find_engine()


def test_what_an_engine_said_that_cannot_start_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "echo 'error while loading shared libraries: libmpi.so.40' >&2; exit 127"
    monkeypatch.setenv(ENGINE_VARIABLE, script(tmp_path / "broken", text))
    with pytest.raises(EngineError, match=r"exit status 127; it said: .*libmpi\.so\.40"):
        find_engine()


def test_one_rank_needs_no_mpirun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    engine = Engine("/opt/liggghts", "3.8.0")
    assert command(engine, "deck", 1, 1, None)[0] == "/opt/liggghts"
    with pytest.raises(EngineError, match="mpirun is missing"):
        command(engine, "deck", 2, 1, None)


def test_a_launcher_of_ones_own_starts_the_ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    engine = Engine("/opt/liggghts", "3.8.0")
    monkeypatch.setenv(LAUNCHER_VARIABLE, "env --mpi=pmix")
    by_line = ["stdbuf", "-oL", engine.path, "-in"]
    words = ["env", "--mpi=pmix", "-n", "4", *by_line]
    assert command(engine, "deck", 4, 1, None)[:8] == words
    assert command(engine, "deck", 1, 1, None)[:4] == by_line
    monkeypatch.setenv(LAUNCHER_VARIABLE, "no-such-launcher -v")
    with pytest.raises(EngineError, match=f"no-such-launcher.*\n.*{LAUNCHER_VARIABLE}"):
        command(engine, "deck", 4, 1, None)


@pytest.mark.parametrize("launcher", ["", "sh"])
def test_only_a_launcher_of_ones_own_sees_the_queue(
    launcher: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(LAUNCHER_VARIABLE, launcher)
    for name in ("SLURM_JOB_ID", "PMIX_RANK", "OTHER"):
        monkeypatch.setenv(name, "7")
    screen = tmp_path / "screen.txt"
    shown = "echo $SLURM_JOB_ID,$PMIX_RANK,$OTHER"
    ending = execute(["sh", "-c", shown], tmp_path, screen, watch=lambda seconds: None)
    assert ending.exit_status == 0
    assert screen.read_text() == ("7,7,7\n" if launcher else ",,7\n")


def test_a_resumed_run_names_its_checkpoint() -> None:
    words = command(Engine("e", "3.8.0"), "deck", 1, 2, Path("run/checkpoint.10.restart"))
    assert words[-6:] == ["-var", "resume", "1", "-var", "from", "checkpoint.10.restart"]

"""One runner a folder, and engines that lost theirs."""

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import psutil
import pytest

from dragdeck.engine.process import is_held, only_runner
from dragdeck.snakemake_lock import hold_lock

HOLD = """
import sys
from pathlib import Path
from dragdeck.engine.process import only_runner
with only_runner(Path(sys.argv[1]), print):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_lock_names_its_holder_and_dies_with_it(tmp_path: Path) -> None:
    words = [sys.executable, "-c", HOLD, str(tmp_path)]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        lines: list[str] = []

        def waiting(line: str) -> None:
            lines.append(line)
            holder.kill()

        with only_runner(tmp_path, waiting):
            assert holder.wait() == -9
            assert f"process {os.getpid()}" in (tmp_path / ".lock").read_text()
        assert f"process {holder.pid} on " in lines[0]


def test_an_engine_without_a_runner_is_ended(tmp_path: Path) -> None:
    words = [sys.executable, "-c", "import sys; sys.stdin.read()", "-in", "in.liggghts"]
    lines: list[str] = []
    with subprocess.Popen(words, cwd=tmp_path, stdin=subprocess.PIPE) as left:
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir()
        with only_runner(elsewhere, lines.append):
            assert psutil.Process(left.pid).status() != psutil.STATUS_ZOMBIE and lines == []
        with only_runner(tmp_path, lines.append):
            assert lines == [
                f"ended LIGGGHTS, which had outlived its dragdeck process: process {left.pid}"
            ]
        assert not psutil.pid_exists(left.pid)


def no_locks(*_: object) -> NoReturn:
    raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))


def test_a_file_system_without_locks_is_told_and_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fcntl.flock", no_locks)
    lines: list[str] = []
    with only_runner(tmp_path, lines.append):
        assert not is_held(tmp_path)
    assert len(lines) == 1 and "no locks" in lines[0]
    (tmp_path / "locks").mkdir()
    (tmp_path / "locks/0.input.lock").touch()
    hold_lock(tmp_path, lines.append, "all")
    assert (tmp_path / "locks/0.input.lock").exists() and len(lines) == 1

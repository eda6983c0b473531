"""Locks of dead and of living Snakemakes, and who is named as their holder."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from snakemake_calls import copy_of_project, snakemake

from dragdeck.snakemake_lock import hold_lock, others_at_work, why_locked

HOLD = """
import sys
from pathlib import Path
from dragdeck.snakemake_lock import hold_lock
hold_lock(Path(sys.argv[1]), print, "all --config study=small")
print("held", flush=True)
sys.stdin.read()
"""


@contextmanager
def held(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that works in a folder, killed in the end."""
    words, pipe = [sys.executable, "-c", HOLD, str(folder)], subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        yield other
        other.kill()


def test_only_locks_that_nobody_holds_are_deleted(tmp_path: Path) -> None:
    lock = tmp_path / "locks/0.input.lock"
    lock.parent.mkdir()
    lines: list[str] = []
    with held(tmp_path) as other:
        lock.write_text("a\n")
        hold_lock(tmp_path, lines.append)
        assert lock.exists() and lines == []
        (named,) = others_at_work(tmp_path)
        assert (named.pid, named.call) == (other.pid, "all --config study=small")
        why = str(why_locked(tmp_path))
        assert f"process {other.pid} on " in why and f"since {named.since}" in why
        assert f"kill -INT {other.pid}" in why
        with held(tmp_path):  # of two, it may be either that makes the same files
            assert f"kill -INT {other.pid}" not in str(why_locked(tmp_path))
    assert others_at_work(tmp_path) == [] and why_locked(tmp_path) is None
    script = "import sys; from pathlib import Path; from dragdeck.snakemake_lock import *\n"
    script += "hold_lock(Path(sys.argv[1]), print)"
    # this process holds the lock too by now, as a second living Snakemake would
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=True)
    assert lock.exists()


def test_the_locks_of_a_killed_snakemake_are_deleted(tmp_path: Path) -> None:
    lock = tmp_path / "locks/0.output.lock"
    lock.parent.mkdir()
    lock.write_text("a\n")
    lines: list[str] = []
    hold_lock(tmp_path, lines.append)
    assert not lock.exists()
    assert lines == ["the locks of a Snakemake that was killed were deleted"]


@pytest.mark.slow
def test_a_second_call_is_told_who_works(tmp_path: Path) -> None:
    """Both make the same files: the second ends, the first and its locks stay."""
    project = copy_of_project(tmp_path)
    locks = project / ".snakemake/locks"
    locks.mkdir(parents=True)
    with held(locks.parent) as other:
        (locks / "0.output.lock").write_text("results/small/report/report.html\n")
        done = snakemake(project, "report", "--logger", "dragdeck", "--config", "study=small")
    assert done.returncode == 1
    assert f"process {other.pid} on " in done.stderr
    assert "unlock" not in done.stderr
    assert (locks / "0.output.lock").exists()

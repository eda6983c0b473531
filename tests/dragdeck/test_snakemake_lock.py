"""Locks of dead and of living Snakemakes."""

import subprocess
import sys
from pathlib import Path

from dragdeck.snakemake_lock import clear_stale_locks

HOLD = """
import sys
from pathlib import Path
from dragdeck.snakemake_lock import clear_stale_locks
clear_stale_locks(Path(sys.argv[1]), print)
print("held", flush=True)
sys.stdin.read()
"""


def test_only_locks_that_nobody_holds_are_deleted(tmp_path: Path) -> None:
    lock = tmp_path / "locks/0.input.lock"
    lock.parent.mkdir()
    lines: list[str] = []
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        lock.write_text("a\n")
        clear_stale_locks(tmp_path, lines.append)
        assert lock.exists() and lines == []
        other.kill()
    script = "import sys; from pathlib import Path; from dragdeck.snakemake_lock import *\n"
    script += "clear_stale_locks(Path(sys.argv[1]), print)"
    # this process holds the lock too by now, as a second living Snakemake would
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=True)
    assert lock.exists()


def test_the_locks_of_a_killed_snakemake_are_deleted(tmp_path: Path) -> None:
    lock = tmp_path / "locks/0.output.lock"
    lock.parent.mkdir()
    lock.write_text("a\n")
    lines: list[str] = []
    clear_stale_locks(tmp_path, lines.append)
    assert not lock.exists()
    assert lines == ["the locks of a Snakemake that was killed were deleted"]

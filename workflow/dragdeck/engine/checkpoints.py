"""Restart points of a run."""

from __future__ import annotations

from pathlib import Path

CHECKPOINTS_KEPT = 2


def checkpoint_files(folder: Path) -> list[Path]:
    """Restart points, oldest first."""
    return sorted(folder.glob("checkpoint.*.restart"), key=checkpoint_step)


def checkpoint_step(file: Path) -> int:
    """The step of a restart point, from its name."""
    return int(file.name.split(".")[1])


def newest_checkpoint(folder: Path) -> Path | None:
    """The newest restart point that is whole.

    The engine writes one thing after another: a restart file is whole if a
    text output was written after it, and may be cut short if it was the last.
    """
    texts = [*folder.glob("*.*.txt"), *folder.glob("engine.*.log")]
    latest = max((file.stat().st_mtime_ns for file in texts), default=0)
    whole = [file for file in checkpoint_files(folder) if file.stat().st_mtime_ns < latest]
    return whole[-1] if whole else None


def take_forced_restarts(folder: Path) -> bool:
    """Delete what the engine wrote because it was itself told to end; whether it was.

    A queue signals every process of a job. The engine then ends as if all were well, with
    a restart file that looks like a part of the deck; two ranks need not agree on its step.
    """
    forced = list(folder.glob("restart_forced_*"))
    for file in forced:
        file.unlink()
    return bool(forced)

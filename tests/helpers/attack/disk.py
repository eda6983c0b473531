"""A disk of one's own that can be made too small."""

import contextlib
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from attack.calls import engines, kill

ROOMY = 256 * 2**20
"""Bytes of a disk with room for everything."""

PAGE = 4096


class Disk:
    """A tmpfs that can be made smaller and larger while it is in use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def hold(self, bytes_: int) -> None:
        """Let the disk hold this many bytes; never less than it holds already."""
        pages = max(1, -(-bytes_ // PAGE))
        for _ in range(100):  # what is written meanwhile may need the room
            if _done("mount", "-o", f"remount,size={pages * PAGE}", str(self.folder)):
                return
            pages = max(pages, -(-self.used() // PAGE)) + 1
        raise AssertionError("the disk cannot be made this small")

    def used(self) -> int:
        """Bytes that the disk holds."""
        found = os.statvfs(self.folder)
        return (found.f_blocks - found.f_bfree) * found.f_frsize


def _done(*words: str) -> bool:
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[Disk | None]:
    """A disk below a folder; None where nobody may mount one."""
    place = folder / "disk"
    place.mkdir()
    allowed = os.geteuid() == 0 and shutil.which("mount") is not None
    size = f"size={ROOMY}"
    if not allowed or not _done("mount", "-t", "tmpfs", "-o", size, "attack", str(place)):
        yield None
        return
    try:
        yield Disk(place)
    finally:
        kill(engines(place))
        for _ in range(50):
            if _done("umount", str(place)):
                break
            time.sleep(0.1)
        else:
            _done("umount", "--lazy", str(place))

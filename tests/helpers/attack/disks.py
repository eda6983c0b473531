"""A disk that fills up in every phase, then has room again."""

import contextlib
import os
import random
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from attack.calls import Call, Said, engines, kill
from attack.case import NOT_RUN, Attack, Got
from attack.ground import Phase, size_of
from attack.kills import ENGINE_PHASES, PHASES, SAME, Arena, finish

NO_ROOT = f"{NOT_RUN}: a small disk can be mounted by root only"
ROOMY = 256 * 2**20
"""Bytes of a disk with room for everything."""

_PAGE = 4096
_SPARE = 2_000_000


class Disk:
    """A tmpfs that can be made smaller and larger while it is in use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def hold(self, bytes_: int) -> None:
        """Let the disk hold this many bytes; never less than it holds already."""
        pages = max(1, -(-bytes_ // _PAGE))
        options = f"remount,size={pages * _PAGE}"
        for _ in range(100):  # what is written meanwhile may need the room
            if _mount("-o", options, str(self.folder)):
                return
            pages = max(pages, -(-self.used() // _PAGE)) + 1
            options = f"remount,size={pages * _PAGE}"
        raise AssertionError("the disk cannot be made this small")

    def used(self) -> int:
        """Bytes that the disk holds."""
        found = os.statvfs(self.folder)
        return (found.f_blocks - found.f_bfree) * found.f_frsize


def _mount(*words: str) -> bool:
    done = subprocess.run(["mount", *words], capture_output=True, check=False)
    return done.returncode == 0


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[Disk | None]:
    """A disk of one's own below a folder; None where nobody may mount one."""
    place = folder / "disk"
    place.mkdir()
    allowed = os.geteuid() == 0 and shutil.which("mount") is not None
    if not allowed or not _mount("-t", "tmpfs", "-o", f"size={ROOMY}", "attack", str(place)):
        yield None
        return
    try:
        yield Disk(place)
    finally:
        kill(engines(place))
        for _ in range(50):
            words = ["umount", str(place)]
            if subprocess.run(words, capture_output=True, check=False).returncode == 0:
                break
            time.sleep(0.1)
        else:
            subprocess.run(["umount", "--lazy", str(place)], check=False)


def disk_attacks(seed: int, sizes: int = 10) -> Iterator[Attack]:
    """Disks that are too small by a seeded fraction of what a phase writes."""
    chance = random.Random(f"disks {seed}")
    wanted = (SAME, "refused with the way on")
    for phase in PHASES:
        seconds = 12.0 if phase in ENGINE_PHASES else 5.0
        for number in range(sizes):
            fraction = round((number + chance.uniform(0.0, 0.95)) / sizes, 3)
            name = f"{phase}: room for {fraction:.1%} of what it wants"
            act = partial(_small, phase, fraction)
            yield Attack("disk", name, act, wanted, seconds)
        for number in range(sizes // 2 if phase in ENGINE_PHASES else 0):
            fraction = round((number + chance.uniform(0.1, 0.9)) / (sizes // 2), 3)
            name = f"{phase}: no room left from {fraction:.1%} of its time on"
            act = partial(_filling_up, phase, fraction)
            yield Attack("disk", name, act, wanted, seconds)


def _small(phase_name: str, fraction: float, arena: Arena) -> Got:
    """The disk is too small before the phase begins."""
    phase = arena.ground.phases[phase_name]
    with small_disk(arena.folder) as disk:
        if disk is None:
            return Got(NO_ROOT)
        project = arena.ground.copy_before(phase, disk.folder / "project")
        disk.hold(disk.used() + int(fraction * _wanted(phase)))
        running = Call(phase.words, project, arena.folder / "first.log")
        return _with_room_again(arena, phase, project, disk, running.wait())


def _filling_up(phase_name: str, fraction: float, arena: Arena) -> Got:
    """Something else takes the last of the disk while the phase runs."""
    phase = arena.ground.phases[phase_name]
    with small_disk(arena.folder) as disk:
        if disk is None:
            return Got(NO_ROOT)
        project = arena.ground.copy_before(phase, disk.folder / "project")
        running = Call(phase.words, project, arena.folder / "first.log")
        running.wait_until(lambda: running.spent_s() > fraction * phase.cpu_s)
        disk.hold(0)
        return _with_room_again(arena, phase, project, disk, running.wait())


def _wanted(phase: Phase) -> int:
    """About what a phase wants of a disk: what it writes, and what a run leaves free."""
    return max(phase.bytes, 10 * _PAGE) + (_SPARE if phase.engine else 0)


_NAMES_THE_DISK = r"no space left|disk|free space"


def _with_room_again(
    arena: Arena, phase: Phase, project: Path, disk: Disk, first: Said
) -> Got:  # fmt: skip
    """What was said of the full disk, and what the same call gives with room."""
    if first.status is None:
        return Got("no answer on a full disk", first.tail)
    if first.has_traceback:
        return Got("traceback on a full disk", first.tail)
    if first.status != 0 and not re.search(_NAMES_THE_DISK, first.text, re.IGNORECASE):
        return Got("the disk is not named", f"status {first.status}: {first.tail}")
    disk.hold(ROOMY)
    got = finish(arena, phase, project, said_before=f"{first.tail}\nsize {size_of(project)}")
    if got.outcome.startswith("refused") and re.search(_NAMES_THE_DISK, got.seen):
        way_on = re.search(r"remedy:", got.seen.split("then:")[-1])
        return Got("refused with the way on", got.seen) if way_on else got
    return got

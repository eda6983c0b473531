"""A disk that is full, then has room: the same tables, never a run with holes."""

import random
import re

import pytest
from attack.arena import ENGINE_PHASES, PHASES, Arena
from attack.calls import Call
from attack.disk import PAGE, ROOMY
from attack.ground import Phase

pytestmark = [pytest.mark.engine, pytest.mark.slow]

SIZES = 10
_SPARE = 2_000_000
_NAMES_THE_DISK = r"no space left|disk|free space"
Full = tuple[str, float, bool]


def disks(seed: int) -> dict[str, Full]:
    """Disks that are too small by a seeded fraction of what a phase writes, or fill up."""
    chance = random.Random(f"disks {seed}")
    made = {}
    for phase in PHASES:
        for number in range(SIZES):
            fraction = round((number + chance.uniform(0.0, 0.95)) / SIZES, 3)
            made[f"{phase}: room for {fraction:.1%} of what it wants"] = (phase, fraction, False)
        for number in range(SIZES // 2 if phase in ENGINE_PHASES else 0):
            fraction = round((number + chance.uniform(0.1, 0.9)) / (SIZES // 2), 3)
            name = f"{phase}: no room left from {fraction:.1%} of its time on"
            made[name] = (phase, fraction, True)
    return made


@pytest.mark.attack(rows=disks, sample=2)
def test_a_full_disk_leaves_no_hole(attack: Full, arena: Arena) -> None:
    name, fraction, later = attack
    phase = arena.ground.phases[name]
    with arena.disk() as disk:
        project = arena.ground.copy_before(phase, disk.folder / "project")
        if not later:
            disk.hold(disk.used() + int(fraction * _wanted(phase)))
        running = Call(phase.words, project, arena.folder / "first.log")
        if later:
            running.wait_until(lambda: running.spent_s() > fraction * phase.cpu_s)
            disk.hold(0)
        first = running.wait()
        assert first.status is not None, f"no answer on a full disk: {first.tail}"
        assert not first.has_traceback, first.tail
        named = re.search(_NAMES_THE_DISK, first.text, re.IGNORECASE)
        assert first.status == 0 or named, f"the disk is not named: {first.tail}"
        disk.hold(ROOMY)
        again = arena.again(phase, project)
        if again.status == 0:
            arena.assert_same_tables(phase, project)
        else:
            said = f"{first.tail}\nthen: {again.tail}"
            assert re.search(_NAMES_THE_DISK, said, re.IGNORECASE), said
            assert "remedy:" in again.text, said


def _wanted(phase: Phase) -> int:
    """About what a phase wants of a disk: what it writes, and what a run leaves free."""
    return max(phase.bytes, 10 * PAGE) + (_SPARE if phase.engine else 0)

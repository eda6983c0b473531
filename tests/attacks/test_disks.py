"""A disk that is full, then has room: the same tables, never a run with holes."""

import random
import re
from pathlib import Path

import pytest
from attack.calls import Call
from attack.disk import PAGE, ROOMY, Disk
from attack.ground import SEED, Phase, Undisturbed
from attack.judge import ENGINE_PHASES, PHASES, again, assert_same_tables

pytestmark = [pytest.mark.engine, pytest.mark.slow]

SIZES = 10
_SPARE = 2_000_000
_NAMES_THE_DISK = r"no space left|disk|free space"
Full = tuple[str, float, bool]


def disks() -> dict[str, Full]:
    """Disks that are too small by a seeded fraction of what a phase writes, or fill up."""
    chance = random.Random(f"disks {SEED}")
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


_DISKS = disks()


@pytest.mark.attack(sample=1)
@pytest.mark.parametrize(("name", "fraction", "later"), _DISKS.values(), ids=_DISKS)
def test_a_full_disk_leaves_no_hole(
    name: str, fraction: float, later: bool, study: Undisturbed, disk: Disk | None, target: Path
) -> None:
    if disk is None:
        pytest.skip("a small disk can be mounted by root only")
    phase = study.phases[name]
    study.copy_before(phase, target)
    if not later:
        disk.hold(disk.used() + int(fraction * _wanted(phase)))
    running = Call(phase.words, target, disk.folder.with_suffix(".log"))
    if later:
        running.wait_until(lambda: running.spent_s() > fraction * phase.cpu_s)
        disk.hold(0)
    first = running.wait()
    assert first.status is not None, f"no answer on a full disk: {first.tail}"
    assert not first.has_traceback, first.tail
    named = re.search(_NAMES_THE_DISK, first.text, re.IGNORECASE)
    assert first.status == 0 or named, f"the disk is not named: {first.tail}"
    disk.hold(ROOMY)
    second = again(phase, target)
    if second.status == 0:
        assert_same_tables(study, phase, target)
    else:
        said = f"{first.tail}\nthen: {second.tail}"
        assert re.search(_NAMES_THE_DISK, said, re.IGNORECASE), said
        assert "remedy:" in second.text, said


def _wanted(phase: Phase) -> int:
    """About what a phase wants of a disk: what it writes, and what a run leaves free."""
    return max(phase.bytes, 10 * PAGE) + (_SPARE if phase.engine else 0)

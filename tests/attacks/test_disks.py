"""A disk that is full, then has room: the same tables, never a run with holes."""

import pytest
from attack.case import Attack
from attack.disks import disk_attacks
from attack.kills import Arena

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return list(disk_attacks(seed))


def test_a_full_disk_leaves_no_hole(attack: Attack, arena: Arena, judge) -> None:
    judge(attack, attack.act(arena))

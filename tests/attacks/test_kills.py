"""Kill -9 in every phase: the same call goes on, and gives the same tables."""

import pytest
from attack.case import Attack
from attack.kills import Arena, kill_attacks

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return list(kill_attacks(seed))


def test_a_kill_costs_nothing_but_time(attack: Attack, arena: Arena, judge) -> None:
    judge(attack, attack.act(arena))

"""Attacks on the whole: ./run killed, locked, called wrongly, on disks that cannot be written."""

import pytest
from attack.case import Attack
from attack.kills import Arena
from attack.workflow import workflow_attacks

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return list(workflow_attacks(seed))


def test_the_workflow_goes_on_or_says_why(attack: Attack, arena: Arena, judge) -> None:
    judge(attack, attack.act(arena))

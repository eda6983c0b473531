"""Damaged checkpoints, inputs and results: named, or made good; never taken for whole."""

import pytest
from attack.case import Attack
from attack.damage import checkpoint_attacks, input_attacks, result_attacks
from attack.kills import Arena

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return [*checkpoint_attacks(seed), *input_attacks(seed), *result_attacks(seed)]


def test_damage_is_found(attack: Attack, arena: Arena, judge) -> None:
    judge(attack, attack.act(arena))

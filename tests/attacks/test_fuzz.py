"""Fuzzed dumps and meshes, and meshes that are made to break something."""

from pathlib import Path

import pytest
from attack.case import Attack
from attack.fuzz import fuzz_attacks
from attack.meshes import mesh_attacks

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return [*fuzz_attacks(seed), *mesh_attacks(seed)]


def test_it_is_read_rightly_or_refused(
    attack: Attack, tmp_path: Path, request: pytest.FixtureRequest, judge
) -> None:
    judge(attack, attack.act(tmp_path, request.config.getoption("--attacks")))

"""Hostile studies and templates: refused, and named; nothing of them becomes code."""

from pathlib import Path

import pytest
from attack.case import Attack
from attack.studies import study_attacks
from attack.templates import template_attacks

pytestmark = [pytest.mark.attack, pytest.mark.engine, pytest.mark.slow]


def attacks(seed: int) -> list[Attack]:
    return [*study_attacks(seed), *template_attacks(seed)]


def test_it_is_refused(attack: Attack, tmp_path: Path, judge) -> None:
    judge(attack, attack.act(tmp_path))

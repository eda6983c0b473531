"""Fuzzed dumps, tables and meshes: the right values, or an error that names the file."""

from pathlib import Path

import pytest
from attack.calls import main_of
from attack.fuzz import FUZZES
from attack.ground import SEED

FEW, MANY = 150, 3000
"""Examples of each fuzz in the sample, and in the whole suite."""


@pytest.mark.engine
@pytest.mark.slow
@pytest.mark.attack(sample=3)
@pytest.mark.parametrize("attack", FUZZES, ids=[f"fuzzed {name}" for name in FUZZES])
def test_it_is_read_rightly_or_refused(
    attack: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    examples = MANY if request.config.getoption("--attacks") else FEW
    said = main_of("fuzz", (attack, SEED, examples), tmp_path, 300.0)
    assert said.status == 0, said.tail

"""What the attacks share: the study that is attacked, and how a result is noted."""

from collections.abc import Callable
from pathlib import Path

import pytest
from attack.case import Attack, Got, Row
from attack.ground import CleanRuns, Ground, shared_ground
from attack.kills import Arena
from attack.table import note


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Parametrise a test by the attacks that its module makes from the seed."""
    if "attack" in metafunc.fixturenames:
        attacks = metafunc.module.attacks(metafunc.config.getoption("--attack-seed"))
        ids = [f"{attack.kind}-{number}" for number, attack in enumerate(attacks)]
        metafunc.parametrize("attack", attacks, ids=ids)


@pytest.fixture(scope="session")
def ground(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Ground:
    """The study that is attacked, made undisturbed."""
    return shared_ground(tmp_path_factory.getbasetemp(), worker_id)


@pytest.fixture(scope="session")
def clean(ground: Ground) -> CleanRuns:
    """What resumed runs must give."""
    cache = ground.root.parent / "clean"
    cache.mkdir(exist_ok=True)
    return CleanRuns(ground, cache)


@pytest.fixture
def arena(tmp_path: Path, ground: Ground, clean: CleanRuns) -> Arena:
    return Arena(tmp_path, ground, clean)


Judge = Callable[[Attack, Got], None]


@pytest.fixture
def judge(request: pytest.FixtureRequest) -> Judge:
    """Note what came of an attack; anything unexpected fails the test."""

    def judged(attack: Attack, got: Got) -> None:
        row = Row.of(attack, got)
        note(row, request)
        if row.state == "not run":
            pytest.skip(got.outcome)
        assert row.state == "as expected", (
            f"{attack}\nexpected: {row.expected}\ngot: {got.outcome}\n{got.seen}"
        )

    return judged

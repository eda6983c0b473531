"""What the attacks share: their parameters, the sample of them, and the study that is attacked."""

import random
from pathlib import Path

import pytest
from attack.arena import Arena
from attack.ground import CleanRuns, Ground, shared_ground


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Parametrise a test by the rows of its marker, which may be made from the seed."""
    if marker := metafunc.definition.get_closest_marker("attack"):
        rows = marker.kwargs["rows"]
        if callable(rows):
            rows = rows(metafunc.config.getoption("--attack-seed"))
        metafunc.parametrize("attack", rows.values(), ids=rows.keys())


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a sample of each test's attacks, unless all are wanted or one is named."""
    tests: dict[object, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("attack"):
            tests.setdefault(item.function, []).append(item)  # type: ignore[attr-defined]
    if config.getoption("--attacks") or sum(map(len, tests.values())) < 2:
        return
    chance = random.Random(config.getoption("--attack-seed"))
    gone = set()
    for found in tests.values():
        kept = min(len(found), found[0].get_closest_marker("attack").kwargs["sample"])
        gone |= set(found) - set(chance.sample(found, kept))
    config.hook.pytest_deselected(items=list(gone))
    items[:] = [item for item in items if item not in gone]


@pytest.fixture(scope="session")
def seed(request: pytest.FixtureRequest) -> int:
    """The seed of every random choice."""
    return request.config.getoption("--attack-seed")


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

"""What the attacks share: the sample of them, the study that is attacked, and a small disk."""

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from attack.disk import Disk, small_disk
from attack.ground import SEED, Undisturbed, undisturbed

FOLDER = Path(__file__).parent


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a sample of each test's attacks, unless all are wanted or one is named.

    Only the first file is run at the start: another process would wait for the study.
    """
    of_attacks = [item for item in items if item.path.parent == FOLDER]
    items.sort(key=lambda item: item in of_attacks and item.path != of_attacks[0].path)
    tests: dict[object, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("attack"):
            tests.setdefault(item.function, []).append(item)  # type: ignore[attr-defined]
    if config.getoption("--attacks") or sum(map(len, tests.values())) < 2:
        return
    chance = random.Random(SEED)
    gone = set()
    for found in tests.values():
        kept = min(len(found), found[0].get_closest_marker("attack").kwargs["sample"])
        gone |= set(found) - set(chance.sample(found, kept))
    config.hook.pytest_deselected(items=list(gone))
    items[:] = [item for item in items if item not in gone]


@pytest.fixture(scope="session")
def study(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Undisturbed:
    """The study that is attacked, made undisturbed."""
    base = tmp_path_factory.getbasetemp()
    folder = (base if worker_id == "master" else base.parent) / "attacked"
    folder.mkdir(exist_ok=True)
    return undisturbed(folder)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk | None]:
    """A small disk; None where none can be mounted."""
    with small_disk(tmp_path) as mounted:
        yield mounted


@pytest.fixture
def target(tmp_path: Path, disk: Disk | None) -> Path:
    """A folder to be, for a project, on a small disk where one can be mounted."""
    return (disk.folder if disk else tmp_path) / "project"

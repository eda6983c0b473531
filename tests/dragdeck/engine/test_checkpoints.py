"""Which checkpoints count, and which are kept aside."""

import os
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dragdeck.engine import checkpoints
from dragdeck.engine.checkpoints import (
    checkpoint_files,
    checkpoint_step,
    drop_old_checkpoints,
    is_whole,
    name_whole_checkpoints,
    newest_checkpoint,
)
from dragdeck.engine.reports import silent


def restart(ranks: list[list[int]], head: bytes = b"LIGGGHTS header") -> bytes:
    """A restart file: for each rank its particles, each of so many doubles."""
    content = head
    for particles in ranks:
        values = [value for n in particles for value in (float(n), *[0.0] * (n - 2), 1.5)]
        content += struct.pack(f"<i{len(values)}d", len(values), *values)
    return content


PARTICLES = st.lists(st.integers(2, 30), max_size=6)


@given(st.lists(PARTICLES, min_size=1, max_size=4), st.binary(min_size=1, max_size=40), st.data())
def test_a_file_is_whole_only_to_its_last_byte(
    tmp_path_factory: pytest.TempPathFactory,
    ranks: list[list[int]],
    head: bytes,
    data: st.DataObject,
) -> None:
    file = tmp_path_factory.mktemp("whole") / "checkpoint.5.restart"
    content, count = restart(ranks, head), sum(map(len, ranks))
    file.write_bytes(content)
    assert is_whole(file, count, len(ranks))
    if count:
        assert not is_whole(file, count + 1, len(ranks))
        file.write_bytes(content[: -data.draw(st.integers(1, len(content) - 1), "cut")])
        assert not is_whole(file, count, len(ranks))
        file.write_bytes(b"")
        assert not is_whole(file, count, len(ranks))


@pytest.mark.parametrize("ranks", [1, 4])
@pytest.mark.parametrize("cut", [0, 4096])
def test_the_size_of_a_checkpoint_needs_no_memory(tmp_path: Path, ranks: int, cut: int) -> None:
    particles, doubles = 40_000, 50
    values = np.zeros((particles, doubles), "<f8")
    values[:, 0] = doubles
    chunk = struct.pack("<i", values.size) + values.tobytes()
    file = tmp_path / "checkpoint.5.restart"
    file.write_bytes(b"header" + chunk * ranks)
    os.truncate(file, file.stat().st_size - cut)
    assert file.stat().st_size > 15e6 * ranks
    tracemalloc.start()
    try:
        assert is_whole(file, particles * ranks, ranks) == (cut == 0)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_a_file_that_has_not_grown_is_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content, file = restart([[20, 20, 20]]), tmp_path / "checkpoint.7.restart"
    looks: list[int] = []

    def look(file: Path, particles: int, ranks: int) -> bool:
        looks.append(file.stat().st_size)
        return is_whole(file, particles, ranks)

    monkeypatch.setattr(checkpoints, "is_whole", look)
    sizes: dict[str, int] = {}
    for size in (100, 200, len(content)):
        file.write_bytes(content[:size])
        for _ in range(3):
            name_whole_checkpoints(tmp_path, 3, 1, sizes)
    assert looks == [100, 200, len(content)]
    assert not file.exists()
    assert [checkpoint_step(file) for file in checkpoint_files(tmp_path)] == [7]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three checkpoints of three particles, of which the last was cut short by a full disk."""
    for step in (9, 10, 200):
        (tmp_path / f"checkpoint.{step}.restart").write_bytes(restart([[20, 20, 20]]))
    name_whole_checkpoints(tmp_path, 3, 1)
    (tmp_path / "checkpoint.3000.restart").write_bytes(restart([[20, 20, 20]])[:-8])
    return tmp_path


def test_a_damaged_checkpoint_is_kept_aside_and_the_one_before_counts(folder: Path) -> None:
    os.utime(next(folder.glob("checkpoint.10.*")))  # the clock decides nothing
    lines: list[str] = []
    newest = newest_checkpoint(folder, 3, 1, 9999, lines.append)
    assert newest is not None and checkpoint_step(newest) == 200
    assert lines == ["checkpoint.3000.restart is damaged, and was moved to damaged/"]
    flipped = bytearray(newest.read_bytes())
    flipped[40] ^= 1
    newest.write_bytes(flipped)
    older = newest_checkpoint(folder, 3, 1, 9999, silent)
    assert older is not None and checkpoint_step(older) == 10
    assert len(list((folder / "damaged").iterdir())) == 2


def test_a_checkpoint_behind_a_gap_is_of_no_use(folder: Path) -> None:
    newest = newest_checkpoint(folder, 3, 1, 10, silent)
    assert newest is not None and checkpoint_step(newest) == 9
    assert newest_checkpoint(folder, 3, 1, 9, silent) is None
    assert len(checkpoint_files(folder)) == 3


def test_old_checkpoints_go_only_when_newer_ones_count(folder: Path) -> None:
    drop_old_checkpoints(folder)
    assert [checkpoint_step(file) for file in checkpoint_files(folder)] == [10, 200, 3000]

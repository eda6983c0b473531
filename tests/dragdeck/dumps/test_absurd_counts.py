"""Headers that promise more than any file holds: named at once, and nothing is allocated."""

import struct
import tracemalloc
from pathlib import Path

import pytest

from dragdeck.dumps.reader import read_dump
from dragdeck.errors import DumpError

_MOST_BYTES = 100_000_000


def text(step: str = "5", rows: str = "1") -> bytes:
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{rows}\nITEM: BOX BOUNDS ff ff ff\n"
    return (head + 3 * "0 1\n" + "ITEM: ATOMS id x\n1 0.5\n").encode()


def binary(rows: int = 1, ranks: int = 1, count: int = 2) -> bytes:
    head = struct.pack("<qqi6i6d2i", 5, rows, 0, *[0] * 6, *[0.0] * 6, 2, ranks)
    return head + struct.pack("<i2d", count, 1.0, 0.5)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.dump", text(rows="9" * 12)),
        ("a.dump", text(rows="9" * 30)),
        ("a.dump", text(rows="9" * 5000)),
        ("a.dump", text(step="9" * 30)),
        ("a.bin", binary(rows=10**12)),
        ("a.bin", binary(rows=2**62)),
        ("a.bin", binary(ranks=10**6)),
        ("a.bin", binary(count=2**31 - 2)),
    ],
)
def test_is_an_error_and_no_memory(tmp_path: Path, name: str, content: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    columns = ["id", "x"] if ".bin" in name else None
    tracemalloc.start()
    try:
        with pytest.raises(DumpError):
            list(read_dump(file, columns))
        assert tracemalloc.get_traced_memory()[1] < _MOST_BYTES
    finally:
        tracemalloc.stop()

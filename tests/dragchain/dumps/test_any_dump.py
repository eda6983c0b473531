"""Dumps without a run folder: every form of file, every way in which one can be spoilt."""

import bz2
import gzip
import random
import subprocess
import sys
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_run import Raw
from spoilt_dumps import NAMES, ROWS, SPOILT, binary, spoilt, text

from dragchain.dumps.any_dump import dump_files, layout_of, read_dump
from dragchain.dumps.careful_reader import read_carefully
from dragchain.dumps.fast_reader import file_blocks, read_batches
from dragchain.errors import DumpError, TruncatedDumpError
from dragchain.tables.convert import dump_to_parquet

COMPRESS = {
    "": bytes,
    ".gz": gzip.compress,
    ".zst": lambda content: pa.Codec("zstd").compress(content, asbytes=True),
    ".bz2": bz2.compress,
}


def head(step, rows, names) -> str:
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{rows}\n"
        f"ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS {names} \n"
    )


def as_lists(frames):
    """Step and rows of frames, in the order in which they come."""
    return [
        (frame.step, [list(row) for row in zip(*frame.columns.values(), strict=True)])
        for frame in frames
    ]


def expected(text_precision=True):
    def value(number):
        return float(f"{number:.9g}") if text_precision else number

    return [(step, [[row[0], *map(value, row[1:])] for row in rows]) for step, rows in ROWS.items()]


def frames_of(source: Path, block_bytes: int, names=None):
    """Frames as `read_dump` gives them, from blocks of a size."""
    files = dump_files(source)
    batches = read_batches(files, layout_of(files[0], names), block_bytes=block_bytes)
    return (frame for batch in batches for frame in batch.frames())


in_blocks = pytest.mark.parametrize("size", [1 << 20, 150, 700], ids="blocks of {}".format)


@in_blocks
@pytest.mark.parametrize("suffix", [".gz", ".zst", ".bz2", ""])
@pytest.mark.parametrize("kind", ["custom", "local"])
def test_reads_text_by_its_header(tmp_path: Path, raw, suffix, kind, size) -> None:
    file = tmp_path / f"a.dump{suffix}"
    file.write_bytes(COMPRESS[suffix](text(raw, kind=kind)))
    frames = list(frames_of(file, size))
    assert as_lists(frames) == expected()
    assert list(frames[0].columns) == list(NAMES)
    assert [frame.opening for frame in frames] == [True, False, False, False]
    assert {name: values.dtype for name, values in frames[1].columns.items()} == {
        "id": np.int64,
        "x": np.float64,
        "c_f[1]": np.float64,
    }


@in_blocks
@pytest.mark.parametrize("suffix", [".gz", ".zst", ""])
def test_reads_binary_by_the_names_given(tmp_path: Path, raw, suffix, size) -> None:
    file = tmp_path / f"a.bin{suffix}"
    steps = enumerate(ROWS.items(), 1)
    content = b"".join(raw.binary(step, rows, 3, ranks) for ranks, (step, rows) in steps)
    file.write_bytes(COMPRESS[suffix](content))
    found = as_lists(frames_of(file, size, NAMES))
    assert [(step, sorted(rows)) for step, rows in found] == [
        (step, sorted(rows)) for step, rows in expected(False)
    ]


def test_a_binary_dump_needs_names(tmp_path: Path, raw) -> None:
    (tmp_path / "a.bin").write_bytes(binary(raw))
    with pytest.raises(DumpError, match="does not contain the names of its columns"):
        next(read_dump(tmp_path / "a.bin"))


@in_blocks
def test_columns_may_come_in_any_order_even_within_a_file(tmp_path: Path, raw, size) -> None:
    turned = ("c_f[1]", "id", "x")
    (tmp_path / "a.dump").write_bytes(text(raw, [0, 7]) + text(raw, [14, 21], turned))
    assert as_lists(frames_of(tmp_path / "a.dump", size)) == expected()
    (tmp_path / "a.dump").write_bytes(text(raw, ROWS, turned))
    assert as_lists(frames_of(tmp_path / "a.dump", size, NAMES)) == expected()


def test_other_columns_are_an_error(tmp_path: Path, raw) -> None:
    (tmp_path / "a.dump").write_bytes(text(raw, [0]) + text(raw, [14], ("id", "x")))
    frames = read_dump(tmp_path / "a.dump")
    assert next(frames).step == 0
    with pytest.raises(DumpError, match="names the columns id x") as caught:
        next(frames)
    assert caught.value.frame == 1


@in_blocks
def test_reads_one_frame_a_file_in_the_order_of_the_steps(tmp_path: Path, raw, size) -> None:
    for step in ROWS:
        (tmp_path / f"a.{step}.dump").write_bytes(text(raw, [step]))
        (tmp_path / f"b.{step}.bin").write_bytes(raw.binary(step, ROWS[step], 3, 1))
    (tmp_path / "a.x.dump").touch()
    assert as_lists(frames_of(tmp_path / "a.*.dump", size)) == expected()
    assert as_lists(frames_of(tmp_path / "b.*.bin", size, NAMES)) == expected(False)
    assert all(frame.opening for frame in frames_of(tmp_path / "a.*.dump", size))


def test_an_error_in_one_of_many_files_names_it(tmp_path: Path, raw) -> None:
    for step in ROWS:
        (tmp_path / f"a.{step}.dump").write_bytes(text(raw, [step]))
    (tmp_path / "a.14.dump").write_bytes(text(raw, [14])[:-3])
    frames = read_dump(tmp_path / "a.*.dump")
    assert [next(frames).step, next(frames).step] == [0, 7]
    with pytest.raises(TruncatedDumpError, match=r"a\.14\.dump, frame 0, byte 0"):
        next(frames)


def test_no_file_is_an_error(tmp_path: Path) -> None:
    for name in ("a.dump", "a.*.dump"):
        with pytest.raises(DumpError, match="no such file"):
            dump_files(tmp_path / name)


@in_blocks
@pytest.mark.parametrize("suffix", ["", ".gz"])
@pytest.mark.parametrize(
    ("what", "goes_on"),
    [*((what, False) for what in SPOILT), *((what, True) for what in SPOILT if "cut" not in what)],
)
def test_what_is_spoilt_is_named_and_what_came_before_kept(
    tmp_path: Path, raw, what, suffix, goes_on, size
) -> None:
    name, content, message = spoilt(raw)[what]
    write = binary if name.endswith(".bin") else text
    before, after = write(raw, [0, 7]), write(raw, [21]) if goes_on else b""
    file, table = tmp_path / f"{name}{suffix}", tmp_path / "a.parquet"
    file.write_bytes(COMPRESS[suffix](before + content + after))
    names = NAMES if name.endswith(".bin") else None
    frames = frames_of(file, size, names)
    assert [next(frames).step, next(frames).step] == [0, 7]
    with pytest.raises(DumpError, match=message) as caught:
        next(frames)
    assert isinstance(caught.value, TruncatedDumpError) == ("the file ends" in str(caught.value))
    assert (caught.value.file, caught.value.frame, caught.value.offset) == (file, 2, len(before))
    assert f"{file}, frame 2, byte {len(before)}: " in str(caught.value)
    assert "kept: the 2 frames before it" in str(caught.value)
    with pytest.raises(DumpError, match=f"kept: 2 frames, which are in {table}"):
        dump_to_parquet(file, table, names)
    assert pq.read_table(table)["step"].to_pylist() == [0, 0, 0]


def test_every_kind_of_spoilt_file_is_tested(raw) -> None:
    assert sorted(SPOILT) == sorted(spoilt(raw))


SHORT = "ended before the end|Truncated compressed"


@pytest.mark.parametrize(("suffix", "least"), [(".gz", 9), (".zst", 0)])
def test_a_compressed_file_cut_short_is_an_error_after_its_whole_frames(
    tmp_path: Path, raw, suffix, least
) -> None:
    rows = np.random.default_rng(1).normal(size=(20, 500, 3))
    rows[:, :, 0] = np.arange(500)
    content = [raw.text(step, rows[step].tolist(), NAMES, "custom") for step in range(20)]
    packed = COMPRESS[suffix](b"".join(content))
    (tmp_path / f"a.dump{suffix}").write_bytes(packed[: len(packed) // 2])
    kept = []
    with pytest.raises(TruncatedDumpError, match=SHORT) as caught:
        kept.extend(read_dump(tmp_path / f"a.dump{suffix}"))
    assert [frame.step for frame in kept] == list(range(caught.value.frame))
    assert caught.value.offset == sum(map(len, content[: len(kept)]))
    assert len(kept) >= least


def test_a_compressed_file_that_only_lacks_its_end_is_an_error(tmp_path: Path, raw) -> None:
    (tmp_path / "a.dump.gz").write_bytes(gzip.compress(text(raw))[:-8])
    with pytest.raises(TruncatedDumpError, match=SHORT):
        list(read_dump(tmp_path / "a.dump.gz"))


def test_a_compressed_file_without_content_is_an_error_if_it_is_cut(tmp_path: Path, raw) -> None:
    (tmp_path / "a.bin.gz").write_bytes(gzip.compress(binary(raw))[:10])
    with pytest.raises(TruncatedDumpError, match="frame 0, byte 0: the file ends after 0 bytes"):
        list(read_dump(tmp_path / "a.bin.gz", NAMES))


@pytest.mark.parametrize("name", ["a.bin", "a.bin.gz", "a.dump", "a.dump.gz"])
def test_a_spoilt_frame_does_not_make_a_block_grow(tmp_path: Path, raw, name) -> None:
    """Ranks that do not add up, or a count too small, before very many frames."""
    if "bin" in name:
        spoilt = bytearray(raw.binary(0, ROWS[0], 3, 1))
        spoilt[8] = 2
        content = bytes(spoilt) + raw.binary(7, ROWS[0], 3) * 9000
    else:
        content = text(raw, [0]) + b"1 2 3 \n" * 99_000
    file = tmp_path / name
    file.write_bytes(COMPRESS[file.suffix if file.suffix == ".gz" else ""](content))
    output = layout_of(file, NAMES if "bin" in name else None)
    found = list(file_blocks(file, output, 8192))
    assert found[-1].stuck
    assert max(len(block.buffer) for block in found) < 40_000
    with pytest.raises(DumpError, match="frame 0"):
        list(frames_of(file, 8192, NAMES if "bin" in name else None))


ODD = ["1 2.5 3", "1  2.5 3 ", "\t1 2.5\t3", "1 +2.5 3", "1.0 2.5 3 ", "1 2.5E0 3 ", "1 .5 3. "]
words = st.one_of(
    st.sampled_from(ODD),
    st.tuples(st.integers(-9, 2**40), st.floats(allow_nan=False, allow_infinity=False)).map(
        lambda pair: f"{pair[0]} {pair[1]!r} {pair[1]:.9g} "
    ),
)


@given(frames=st.lists(st.lists(words, max_size=5), max_size=8), size=st.integers(100, 900))
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_the_fast_way_gives_what_the_careful_way_gives(tmp_path: Path, frames, size) -> None:
    file = tmp_path / "a.dump"
    file.write_bytes(
        b"".join(
            head(step, len(rows), "id x y").encode() + "".join(f"{row}\n" for row in rows).encode()
            for step, rows in enumerate([["1 2 3"], *frames])
        )
    )
    output = layout_of(file, None)
    fast = frames_of(file, size)
    for one, other in zip_longest(fast, read_carefully(file, output)):
        assert (one.step, one.opening) == (other.step, other.opening)
        for name, values in other.columns.items():
            assert one.columns[name].tobytes() == values.tobytes()


def test_a_large_text_is_read_bit_for_bit(tmp_path: Path) -> None:
    random.seed(3)
    values = np.frombuffer(random.randbytes(8 * 300_000), dtype=np.float64)
    values = values[np.isfinite(values) & (np.abs(values) > 2.3e-308)][:240_000].reshape(-1, 3)
    lines = [f"{one!r} {two:.17g} {three:.9g} \n" for one, two, three in values.tolist()]
    (tmp_path / "a.dump").write_text(head(1, len(lines), "x y z") + "".join(lines))
    (frame,) = read_dump(tmp_path / "a.dump")
    words = [line.split() for line in lines]
    for place, name in enumerate("xyz"):
        assert frame.columns[name].tolist() == [float(row[place]) for row in words]


def test_a_table_of_all_frames(tmp_path: Path, raw) -> None:
    (tmp_path / "a.dump").write_bytes(text(raw))
    assert dump_to_parquet(tmp_path / "a.dump", tmp_path / "a.parquet") == 4
    table = pq.read_table(tmp_path / "a.parquet")
    assert table.column_names == ["step", *NAMES]
    assert table["step"].to_pylist() == [0, 0, 0, 14, 21, 21]
    assert table["id"].to_pylist() == [3, 1, 2, 1, 2, 1]
    assert table["x"].to_pylist() == [row[1] for _, rows in expected() for row in rows]


PEAK = """
import re, sys
from pathlib import Path
from dragchain.tables.convert import dump_to_parquet
def peak():
    status = Path("/proc/self/status").read_text()
    return 1024 * int(re.search(r"VmHWM:\\s*(\\d+)", status).group(1))
names = sys.argv[1:]
for size in ("small", "large"):
    for kind in ("dump", "bin", "dump.gz"):
        columns = names if kind == "bin" else None
        dump_to_parquet(f"{size}.{kind}", f"{size}.{kind}.parquet", columns)
        print(peak())
"""
KINDS = ["dump", "bin", "dump.gz"]
LARGE = 300


@pytest.fixture(scope="module")
def peaks(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[int]]:
    """Folder of tables of small and twelve times larger dumps; peaks of memory on the way, B."""
    folder = tmp_path_factory.mktemp("dumps")
    rows = np.random.default_rng(1).normal(size=(12_000, 3))
    rows[:, 0] = np.arange(len(rows))
    text = Raw.text(5, rows.tolist(), NAMES, "custom")
    frames = text, Raw.binary(5, rows.tolist(), 3), gzip.compress(text, 1)
    for kind, frame in zip(KINDS, frames, strict=True):
        (folder / f"small.{kind}").write_bytes(frame * (LARGE // 12))
        (folder / f"large.{kind}").write_bytes(frame * LARGE)
    command = [sys.executable, "-c", PEAK, *NAMES]
    found = subprocess.check_output(command, cwd=folder, text=True)
    return folder, [int(line) for line in found.split()]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_memory_does_not_grow_with_the_file(peaks, kind) -> None:
    """Twelve times the frames may not take more than a few row groups more."""
    folder, found = peaks
    before, after = found[len(KINDS) - 1], found[len(KINDS) + KINDS.index(kind)]
    table = pq.ParquetFile(folder / f"large.{kind}.parquet")
    assert table.metadata.num_rows == LARGE * 12_000
    assert after < 500e6
    assert after - before < 60e6

"""Dumps without a run folder: every form of file, every way in which one can be spoilt."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from made_run import Raw
from spoilt_dumps import NAMES, ROWS, SPOILT, binary, text

from dragdeck.dumps import content
from dragdeck.dumps.reader import dump_files, read_dump
from dragdeck.errors import DumpError, TruncatedDumpError


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


@pytest.fixture(params=[content.BUFFER_BYTES, 16, 150], ids="buffer of {}".format)
def buffer(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A buffer that holds the file, or ends within lines, numbers and frames."""
    monkeypatch.setattr(content, "BUFFER_BYTES", request.param)


with_buffers = pytest.mark.usefixtures("buffer")


@with_buffers
@pytest.mark.parametrize("kind", ["custom", "local"])
def test_reads_text_by_its_header(tmp_path: Path, kind) -> None:
    file = tmp_path / "a.dump"
    file.write_bytes(text(kind=kind))
    frames = list(read_dump(file))
    assert as_lists(frames) == expected()
    assert list(frames[0].columns) == list(NAMES)
    assert [frame.opening for frame in frames] == [True, False, False, False]
    assert {name: values.dtype for name, values in frames[1].columns.items()} == {
        "id": np.int64,
        "x": np.float64,
        "c_f[1]": np.float64,
    }


@with_buffers
def test_reads_binary_by_the_names_given(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    steps = enumerate(ROWS.items(), 1)
    file.write_bytes(b"".join(Raw.binary(step, rows, 3, ranks) for ranks, (step, rows) in steps))
    found = as_lists(read_dump(file, NAMES))
    assert [(step, sorted(rows)) for step, rows in found] == [
        (step, sorted(rows)) for step, rows in expected(False)
    ]


def test_a_binary_dump_needs_names(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(binary())
    with pytest.raises(DumpError, match="does not contain the names of its columns"):
        next(read_dump(tmp_path / "a.bin"))


@with_buffers
def test_columns_may_come_in_any_order_even_within_a_file(tmp_path: Path) -> None:
    turned = ("c_f[1]", "id", "x")
    (tmp_path / "a.dump").write_bytes(text([0, 7]) + text([14, 21], turned))
    assert as_lists(read_dump(tmp_path / "a.dump")) == expected()
    (tmp_path / "a.dump").write_bytes(text(ROWS, turned))
    assert as_lists(read_dump(tmp_path / "a.dump", NAMES)) == expected()


def test_other_columns_are_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.dump").write_bytes(text([0]) + text([14], ("id", "x")))
    frames = read_dump(tmp_path / "a.dump")
    assert next(frames).step == 0
    with pytest.raises(DumpError, match="names the columns id x") as caught:
        next(frames)
    assert caught.value.frame == 1


@with_buffers
def test_reads_one_frame_a_file_in_the_order_of_the_steps(tmp_path: Path) -> None:
    for step in ROWS:
        (tmp_path / f"a.{step}.dump").write_bytes(text([step]))
        (tmp_path / f"b.{step}.bin").write_bytes(Raw.binary(step, ROWS[step], 3, 1))
    (tmp_path / "a.x.dump").touch()
    assert as_lists(read_dump(tmp_path / "a.*.dump")) == expected()
    assert as_lists(read_dump(tmp_path / "b.*.bin", NAMES)) == expected(False)
    assert all(frame.opening for frame in read_dump(tmp_path / "a.*.dump"))


def test_an_error_in_one_of_many_files_names_it(tmp_path: Path) -> None:
    for step in ROWS:
        (tmp_path / f"a.{step}.dump").write_bytes(text([step]))
    (tmp_path / "a.14.dump").write_bytes(text([14])[:-3])
    frames = read_dump(tmp_path / "a.*.dump")
    assert [next(frames).step, next(frames).step] == [0, 7]
    with pytest.raises(TruncatedDumpError, match=r"a\.14\.dump, frame 0, byte 0"):
        next(frames)


def test_no_file_is_an_error(tmp_path: Path) -> None:
    for name in ("a.dump", "a.*.dump"):
        with pytest.raises(DumpError, match="no such file"):
            dump_files(tmp_path / name)


@with_buffers
@pytest.mark.parametrize(
    ("what", "goes_on"),
    [*((what, False) for what in SPOILT), *((what, True) for what in SPOILT if "cut" not in what)],
)
def test_what_is_spoilt_is_named_and_what_came_before_kept(tmp_path: Path, what, goes_on) -> None:
    name, content, message = SPOILT[what]
    write = binary if name.endswith(".bin") else text
    before, after = write([0, 7]), write([21]) if goes_on else b""
    file = tmp_path / name
    file.write_bytes(before + content + after)
    names = NAMES if name.endswith(".bin") else None
    frames = read_dump(file, names)
    assert [next(frames).step, next(frames).step] == [0, 7]
    with pytest.raises(DumpError, match=message) as caught:
        next(frames)
    assert isinstance(caught.value, TruncatedDumpError) == ("the file ends" in str(caught.value))
    assert (caught.value.file, caught.value.frame, caught.value.offset) == (file, 2, len(before))
    assert f"{file}, frame 2, byte {len(before)}: " in str(caught.value)
    assert "kept:   the 2 frames before it" in str(caught.value)


def test_a_compressed_dump_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.dump.gz").write_bytes(gzip.compress(text()))
    with pytest.raises(DumpError, match="not compressed"):
        next(read_dump(tmp_path / "a.dump.gz"))

"""Dumps without a run folder: every form of file, every way in which one can be spoilt."""

import gzip
import struct
from pathlib import Path

import numpy as np
import pytest
from made_run import Raw
from spoilt_dumps import NAMES, ROWS, SPOILT, binary, text

from dragdeck.dumps import content
from dragdeck.dumps.reader import DumpLayout, dump_files, layout_of, read_dump, read_frames
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
    kinds = [values.dtype for values in frames[1].columns.values()]
    assert kinds == [np.int64, np.float64, np.float64]


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


class OwnLayout(DumpLayout):
    """That of an output of dragdeck's own scripts, which has finite numbers only."""

    foreign = False


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
    layout = layout_of(file, NAMES if name.endswith(".bin") else None)
    frames = read_frames([file], OwnLayout(layout.kind, layout.columns, layout.binary))
    assert [next(frames).step, next(frames).step] == [0, 7]
    with pytest.raises(DumpError, match=message) as caught:
        next(frames)
    assert isinstance(caught.value, TruncatedDumpError) == ("the file ends" in str(caught.value))
    assert (caught.value.file, caught.value.frame, caught.value.offset) == (file, 2, len(before))
    assert f"{file}, frame 2, byte {len(before)}: " in str(caught.value)
    assert "kept:   the 2 frames before it" in str(caught.value)


# --- dumps of any script ------------------------------------------------------------------------


def head(names: str, rows: int = 1, before: str = "") -> str:
    return (
        f"{before}ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n{rows}\nITEM: BOX BOUNDS ff ff ff\n"
        f"-1 1\n-1 1\n0 2\nITEM: ATOMS {names} \n"
    )


@pytest.mark.parametrize(
    ("written", "columns"),
    [
        (head("id type type x") + "3 1 1 0.5 \n", {"id": [3], "type": [1], "x": [0.5]}),
        (head("id x", 1, "ITEM: UNITS\nsi\nITEM: TIME\n0.1\n") + "3 1\n", {"id": [3], "x": [1]}),
        (head("id x") + "3 nan \n", {"id": [3], "x": [np.nan]}),
        (head("id x") + "3 -inf \n", {"id": [3], "x": [-np.inf]}),
        (head("id element", 2) + "3 Si\n4 O\n", {"id": [3, 4], "element": ["Si", "O"]}),
        (head("id v_grain_id") + "3 0.5 \n", {"id": [3], "v_grain_id": [0.5]}),
        (head("id element", 0), {"id": [], "element": []}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("packed", [False, True])
@with_buffers
def test_what_scripts_of_users_write_is_read(tmp_path, written, columns, packed) -> None:
    file = tmp_path / ("a.dump.gz" if packed else "a.dump")
    data = 3 * written.encode()
    file.write_bytes(gzip.compress(data) if packed else data)
    frames = list(read_dump(file))
    assert [frame.step for frame in frames] == [7, 7, 7]
    for frame in frames:
        assert list(frame.columns) == list(columns)
        for name, values in columns.items():
            np.testing.assert_array_equal(frame.columns[name], values)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [("3 0.5", "4 0.5x", r"row 0: found b'4 0.5x\\n'"), ("3 0.5", "4.5 0.5", "row 0: id is 4.5")],
)
def test_a_column_keeps_its_type(tmp_path: Path, before: str, after: str, message: str) -> None:
    file = tmp_path / "a.dump"
    file.write_text(f"{head('id x', 0)}{head('id x')}{before}\n{head('id x')}{after}\n")
    frames = read_dump(file)
    assert [next(frames).rows, next(frames).rows] == [0, 1]
    with pytest.raises(DumpError, match=message):
        next(frames)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        (head("id x x") + "3 0.5 0.25\n", "row 0: x is 0.5 and 0.25"),
        (head("id element x x") + "3 Si 0.5 0.25\n", "row 0: x is b'0.5' and b'0.25'"),
        (head("id x", 2) + "3 1\n9007199254740993 1\n", "row 1: id is 9007199254740992"),
    ],
)
def test_what_could_be_another_number_is_refused(tmp_path: Path, written: str, message) -> None:
    file = tmp_path / "a.dump"
    file.write_text(written)
    with pytest.raises(DumpError, match=message):
        next(read_dump(file))


def test_a_last_row_without_line_end_is_read_with_a_word(tmp_path: Path) -> None:
    file = tmp_path / "a.dump"
    file.write_text(head("id x", 2) + "3 0.5\n4 0.25")
    with pytest.warns(UserWarning, match="no line end"):
        (frame,) = read_dump(file)
    assert frame.columns["x"].tolist() == [0.5, 0.25]
    file.write_text(head("id x", 2) + "3 0.5\n4 ")
    with pytest.raises(TruncatedDumpError):
        list(read_dump(file))


def revised(
    step: int, rows: list[list[float]], names: str, order: int = 1, time: bool = False
) -> bytes:
    """A frame as LAMMPS writes it since 2020."""
    width = len(names.split())
    parts = [
        struct.pack("<q10sii", -10, b"DUMPCUSTOM", order, 2),
        struct.pack("<qqi6i6d", step, len(rows), 0, *6 * [0], *6 * [0.0]),
        struct.pack("<ii2s?", width, 2, b"si", time), struct.pack("<d", 0.5) * time,
        struct.pack("<i", len(names)), names.encode(), struct.pack("<ii", 1, width * len(rows)),
        *(struct.pack(f"<{width}d", *row) for row in rows),
    ]  # fmt: skip
    return b"".join(parts)


@with_buffers
@pytest.mark.parametrize("time", [False, True])
def test_a_binary_dump_with_names_is_read_by_them(tmp_path: Path, time: bool) -> None:
    file = tmp_path / "a.bin"
    rows = [[3.0, 0.5], [1.0, 0.25]]
    file.write_bytes(revised(7, rows, "id x", time=time) + revised(9, [], "id x", time=time))
    frames = list(read_dump(file))
    assert as_lists(frames) == [(7, rows), (9, [])]
    assert list(frames[0].columns) == ["id", "x"]
    for damaged, message in (
        (revised(7, rows, "id x", order=1 << 24), "byte order"),
        (revised(7, rows, "id x")[:-1], "the file ends"),
        (revised(7, rows, "id x") + revised(9, rows, "id y"), "the columns are id y"),
    ):
        file.write_bytes(damaged)
        with pytest.raises(DumpError, match=message):
            list(read_dump(file))


def test_a_damaged_compressed_dump_is_refused(tmp_path: Path) -> None:
    packed = gzip.compress(text())
    for damaged in (packed[:-9], b"no gzip", packed[:20] + bytes(8) + packed[28:]):
        (tmp_path / "a.dump.gz").write_bytes(damaged)
        with pytest.raises(DumpError, match="not a whole gzip file"):
            next(read_dump(tmp_path / "a.dump.gz"))

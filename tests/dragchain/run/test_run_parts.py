from pathlib import Path

import numpy as np
import pytest
from changed import changed
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from made_run import output_of_run

from dragchain.run.run_parts import iter_frames, iter_prints, output_files
from dragdeck.dumps.reader import read_prints
from dragdeck.errors import DumpError, TruncatedDumpError

PARTICLES = output_of_run("particles", "custom", ("particle_id", "x_m"), 10, 0, 20, binary=True)
FORCE = output_of_run("force", "print", ("step", "force_x_n"), 2, 2, 10)
ROWS = {0: [], 10: [[1, 0.5], [2, 0.25]], 20: [[2, -1.5]]}


def binary_file(raw, steps, width=2):
    return b"".join(raw.binary(step, ROWS[step], width) for step in steps)


def force_file(raw, steps, scale=1.0):
    return raw.prints([[step, scale * step] for step in steps], FORCE.columns)


def steps_of(frames):
    return [frame.step for frame in frames]


def test_a_cut_number_is_not_read_as_another_number(tmp_path: Path, raw) -> None:
    file = tmp_path / "force.1"
    file.write_bytes(b"step force_x_n\n2 1.5\n4 2.25\n6 3.1")
    with pytest.raises(TruncatedDumpError, match="rows before it are intact") as caught:
        list(read_prints(file, FORCE))
    assert (caught.value.frame, caught.value.offset) == (2, 28)


def test_skips_a_header_that_comes_again(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(b"step force_x_n\n2 1\nstep force_x_n\n4 2\n6 3\nstep force_x_n\n")
    blocks = list(read_prints(tmp_path / "f", FORCE))
    np.testing.assert_array_equal(np.concatenate([b["step"] for b in blocks]), [2, 4, 6])
    np.testing.assert_array_equal(np.concatenate([b["force_x_n"] for b in blocks]), [1, 2, 3])


def test_reads_a_print_file_in_blocks(tmp_path: Path, raw) -> None:
    (tmp_path / "f").write_bytes(force_file(raw, range(2, 12, 2)))
    blocks = [b["step"].tolist() for b in read_prints(tmp_path / "f", FORCE, block_rows=2)]
    assert blocks == [[2, 4], [6, 8], [10]]


@pytest.mark.parametrize(
    ("content", "message", "row", "offset"),
    [
        (b"step force_y_n\n2 1\n", "the header is 'step force_y_n'", 0, 0),
        (b"step force_x_n\n2 1\n4 x\n", r"found b'4 x\\n'", 1, 19),
        (b"step force_x_n\n2 1\nstep force_x_n\n4 1 1\n", "found b'4 1 1", 1, 34),
        (b"step force_x_n\n2 1\n4 nan\n", "force_x_n is nan", 1, 19),
        (b"step force_x_n\n4 1\n2 1\n", "the steps go back to 2", 1, 19),
        (b"step force_x_n\n2.5 1\n", "step is 2.5", 0, 15),
    ],
)
def test_refuses_a_spoilt_print_file(tmp_path: Path, content, message, row, offset) -> None:
    (tmp_path / "f").write_bytes(content)
    with pytest.raises(DumpError, match=message) as caught:
        list(read_prints(tmp_path / "f", FORCE))
    assert (caught.value.frame, caught.value.offset) == (row, offset)


def test_parts_are_ordered_by_number(tmp_path: Path) -> None:
    for name in ("force.10", "force.2", "force.1", "force.x", "force.1.bak"):
        (tmp_path / name).touch()
    names = [file.name for file in output_files(tmp_path, FORCE)]
    assert names == ["force.1", "force.2", "force.10"]


def test_an_output_without_a_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="no file of the output force"):
        output_files(tmp_path, FORCE)


def test_the_later_part_counts(tmp_path: Path, raw) -> None:
    (tmp_path / "force.1").write_bytes(force_file(raw, [2, 4, 6, 8]))
    (tmp_path / "force.2").write_bytes(force_file(raw, [6, 8, 10], scale=-1.0))
    values = np.concatenate([block["force_x_n"] for block in iter_prints(tmp_path, FORCE)])
    np.testing.assert_array_equal(values, [2, 4, -6, -8, -10])


def test_a_part_that_starts_earlier_than_the_one_before_it_counts(tmp_path: Path, raw) -> None:
    (tmp_path / "force.1").write_bytes(force_file(raw, [2, 4, 6]))
    (tmp_path / "force.2").write_bytes(force_file(raw, [6, 8], scale=2.0))
    (tmp_path / "force.3").write_bytes(force_file(raw, [4, 6, 8, 10], scale=3.0))
    values = np.concatenate([block["force_x_n"] for block in iter_prints(tmp_path, FORCE)])
    np.testing.assert_array_equal(values, [2, 12, 18, 24, 30])


@pytest.mark.parametrize("cut", [1, 30, 100, 140])
def test_a_cut_frame_that_a_later_part_covers_does_not_matter(tmp_path: Path, raw, cut) -> None:
    (tmp_path / "particles.1").write_bytes(binary_file(raw, [0, 10])[:-cut])
    (tmp_path / "particles.2").write_bytes(binary_file(raw, [10, 20]))
    assert steps_of(iter_frames(tmp_path, PARTICLES)) == [0, 10, 20]


def test_a_part_without_a_whole_frame_does_not_matter_if_covered(tmp_path: Path, raw) -> None:
    (tmp_path / "particles.1").write_bytes(binary_file(raw, [0]))
    (tmp_path / "particles.2").write_bytes(binary_file(raw, [10])[:-4])
    (tmp_path / "particles.3").write_bytes(b"")
    (tmp_path / "particles.4").write_bytes(binary_file(raw, [10, 20]))
    assert steps_of(iter_frames(tmp_path, PARTICLES)) == [0, 10, 20]


@pytest.mark.parametrize(
    ("cut", "parts", "whole"), [(1, ([0, 10], [20]), [0]), (2, ([0, 10], [10, 20]), [0, 10])]
)
def test_a_cut_frame_that_no_later_part_covers_is_an_error(
    tmp_path: Path, raw, cut: int, parts, whole
) -> None:
    for number, steps in enumerate(parts, 1):
        content = binary_file(raw, steps)
        (tmp_path / f"particles.{number}").write_bytes(content[:-1] if number == cut else content)
    frames = iter_frames(tmp_path, PARTICLES)
    assert steps_of([next(frames) for _ in whole]) == whole
    with pytest.raises(TruncatedDumpError) as caught:
        next(frames)
    assert (caught.value.file.name, caught.value.frame) == (f"particles.{cut}", 1)
    assert caught.value.offset == len(binary_file(raw, parts[cut - 1][:1]))


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([0, 20], r"continues with step 20\n  expected: step 10"),
        ([10, 20], r"continues with step 10\n  expected: step 0"),
        ([0, 10], r"ends before step 20\n  expected: frames up to step 20"),
        ([], "ends before step 0"),
    ],
)
def test_a_missing_frame_is_an_error(tmp_path: Path, raw, steps, message) -> None:
    (tmp_path / "particles.1").write_bytes(binary_file(raw, steps))
    with pytest.raises(DumpError, match=message):
        list(iter_frames(tmp_path, PARTICLES))


def test_a_frame_after_the_last_step_is_an_error(tmp_path: Path, raw) -> None:
    (tmp_path / "particles.1").write_bytes(binary_file(raw, [0, 10, 20]))
    with pytest.raises(DumpError, match=r"has step 20\n  expected: no step after 10"):
        list(iter_frames(tmp_path, changed(PARTICLES, last_step=10)))


def test_an_open_output_may_leave_out_steps_but_not_leave_the_grid(tmp_path: Path, raw) -> None:
    output = changed(FORCE, last_step=None)
    (tmp_path / "force.1").write_bytes(force_file(raw, [4, 6, 20]))
    (block,) = iter_prints(tmp_path, output)
    assert block["step"].tolist() == [4, 6, 20]
    (tmp_path / "force.1").write_bytes(force_file(raw, [4, 7]))
    with pytest.raises(DumpError, match="continues with step 7"):
        list(iter_prints(tmp_path, output))


numbers = st.floats(-1e9, 1e9, allow_nan=False, width=64)
frames = st.lists(
    st.integers(0, 6).flatmap(lambda n: arrays.arrays(np.float64, (n, 2), elements=numbers)),
    min_size=1,
    max_size=5,
)
ANY = output_of_run("any", "custom", ("a", "b"), 3, 6, None, binary=True)


@given(values=frames, ranks=st.integers(1, 3), first_part=st.integers(0, 5), redo=st.integers(0, 5))
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_any_frames_dealt_to_any_ranks_and_parts_come_back(
    tmp_path: Path, raw, values, ranks, first_part, redo
) -> None:
    """The first part is stale from frame `redo` on, which the second repeats."""
    last = 6 + 3 * (len(values) - 1)
    output = changed(ANY, last_step=last)
    whole = [raw.binary(6 + 3 * i, v.tolist(), 2, ranks) for i, v in enumerate(values)]
    stale = [raw.binary(6 + 3 * i, [[0.5, 0.5]], 2, 1) for i in range(len(values))]
    redo = min(redo, len(values) - 1)
    first_part = max(redo, min(first_part, len(values)))
    (tmp_path / "any.1").write_bytes(b"".join(whole[:redo] + stale[redo:first_part]))
    (tmp_path / "any.2").write_bytes(b"".join(whole[redo:]))
    read = list(iter_frames(tmp_path, output))
    assert steps_of(read) == list(range(6, last + 1, 3))
    for frame, value in zip(read, values, strict=True):
        dealt = np.concatenate([value[rank::ranks] for rank in range(ranks)])
        np.testing.assert_array_equal(frame.vectors("a", "b"), dealt)

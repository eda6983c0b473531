import numpy as np
import pytest
from made_frames import wall

from dragchain.tables.closure import Closure
from dragchain.tables.workpiece_contacts import WorkpieceFrames


def frame(workpiece, unplaced=(), step=10, opening=False):
    lost = np.array(unplaced, dtype=float).reshape(-1, 3)
    at = np.zeros(len(workpiece), dtype=int), np.zeros(len(lost), dtype=int)
    return WorkpieceFrames(
        np.array([step]), np.array([opening]), workpiece, wall(), at[0], lost, at[1]
    )


def add(check, one, force):
    (used,) = check.add(one, np.array([force], dtype=float))
    return used


def test_forces_that_add_up_pass() -> None:
    check = Closure()
    assert add(check, frame(wall([[1, 0, 0], [0, 2, 0]])), np.array([-1, -2, 0]))
    assert check.problem() is None
    assert (check.record().verdict, check.record().max_n) == ("pass", 0)


def test_a_missing_force_fails_and_is_measured() -> None:
    check = Closure()
    add(check, frame(wall([[3, 0, 0]]), step=10), np.array([-3, 0, 0]))
    add(check, frame(wall([[3, 0, 0]]), step=20), np.array([-4, 0, 0]))
    record = check.record()
    assert record.verdict == "fail"
    assert (record.worst_step, record.max_n, record.max_relative) == (20, 1.0, 0.25)
    assert "at step 20" in str(record.problem)


def test_small_forces_are_measured_against_the_floor() -> None:
    check = Closure()
    add(check, frame(wall()), np.array([-1e-10, 0, 0]))
    assert check.record().max_relative == pytest.approx(1e-7)
    assert check.problem() is None


def test_silent_contacts_are_counted() -> None:
    check = Closure()
    add(check, frame(wall([[1, 0, 0], [0, 0, 0]], silent=[False, True])), [-1, 0, 0])
    assert (check.record().contacts, check.record().silent_contacts) == (2, 1)


def test_a_force_without_a_contact_fails_although_the_sum_is_right() -> None:
    check = Closure()
    add(check, frame(wall(), unplaced=[[0, 0.5, 0]]), np.array([0, -0.5, 0]))
    assert check.record().max_n == 0
    assert "1 forces on particles have no contact" in str(check.problem())


def test_a_frame_that_opens_a_file_is_noted_apart() -> None:
    check = Closure()
    start = frame(wall([[3, 0, 0]]), opening=True)
    assert not add(check, start, np.array([-4, 0, 0]))
    assert add(check, start, np.array([-3, 0, 0]))
    add(check, frame(wall([[3, 0, 0]])), np.array([-3, 0, 0]))
    record = check.record()
    assert (record.verdict, record.frames) == ("pass", 1)
    assert record.opening_frames == 2


def test_nothing_to_compare_fails() -> None:
    check = Closure()
    assert add(check, frame(wall([[1, 0, 0]])), [np.nan] * 3)
    assert "cannot be tested" in str(check.problem())
    assert check.record().worst_step is None

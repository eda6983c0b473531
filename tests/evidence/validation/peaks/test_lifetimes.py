"""Lives of chains made by hand."""

import numpy as np
import pytest

from evidence.validation.peaks.lifetimes import lives, overlap


def test_overlap_is_shared_over_all() -> None:
    assert overlap([1, 2, 3], [2, 3, 4]) == 0.5
    assert overlap([1, 2], [3]) == 0.0
    assert overlap([], []) == 0.0


def test_lives_of_a_sequence_made_by_hand() -> None:
    sequence = [[1, 2, 3], [2, 3, 4], [], [7, 8], [7, 8], [9, 8, 6], [9, 8, 6]]
    found = lives(sequence, 0.01 * np.arange(7))
    assert found.life.tolist() == [0, 0, -1, 1, 1, 2, 2]
    assert found.life_s[[0, 1, 3, 4, 5, 6]] == pytest.approx(np.full(6, 0.02))
    assert np.isnan(found.life_s[2]) and np.isnan(found.age_s[2])
    assert found.age_s[[0, 1, 3, 4]] == pytest.approx([0.0, 0.01, 0.0, 0.01])
    assert found.left_s[[0, 1, 3, 4]] == pytest.approx([0.01, 0.0, 0.01, 0.0])
    assert found.truncated.tolist() == [True, True, False, False, False, True, True]


def test_frames_without_a_chain_have_no_life() -> None:
    found = lives([[], [], []], 0.01 * np.arange(3))
    assert found.life.tolist() == [-1, -1, -1] and np.isnan(found.life_s).all()
    assert not found.truncated.any()

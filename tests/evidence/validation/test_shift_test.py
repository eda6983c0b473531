"""Circular shifts of events against series."""

import math

import numpy as np
import pytest
from chain_runs import FRAMES, INTERVAL_S, wander
from scipy.stats import binom, false_discovery_control

from dragchain.drag import find_drag_peaks
from evidence.validation.shift_test import (
    draw_shifts,
    holm,
    joint,
    shift_test,
    shifted_means,
    standardised,
)


def test_shifted_means_are_means_around_moved_events() -> None:
    rng = np.random.default_rng(3)
    series = rng.normal(size=50)
    series[[3, 4, 20]] = np.nan
    events = np.array([0, 10, 48])
    found = shifted_means(series, events, 2)
    for shift in range(50):
        near = (events[:, None] + shift + np.arange(-2, 3)).ravel() % 50
        assert found[shift] == pytest.approx(np.nanmean(series[near]))


def test_a_frame_without_a_value_counts_in_no_mean() -> None:
    series = np.array([np.nan, 2.0, np.nan, 4.0])
    found = shifted_means(series, np.array([0]), 0)
    assert np.isnan(found[[0, 2]]).all()
    assert found[[1, 3]].tolist() == pytest.approx([2.0, 4.0])


def test_shifts_of_one_run_give_the_exact_p_value() -> None:
    series = np.zeros(100)
    series[[7, 40]] = [1.0, 2.0]
    by_shift = [shifted_means(series, np.array([7]), 0)]
    every = np.arange(100)[:, None]
    found = shift_test(by_shift, every)
    # two shifts of a hundred reach the value, and the true position counts once more
    assert found.value == pytest.approx(1.0)
    assert found.p_greater == pytest.approx(3 / 101)


def test_runs_are_shifted_independently_and_averaged() -> None:
    first, second = np.arange(4.0), np.array([10.0, 20.0])
    found = joint([first, second], np.array([[0, 0], [3, 1], [1, 2]]))
    assert found.tolist() == [5.0, 11.5, 5.5]
    shifts = draw_shifts([4, 2], 500)
    assert shifts.max(axis=0).tolist() == [3, 1]
    assert abs(np.corrcoef(shifts.T)[0, 1]) < 0.15


def test_a_run_without_a_value_is_left_out() -> None:
    found = joint([np.array([np.nan, 1.0]), np.array([2.0, 4.0])], np.array([[0, 0], [1, 1]]))
    assert found.tolist() == [2.0, 2.5]


def test_a_constant_series_has_no_standardised_mean() -> None:
    assert np.isnan(standardised(np.ones(5), np.ones(5))).all()


def test_holm_steps_down() -> None:
    found = holm([0.01, 0.04, 0.03, np.nan, 0.5])
    assert found[[0, 1, 2, 4]].tolist() == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert np.isnan(found[3])
    # never below the adjustment of Benjamini and Hochberg, which controls less
    values = np.array([0.001, 0.2, 0.03, 0.012])
    assert (holm(values) >= false_discovery_control(values)).all()


def test_false_positives_are_as_many_as_the_level_says() -> None:
    sets, level = 200, 0.05
    hits, p_values = 0, []
    for seed in range(sets):
        rng = np.random.default_rng(1000 + seed)
        by_shift = []
        for _ in range(2):
            series, drag = wander(rng), wander(rng)
            events = find_drag_peaks(np.arange(FRAMES) * INTERVAL_S, drag, min_separation_s=0.1)
            means = shifted_means(series, events.index, 2)
            by_shift.append(standardised(series, means))
        p_values.append(shift_test(by_shift, draw_shifts([FRAMES] * 2, 999)).p_greater)
        hits += p_values[-1] < level
    assert binom.ppf(0.005, sets, level) <= hits <= binom.ppf(0.995, sets, level)
    assert np.mean(p_values) == pytest.approx(0.5, abs=2.6 / math.sqrt(12 * sets))

from pathlib import Path

import numpy as np
import pytest

from dragchain import SeriesError, load_case
from dragchain.drag import circumference, find_drag_peaks, parts, peak_separation_s, within_angle


def test_peaks_of_the_resistance_are_minima_of_the_drag() -> None:
    drag = np.full(50, -1.0)
    drag[[10, 30]] = [-4.0, -5.0]
    drag[40] = 3.0
    peaks = find_drag_peaks(np.arange(50) * 0.1, drag, min_separation_s=0.5)
    assert peaks.index.tolist() == [10, 30]
    np.testing.assert_allclose(peaks.time_s, [1.0, 3.0])
    assert peaks.drag_n.tolist() == [-4, -5]


@pytest.mark.parametrize(
    ("peaks", "separation_s", "index"),
    [
        ({10: -4.0, 13: -5.0, 50: -4.5}, 0.5, [13, 50]),  # the lower of two close ones is dropped
        ({10: -4.0, 13: -5.0, 50: -4.5}, 0.2, [10, 13, 50]),
        ({10: -1.2, 50: -5.0}, 0.1, [50]),  # a ripple below one standard deviation is none
        ({}, 0.1, []),
    ],
)
def test_peaks_stand_out_and_apart(
    peaks: dict[int, float], separation_s: float, index: list[int]
) -> None:
    drag = np.array([peaks.get(at, -1.0) for at in range(60)])
    found = find_drag_peaks(np.arange(60) * 0.1, drag, min_separation_s=separation_s)
    assert found.index.tolist() == index


def test_peaks_need_equal_intervals_and_some_samples() -> None:
    with pytest.raises(SeriesError, match="constant sampling interval"):
        find_drag_peaks(np.array([0, 1, 2, 4.0]), np.zeros(4), min_separation_s=1.0)
    with pytest.raises(SeriesError, match="at least 3"):
        find_drag_peaks(np.array([0, 1.0]), np.zeros(2), min_separation_s=1.0)


def test_peaks_are_one_particle_radius_of_travel_apart(tiny_run: Path) -> None:
    assert peak_separation_s(load_case(tiny_run)) == pytest.approx(8.76e-3 / 1e-4)


EDGES = np.deg2rad(np.arange(-180, 181, 15.0))
"""Where a workpiece of 24 facets touches its particles."""


@pytest.mark.parametrize("noise", [0.0, 3e-10, -3e-10])
def test_a_contact_on_a_limit_counts_half_on_either_side(noise: float) -> None:
    azimuth = EDGES[1:] + noise
    assert within_angle(azimuth, np.pi / 2).sum() == pytest.approx(12.0)
    assert within_angle(azimuth, np.pi / 4).sum() == pytest.approx(6.0)
    halves = np.concatenate(parts(azimuth, 24))
    assert np.bincount(halves, minlength=24).tolist() == [2] * 24


def test_a_contact_off_the_limits_is_whole() -> None:
    azimuth = np.array([0.1, -0.1, 1.7, -3.0])
    assert within_angle(azimuth, np.pi / 2).tolist() == [1.0, 1.0, 0.0, 0.0]
    lower, upper = parts(azimuth, 4)
    assert lower.tolist() == upper.tolist() == [2, 1, 3, 0]


def test_the_circumference_closes_behind_the_workpiece() -> None:
    assert circumference(4) == pytest.approx(np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * np.pi)
    for behind in (np.pi, -np.pi):
        assert sorted(int(part[0]) for part in parts(np.array([behind]), 4)) == [0, 3]

"""Contacts on a limit of the circumference, as edges of facets make them."""

import numpy as np
import pytest

from dragchain.drag.azimuth import circumference, parts, to_the_left, within

EDGES = np.deg2rad(np.arange(-180, 181, 15.0))
"""Where a workpiece of 24 facets touches its particles."""


@pytest.mark.parametrize("noise", [0.0, 3e-10, -3e-10])
def test_a_contact_on_a_limit_counts_half_on_either_side(noise: float) -> None:
    azimuth = EDGES[1:] + noise
    assert within(azimuth, np.pi / 2).sum() == pytest.approx(12.0)
    assert within(azimuth, np.pi / 4).sum() == pytest.approx(6.0)
    assert to_the_left(azimuth).sum() == pytest.approx(12.0)
    halves = np.concatenate(parts(azimuth, 24))
    assert np.bincount(halves, minlength=24).tolist() == [2] * 24


def test_a_contact_off_the_limits_is_whole() -> None:
    azimuth = np.array([0.1, -0.1, 1.7, -3.0])
    assert within(azimuth, np.pi / 2).tolist() == [1.0, 1.0, 0.0, 0.0]
    assert to_the_left(azimuth).tolist() == [1.0, 0.0, 1.0, 0.0]
    lower, upper = parts(azimuth, 4)
    assert lower.tolist() == upper.tolist() == [2, 1, 3, 0]


def test_the_circumference_closes_behind_the_workpiece() -> None:
    assert circumference(4) == pytest.approx(np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * np.pi)
    for behind in (np.pi, -np.pi):
        assert sorted(int(part[0]) for part in parts(np.array([behind]), 4)) == [0, 3]

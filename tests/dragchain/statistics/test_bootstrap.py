import math

import numpy as np
import pytest
from numpy.typing import NDArray

from dragchain.drag.around import ahead_behind, azimuth_profile, depth_profile, depth_slope
from dragchain.errors import SeriesError
from dragchain.statistics.bootstrap import block_length, bootstrap_means, estimates, frame_sums
from dragchain.statistics.estimate import Estimate

Floats = NDArray[np.float64]


def noise(count: int, memory: float = 0.0, seed: int = 1) -> Floats:
    """Return a first-order autoregressive series of unit variance."""
    random = np.random.default_rng(seed)
    series = random.normal(size=count)
    for k in range(1, count):
        series[k] = memory * series[k - 1] + math.sqrt(1 - memory**2) * series[k]
    return series


def interval_of_mean(series: Floats) -> Estimate:
    return estimates(series[:, None], lambda means: means)[0]


def test_interval_of_independent_samples_is_the_normal_one() -> None:
    found = interval_of_mean(noise(2000))
    assert found.ci95_high - found.ci95_low == pytest.approx(2 * 1.96 / math.sqrt(2000), rel=0.15)
    assert found.ci95_low < found.value < found.ci95_high


def test_interval_of_correlated_samples_is_wider_by_their_memory() -> None:
    # sqrt((1 + 0.9) / (1 - 0.9)) = 4.4 times that of independent samples
    widths = [
        interval.ci95_high - interval.ci95_low
        for interval in (interval_of_mean(noise(4000, 0.9, seed)) for seed in range(8))
    ]
    assert np.mean(widths) == pytest.approx(4.36 * 2 * 1.96 / math.sqrt(4000), rel=0.2)


def test_blocks_outlast_the_memory_and_leave_four_of_them() -> None:
    assert block_length(noise(1000)[:, None]) == 10
    # tau = (1 + 0.9) / (2 (1 - 0.9)) = 9.5 frames
    assert block_length(noise(20_000, 0.9)[:, None]) == pytest.approx(38, rel=0.3)
    assert block_length(np.linspace(0, 1, 100)[:, None]) == 25


def test_bootstrap_of_a_constant_is_that_constant() -> None:
    resampled = bootstrap_means(np.full((20, 2), [3.0, 5.0]), 4, resamples=50)
    assert resampled.shape == (50, 2)
    assert resampled == pytest.approx(np.full((50, 2), [3.0, 5.0]))


def test_bootstrap_by_whole_circles_is_the_mean() -> None:
    series = noise(20)[:, None]
    assert bootstrap_means(series, 20, resamples=5) == pytest.approx(series.mean())


def test_too_few_frames_have_no_interval() -> None:
    with pytest.raises(SeriesError, match="at least 8 frames; there are 7"):
        interval_of_mean(np.arange(7.0))


def test_frame_sums_keep_frames_without_contacts() -> None:
    sums = frame_sums(np.array([0, 2, 2]), 4, np.array([[1.0], [2.0], [3.0]]))
    assert sums.tolist() == [[1.0], [0.0], [5.0], [0.0]]


def steady(frames: int, azimuths: list[float], forces: list[float]) -> tuple[Floats, ...]:
    """Return frame, azimuth and force of contacts that every frame repeats."""
    frame = np.repeat(np.arange(frames), len(azimuths))
    return frame, np.tile(azimuths, frames), np.tile(forces, frames)


def test_ahead_and_behind_of_a_steady_workpiece() -> None:
    frame, azimuth, force = steady(10, [0.0, 1.5, -1.5, 1.6, -3.0], [3.0, 2.0, 1.0, 1.5, 0.5])
    found = ahead_behind(frame, 10, azimuth, force)
    assert found["ahead_n"].value == pytest.approx(6.0)
    assert found["behind_n"].value == pytest.approx(2.0)
    assert (found["ratio"].ci95_low, found["ratio"].value) == pytest.approx((3.0, 3.0))
    assert found["fraction_ahead"].value == pytest.approx(0.75)


def test_frames_without_contacts_count_in_the_means() -> None:
    frame, azimuth, force = steady(10, [0.0], [3.0])
    assert ahead_behind(2 * frame, 20, azimuth, force)["ahead_n"].value == pytest.approx(1.5)


def test_nothing_behind_is_a_ratio_without_a_number() -> None:
    found = ahead_behind(*steady_arguments([0.1], [2.0]))
    assert not math.isfinite(found["ratio"].value)
    assert found["fraction_ahead"].value == 1.0


def steady_arguments(
    azimuths: list[float], forces: list[float]
) -> tuple[Floats, int, Floats, Floats]:
    frame, azimuth, force = steady(10, azimuths, forces)
    return frame, 10, azimuth, force


def test_azimuth_bins_hold_all_force_and_close_at_pi() -> None:
    edges, found = azimuth_profile(*steady_arguments([math.pi, 0.1, -3.1], [4.0, 2.0, 1.0]), bins=4)
    assert edges == pytest.approx(np.array([-1, -0.5, 0, 0.5, 1]) * math.pi)
    assert [estimate.value for estimate in found] == pytest.approx([3.0, 0.0, 2.0, 2.0])


def test_depth_bins_give_force_per_contact_and_per_depth() -> None:
    edges, contact, line = depth_profile(
        *steady_arguments([0.0, 0.01, 0.03, 0.04], [1.0, 3.0, 4.0, 10.0]), bins=2
    )
    assert edges == pytest.approx([0.0, 0.02, 0.04])
    assert [estimate.value for estimate in contact] == pytest.approx([2.0, 7.0])
    assert [estimate.value for estimate in line] == pytest.approx([200.0, 700.0])


def test_a_depth_bin_without_contacts_is_unknown() -> None:
    _, contact, line = depth_profile(*steady_arguments([0.0, 0.04], [1.0, 3.0]), bins=4)
    assert all(math.isnan(number) for number in vars(contact[1]).values())
    assert line[1].value == 0.0


def test_slope_of_a_line_is_its_slope() -> None:
    random = np.random.default_rng(3)
    depth = random.uniform(0.0, 0.05, 400)
    found = depth_slope(np.arange(400) // 10, 40, depth, 2.0 + 3.0 * depth)
    assert [found.ci95_low, found.value, found.ci95_high] == pytest.approx([3.0] * 3)


def test_slope_interval_holds_the_true_slope_of_noisy_contacts() -> None:
    random = np.random.default_rng(4)
    depth = random.uniform(0.0, 0.05, 4000)
    force = 0.1 + 5.0 * depth + random.normal(scale=0.05, size=4000)
    found = depth_slope(np.arange(4000) // 20, 200, depth, force)
    assert found.ci95_low < 5.0 < found.ci95_high
    assert found.ci95_high - found.ci95_low < 0.5

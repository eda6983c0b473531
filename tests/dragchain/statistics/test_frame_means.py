import math

import numpy as np
import pytest
from numpy.typing import NDArray

from dragchain.drag.around import ahead_behind, azimuth_profile, depth_profile, depth_slope
from dragchain.errors import SeriesError
from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import Estimate
from dragchain.statistics.frame_means import estimates, frame_sums

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


@pytest.mark.parametrize("memory", [0.0, 0.9])
@pytest.mark.parametrize("count", [40, 300, 3000])
def test_a_mean_has_the_interval_of_a_mean(memory: float, count: int) -> None:
    """A bootstrap in its place had 0.8 of that width at a few dozen correlation times."""
    series = noise(count, memory)
    found, expected = interval_of_mean(series), estimate_mean(series).estimate
    assert vars(found) == pytest.approx(vars(expected), rel=1e-6)


def test_a_sum_that_is_never_negative_has_no_negative_end() -> None:
    few = np.zeros(100)
    few[40:45] = 1.0
    found = interval_of_mean(few)
    assert found.ci95_low == 0.0 < found.value < found.ci95_high


def test_a_ratio_varies_as_its_own_series_does() -> None:
    """Fast noise that both sums share hides the slow change of their ratio, but not in it."""
    shared = 10.0 + noise(2000, seed=2)
    ratio = 2.0 + 0.1 * noise(2000, 0.9, seed=3)
    sums = np.column_stack([shared * ratio, shared])
    (found,) = estimates(sums, lambda means: means[..., :1] / means[..., 1:])
    expected = estimate_mean(ratio)
    assert found.ci95_high - found.ci95_low == pytest.approx(
        expected.ci95_high - expected.ci95_low, rel=0.1
    )


def test_a_ratio_of_uncertain_sums_reaches_further_up_than_down() -> None:
    sums = np.column_stack([5.0 + noise(200, 0.8, 1), 1.0 + 0.8 * noise(200, 0.8, 2)])
    (found,) = estimates(np.abs(sums), lambda means: means[..., :1] / means[..., 1:])
    assert found.ci95_high - found.value > 1.2 * (found.value - found.ci95_low) > 0.0


def test_what_never_changes_and_what_is_short_are_not_reliable() -> None:
    assert not interval_of_mean(np.ones(100)).reliable
    assert not interval_of_mean(np.linspace(0.0, 1.0, 100)).reliable
    assert interval_of_mean(noise(100)).reliable


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
    assert not contact[1].known and not contact[1].reliable and math.isnan(contact[1].value)
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

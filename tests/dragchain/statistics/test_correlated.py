import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from dragchain.drag import ahead_behind, azimuth_profile, depth_profile, depth_slope
from dragchain.errors import SeriesError
from dragchain.statistics.correlated import autocovariance, estimate_mean, estimates, slow_error
from dragchain.statistics.estimate import Estimate


def ar1(phi: float, count: int, seed: int) -> np.ndarray:
    """Stationary x_t = phi x_(t-1) + noise; tau = (1 + phi) / (1 - phi) / 2, sd 1."""
    noise = np.random.default_rng(seed).normal(size=count) * np.sqrt(1 - phi**2)
    noise[0] /= np.sqrt(1 - phi**2)
    return np.asarray(lfilter([1.0], [1.0, -phi], noise))


def test_the_autocovariance_of_four_samples_by_hand() -> None:
    """1 2 3 4 about 2.5: lag 0 (2.25+0.25+0.25+2.25)/4, lag 1 (0.75-0.25+0.75)/3, ..."""
    np.testing.assert_allclose(autocovariance([1, 2, 3, 4]), [1.25, 1.25 / 3, -0.75, -2.25])


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9, 0.98])
def test_the_autocorrelation_time_of_an_ar1_process(phi) -> None:
    exact = 0.5 * (1 + phi) / (1 - phi)
    found = estimate_mean(ar1(phi, 400_000, seed=1)).autocorrelation_samples
    assert found == pytest.approx(exact, rel=0.05)


@pytest.mark.parametrize("phi", [0.0, 0.8])
def test_the_interval_covers_the_mean_as_often_as_it_says(phi) -> None:
    """600 series of 100 autocorrelation times; 4 % is 2.5 standard errors at the least."""
    count = int(100 * 0.5 * (1 + phi) / (1 - phi)) + 1
    estimates = [estimate_mean(ar1(phi, count, seed)) for seed in range(600)]
    assert all(estimate.samples == count for estimate in estimates)
    covered = np.mean([e.ci95_low <= 0.0 <= e.ci95_high for e in estimates])
    assert covered == pytest.approx(0.95, abs=0.04)


def test_a_short_series_is_not_reliable() -> None:
    """Five autocorrelation times: two in five say so of themselves, see the page."""
    short = [estimate_mean(ar1(0.98, 250, seed)).reliable for seed in range(200)]
    assert 0.25 < 1.0 - np.mean(short) < 0.55
    assert estimate_mean(ar1(0.98, 20_000, seed=3)).reliable


def test_a_weak_slow_fluctuation_beside_a_fast_one_is_seen() -> None:
    """As of a number of contacts: a fifth of the variance has a memory of 20 samples.

    The window of the autocorrelation time ends before it; an interval from that alone contains
    the mean in three of four cases.
    """
    held = 0
    for seed in range(300):
        slow = ar1(39 / 41, 1640, seed)
        fast = np.random.default_rng([seed, 1]).normal(size=1640)
        found = estimate_mean(np.sqrt(0.2) * slow + np.sqrt(0.8) * fast)
        held += found.ci95_low <= 0.0 <= found.ci95_high
    assert held >= 0.89 * 300


def test_the_slow_error_is_that_of_a_mean_whatever_the_correlation() -> None:
    """tau = 4.5: the mean of 2000 samples has a standard error of sqrt(2 tau / N) = 0.067."""
    errors = [slow_error(ar1(0.8, 2000, seed)) for seed in range(200)]
    assert np.sqrt(np.mean([se**2 for se, _ in errors])) == pytest.approx(0.067, rel=0.1)
    assert errors[0][1] == 8 and slow_error([1.0, 2.0, 4.0])[1] == 2


def test_a_constant_series_has_an_interval_of_no_width_but_is_not_reliable() -> None:
    estimate = estimate_mean(np.full(100, 0.1))
    assert estimate.mean == pytest.approx(0.1)
    assert estimate.ci95_high - estimate.ci95_low == pytest.approx(0.0, abs=1e-15)
    assert estimate.autocorrelation_samples == 0.5
    assert not estimate.reliable


@given(st.floats(-100, 100), st.floats(0.01, 100), st.integers(0, 50))
def test_scale_and_shift_pass_through(shift, scale, seed) -> None:
    series = ar1(0.7, 300, seed)
    plain, moved = estimate_mean(series), estimate_mean(shift + scale * series)
    assert moved.effective_samples == pytest.approx(plain.effective_samples, rel=1e-6)
    assert moved.ci95_low == pytest.approx(shift + scale * plain.ci95_low, rel=1e-6, abs=1e-9)
    assert plain.ci95_low < plain.mean < plain.ci95_high


@pytest.mark.parametrize(
    ("series", "message"),
    [
        ([], r"shape \(0,\)"),
        ([1.0] * 7, "require 8 samples"),
        (np.zeros((10, 2)), r"shape \(10, 2\)"),
        ([*[1.0] * 9, float("nan")], "sample 9 of the series is not a finite number: nan"),
        ([*[1.0] * 9, float("inf")], "sample 9 of the series is not a finite number: inf"),
    ],
)
def test_refuses_a_series_without_statistics(series, message) -> None:
    with pytest.raises(SeriesError, match=message):
        estimate_mean(series)


def test_the_autocorrelation_time_of_short_series_is_hardly_biased() -> None:
    """22 autocorrelation times of 4.5 samples; without the factor the mean is 3.2."""
    found = [estimate_mean(ar1(0.8, 100, seed)) for seed in range(1000)]
    times = [one.autocorrelation_samples for one in found]
    assert np.mean(times) == pytest.approx(4.5, rel=0.1)


def test_the_interval_is_students() -> None:
    """Forty samples that alternate: tau 1/2, window 1, 40 / 3 degrees, t = 2.155 at 95 %."""
    estimate = estimate_mean([1.0, -1.0] * 20)
    assert estimate.effective_samples == 40.0
    assert estimate.se == pytest.approx(np.sqrt(40 / 39 / 40))
    assert estimate.ci95_high / estimate.se == pytest.approx(2.155, abs=1e-3)


def test_the_interval_of_a_ratio_of_means_has_the_larger_relative_width() -> None:
    """Of a mean of 4 +- 1 % and one of 2 +- 10 %, by far the latter."""
    rng = np.random.default_rng(4)
    above, below = (estimate_mean(rng.normal(mean, s, 10_000)) for mean, s in ((4, 2), (2, 10)))
    ratio = above.over(below)
    half = 0.5 * (below.ci95_high - below.ci95_low) / below.mean * ratio.value
    assert ratio.value == above.mean / below.mean
    assert ratio.value - ratio.ci95_low == pytest.approx(half, rel=0.02)
    assert ratio.ci95_high - ratio.value == pytest.approx(half, rel=0.02)


def interval_of_mean(series: np.ndarray) -> Estimate:
    return estimates(series[:, None], lambda means: means)[0]


@pytest.mark.parametrize("memory", [0.0, 0.9])
@pytest.mark.parametrize("count", [40, 300, 3000])
def test_a_mean_has_the_interval_of_a_mean(memory: float, count: int) -> None:
    """A bootstrap in its place had 0.8 of that width at a few dozen correlation times."""
    series = ar1(memory, count, seed=1)
    found, expected = interval_of_mean(series), estimate_mean(series).estimate
    assert vars(found) == pytest.approx(vars(expected), rel=1e-6)


def test_a_sum_that_is_never_negative_has_no_negative_end() -> None:
    few = np.zeros(100)
    few[40:45] = 1.0
    found = interval_of_mean(few)
    assert found.ci95_low == 0.0 < found.value < found.ci95_high


def test_a_ratio_varies_as_its_own_series_does() -> None:
    """Fast noise that both sums share hides the slow change of their ratio, but not in it."""
    shared = 10.0 + ar1(0.0, 2000, seed=2)
    ratio = 2.0 + 0.1 * ar1(0.9, 2000, seed=3)
    sums = np.column_stack([shared * ratio, shared])
    (found,) = estimates(sums, lambda means: means[..., :1] / means[..., 1:])
    expected = estimate_mean(ratio)
    assert found.ci95_high - found.ci95_low == pytest.approx(
        expected.ci95_high - expected.ci95_low, rel=0.1
    )


def test_a_ratio_of_uncertain_sums_reaches_further_up_than_down() -> None:
    sums = np.column_stack([5.0 + ar1(0.8, 200, 1), 1.0 + 0.8 * ar1(0.8, 200, 2)])
    (found,) = estimates(np.abs(sums), lambda means: means[..., :1] / means[..., 1:])
    assert found.ci95_high - found.value > 1.2 * (found.value - found.ci95_low) > 0.0


def test_a_ratio_to_a_sum_that_may_be_zero_has_no_interval() -> None:
    """With cohesion, normal forces behind the workpiece may pull more than they push."""
    random = np.random.default_rng(3)
    sums = np.column_stack([random.normal(1.0, 0.1, 400), random.normal(0.01, 1.0, 400)])
    (ratio,) = estimates(sums, lambda means: means[..., :1] / means[..., 1:])
    assert math.isfinite(ratio.value)
    assert not ratio.known


def test_what_never_changes_and_what_is_short_are_not_reliable() -> None:
    assert not interval_of_mean(np.ones(100)).reliable
    assert not interval_of_mean(np.linspace(0.0, 1.0, 100)).reliable
    assert interval_of_mean(ar1(0.0, 100, 1)).reliable


def test_too_few_frames_have_no_interval() -> None:
    with pytest.raises(SeriesError, match="at least 8 frames; there are 7"):
        interval_of_mean(np.arange(7.0))


def steady(
    azimuths: list[float], forces: list[float]
) -> tuple[np.ndarray, int, np.ndarray, np.ndarray]:
    """Frame, number of frames, azimuth and force of contacts that every one of ten repeats."""
    frame = np.repeat(np.arange(10), len(azimuths))
    return frame, 10, np.tile(azimuths, 10), np.tile(forces, 10)


def test_ahead_and_behind_of_a_steady_workpiece() -> None:
    found = ahead_behind(*steady([0.0, 1.5, -1.5, 1.6, -3.0], [3.0, 2.0, 1.0, 1.5, 0.5]))
    assert found["ahead_n"].value == pytest.approx(6.0)
    assert found["behind_n"].value == pytest.approx(2.0)


def test_frames_without_contacts_count_in_the_means() -> None:
    frame, _, azimuth, force = steady([0.0], [3.0])
    assert ahead_behind(2 * frame, 20, azimuth, force)["ahead_n"].value == pytest.approx(1.5)


def test_azimuth_bins_hold_all_force_and_close_at_pi() -> None:
    edges, found = azimuth_profile(*steady([math.pi, 0.1, -3.1], [4.0, 2.0, 1.0]), bins=4)
    assert edges == pytest.approx(np.array([-1, -0.5, 0, 0.5, 1]) * math.pi)
    assert [estimate.value for estimate in found] == pytest.approx([3.0, 0.0, 2.0, 2.0])


def test_depth_bins_give_force_per_contact_and_per_depth() -> None:
    edges, contact, line = depth_profile(
        *steady([0.0, 0.01, 0.03, 0.04], [1.0, 3.0, 4.0, 10.0]), bins=2
    )
    assert edges == pytest.approx([0.0, 0.02, 0.04])
    assert [estimate.value for estimate in contact] == pytest.approx([2.0, 7.0])
    assert [estimate.value for estimate in line] == pytest.approx([200.0, 700.0])


def test_a_depth_bin_without_contacts_is_unknown() -> None:
    _, contact, line = depth_profile(*steady([0.0, 0.04], [1.0, 3.0]), bins=4)
    assert not contact[1].known and not contact[1].reliable and math.isnan(contact[1].value)
    assert line[1].value == 0.0


def test_slope_of_a_line_is_its_slope() -> None:
    random = np.random.default_rng(3)
    depth = random.uniform(0.0, 0.05, 400)
    found = depth_slope(np.arange(400) // 10, 40, depth, 2.0 + 3.0 * depth)
    assert [found.ci95_low, found.value, found.ci95_high] == pytest.approx([3.0] * 3)

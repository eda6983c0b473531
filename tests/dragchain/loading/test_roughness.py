"""Peaks are cut as closed forms say, and planted series of roughness are recovered."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dragchain.loading.roughness import RoughnessCourse, RoughnessProfile, fit_measured, profile_of
from dragchain.statistics.estimate import Estimate
from dragdeck.study.roughness import Roughness

SINE = {"shape": "sine", "ra_m": 1e-6}
ZERO = Estimate(0.0, 0.0, 0.0)


def profile(**start: object) -> RoughnessProfile:
    return profile_of(Roughness.model_validate(start))


def triangle(ra_m: float = 1e-6) -> RoughnessProfile:
    return profile(form={"shape": "triangle", "ra_m": ra_m})


@pytest.mark.parametrize("cut", [0.0, 0.1, 0.5, 1.0, 1.9])
def test_a_triangle_loses_its_peaks(cut: float) -> None:
    """Its heights are even from 0 to H = 4 Ra: a cut at h removes (H - h)^2 / (2 H)."""
    height, depth = 4e-6, cut * 1e-6
    level = height - math.sqrt(2 * height * depth)
    mean = height / 2 - depth
    surface = triangle()
    assert surface.ra(depth) == pytest.approx(mean**2 / height, rel=1e-3, abs=1e-12)
    assert surface.rz(depth) == pytest.approx(level, rel=1e-3, abs=2e-9)
    assert surface.plateau(depth) == pytest.approx(1 - level / height, abs=1e-3)


@pytest.mark.parametrize("angle", [0.3, 0.9, 1.5, 2.3])
def test_a_sine_loses_its_peaks(angle: float) -> None:
    """Cut at A cos(angle), the mean height above is A (sin(angle) - angle cos(angle)) / pi."""
    amplitude = math.pi / 2
    level = amplitude * math.cos(angle)
    depth = amplitude * (math.sin(angle) - angle * math.cos(angle)) / math.pi
    at = math.acos(-depth / amplitude)  # where the mean line, which has fallen, meets the sine
    below = amplitude * (math.sin(at) + (math.pi - at) * math.cos(at)) / math.pi
    surface = profile(form={"shape": "sine", "ra_m": 1.0})
    assert surface.ra(0.0) == pytest.approx(1.0, rel=1e-5)
    assert surface.ra(depth) == pytest.approx(2 * below, rel=1e-4)
    assert surface.rz(depth) == pytest.approx(amplitude + level, rel=1e-4)
    assert surface.plateau(depth) == pytest.approx(angle / math.pi, abs=1e-3)


def test_arcs_of_turning() -> None:
    """Flat arcs are parabolas: height f^2 / (8 r), Ra f^2 / (18 sqrt(3) r)."""
    feed, radius = 1e-4, 8e-4
    surface = profile(turned={"feed_m": feed, "nose_radius_m": radius})
    assert surface.rz(0.0) == pytest.approx(feed**2 / (8 * radius), rel=2e-3)
    assert surface.ra(0.0) == pytest.approx(feed**2 / (18 * math.sqrt(3) * radius), rel=2e-3)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=60), st.floats(0.0, 1.5))
def test_what_is_cut_is_what_is_removed(heights: list[float], share: float) -> None:
    z = np.array(heights)
    surface, depth = RoughnessProfile(z), share * (z.mean() - z.min())
    level = float(surface.level(depth))
    left = np.minimum(z, level)
    assert z.mean() - left.mean() == pytest.approx(depth, abs=1e-9)
    assert surface.ra(depth) == pytest.approx(np.abs(left - left.mean()).mean(), abs=1e-9)
    assert surface.rz(depth) == pytest.approx(np.ptp(left), abs=1e-9)


def test_the_depth_to_a_roughness_is_the_inverse() -> None:
    surface = triangle()
    depths = np.array([0.0, 2e-7, 9e-7, 1.7e-6])
    assert surface.depth_to(surface.ra(depths)) == pytest.approx(depths, abs=1e-9)
    assert surface.depth_to(1.0) == 0.0


def test_the_interval_has_the_errors_of_depth_profile_and_steady_roughness() -> None:
    noise = np.random.default_rng(3).normal(size=5000)
    rough = RoughnessProfile(noise, 5)
    depth, exact = Estimate(0.3, 0.25, 0.35), Estimate(0.3, 0.3, 0.3)
    of_depth = RoughnessCourse(RoughnessProfile(noise), ZERO).ra_after(depth)
    assert of_depth.ci95_low == pytest.approx(float(rough.ra(0.35)))
    assert of_depth.ci95_high == pytest.approx(float(rough.ra(0.25)))
    of_profile = RoughnessCourse(rough, ZERO).ra_after(exact)
    assert (
        of_profile.relative_half_width == pytest.approx(rough.half_width) and rough.half_width > 0
    )
    steady = Estimate(0.2, 0.15, 0.25)
    both = RoughnessCourse(rough, steady).ra_after(depth)
    assert both.value == pytest.approx(math.hypot(of_depth.value, 0.2))
    assert both.half_width > max(of_profile.half_width, of_depth.half_width) * 0.8


def test_the_time_to_a_roughness() -> None:
    course = RoughnessCourse(triangle(), Estimate(2e-7, 1e-7, 3e-7))
    rate = Estimate(1e-9, 0.8e-9, 1.25e-9)
    time = course.time_to(5e-7, rate)
    ra = course.ra_after(rate.over(1 / time.value))
    assert ra.value == pytest.approx(5e-7, rel=1e-6)
    assert time.ci95_low < time.value / 1.25 and time.ci95_high > time.value / 0.8
    assert course.time_to(2e-7, rate).value == math.inf
    assert course.time_to(2.5e-7, rate).ci95_high == math.inf  # a steady roughness may be above it


@pytest.mark.parametrize("steady", [None, 1e-7])
def test_planted_series_are_recovered(steady: float | None) -> None:
    """Student's t intervals contain depth per time and steady roughness in 93 to 97 %."""
    rng, surface, rate = np.random.default_rng(11), triangle(), 5e-10
    times = np.array([300.0, 600.0, 1200.0, 1800.0, 2700.0, 4000.0, 6000.0])
    hits, trials = np.zeros(2), 400
    for _ in range(trials):
        ra = np.hypot(surface.ra(rate * times), 1e-7) * np.exp(0.05 * rng.normal(size=len(times)))
        rows = [{"time_s": time, "ra_m": of} for time, of in zip(times, ra, strict=True)]
        start = {"form": {"shape": "triangle", "ra_m": 1e-6}, "measured": rows}
        fit = fit_measured(Roughness.model_validate(start | {"steady_ra_m": steady}), surface)
        assert fit is not None
        hits += fit.depth_m_s.contains(rate), fit.steady_m.contains(1e-7)
    error = 3 * math.sqrt(0.05 * 0.95 / trials)
    assert 0.93 - error < hits[0] / trials < 0.97 + error
    assert steady or 0.93 - error < hits[1] / trials < 0.97 + error


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "either profile, turned, or form"),
        ({"form": SINE, "turned": {"feed_m": 1e-4, "nose_radius_m": 1e-3}}, "either profile"),
        ({"turned": {"feed_m": 1e-3, "nose_radius_m": 4e-4}}, "arcs do not meet"),
        ({"form": SINE, "steady_ra_m": 1e-7, "target_ra_m": 1e-7},
         "not above steady_ra_m"),
        ({"form": SINE, "measured": [{"time_s": 1, "ra_m": 1e-6}]},
         "give 3 or more"),
    ],
)  # fmt: skip
def test_what_says_nothing_is_refused(data: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Roughness.model_validate(data)

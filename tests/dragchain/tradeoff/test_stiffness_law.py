"""The law of reduced stiffness: known laws are found, and intervals include the truth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dragchain.errors import SeriesError
from dragchain.statistics.estimate import student_quantile
from dragchain.tradeoff.stiffness_law import (
    COEFFICIENTS,
    UNIT,
    UNIT_FRICTION,
    UNIT_INERTIA,
    ScaledRuns,
    StiffnessLaw,
    extrapolate,
    fit_stiffness_law,
    left_out,
)

RATE, AMPLITUDE, SLOPE, ROUGH = 0.25, 0.6, 0.2, 0.15
SCALES = np.repeat([1.0, 1e-2, 1e-3], 4)


def scene(
    rng: np.random.Generator, *, amplitude: float = AMPLITUDE, noise: float = 0.03
) -> ScaledRuns:
    full, inertial = 10 ** rng.uniform(4.4, 5.3), 10 ** rng.uniform(-2.0, -0.5)
    numbers = full * SCALES ** (2 / 3)
    friction = rng.uniform(0.05, 0.8)
    amplitude += SLOPE * inertial / UNIT_INERTIA + ROUGH * math.log(friction / UNIT_FRICTION)
    effect = amplitude * ((numbers / UNIT) ** -RATE - (full / UNIT) ** -RATE)
    logarithms = rng.normal() + effect + rng.normal(0.0, noise, len(numbers))
    return ScaledRuns(full, inertial, friction, SCALES, logarithms, 15.0)


def scenes(
    seed: int, count: int = 12, spread: float = 0.05, noise: float = 0.03
) -> list[ScaledRuns]:
    rng = np.random.default_rng(seed)
    return [scene(rng, amplitude=rng.normal(AMPLITUDE, spread), noise=noise) for _ in range(count)]


def test_without_noise_the_law_is_found_and_the_extrapolation_exact() -> None:
    law = fit_stiffness_law(scenes(1, spread=0.0, noise=1e-6))
    assert law.rate == pytest.approx(RATE, rel=1e-2)
    assert law.amplitude == pytest.approx((AMPLITUDE, SLOPE, ROUGH), rel=2e-2)
    new = scene(np.random.default_rng(9), noise=0.0)
    only = replace(new, scales=new.scales[8:], logarithms=new.logarithms[8:])
    assert extrapolate(law, only).logarithm == pytest.approx(new.logarithms[0], abs=5e-3)


def test_scatter_is_told_apart() -> None:
    """Twenty designs: the means of the estimated standard deviations are close to the true ones."""
    laws = [fit_stiffness_law(scenes(seed)) for seed in range(20)]
    assert np.mean([law.run_std for law in laws]) == pytest.approx(0.03, rel=0.05)
    assert np.sqrt(np.mean([law.amplitude_std**2 for law in laws])) == pytest.approx(0.05, rel=0.3)
    assert np.mean([law.amplitude[0] for law in laws]) == pytest.approx(AMPLITUDE, rel=0.1)


def test_intervals_of_scenes_left_out_include_the_truth_as_often_as_they_say() -> None:
    quantile = student_quantile(12 - 1 - COEFFICIENTS)
    inside = [
        abs(error) <= quantile * se
        for seed in range(4)
        for of_plan in left_out(scenes(seed), [{1e-3: 2, 1e-2: 2}])
        for error, se, _ in of_plan
    ]
    assert len(inside) == 48
    assert sum(inside) >= 41  # fewer have a probability of 0.5 % if 95 % are meant


def test_an_unknown_amplitude_is_richardsons_extrapolation() -> None:
    """Two stiffness numbers without noise and without prior: a straight line through them."""
    law = StiffnessLaw(RATE, (0.0,) * 3, ((0.0,) * 3,) * 3, 1e3, 0.01)
    new = scene(np.random.default_rng(3), noise=0.0)
    two = replace(new, scales=new.scales[[4, 8]], logarithms=new.logarithms[[4, 8]])
    got = extrapolate(law, two)
    assert got.logarithm == pytest.approx(new.logarithms[0], abs=1e-6)
    near, far = two.reduction(RATE)
    assert got.se == pytest.approx(0.01 * math.hypot(far, near) / (far - near), rel=1e-3)


def test_at_the_physical_modulus_nothing_is_corrected() -> None:
    spread = (0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01)
    law = StiffnessLaw(RATE, (AMPLITUDE, SLOPE, ROUGH), spread, 0.1, 0.03, 0.2)
    runs = ScaledRuns(1e5, 0.05, 0.4, np.array([1.0]), np.array([1.5]), 15.0)
    assert extrapolate(law, runs).logarithm == pytest.approx(1.5)
    assert extrapolate(law, runs).se == pytest.approx(0.03)


def test_too_few_scenes_are_refused() -> None:
    with pytest.raises(SeriesError, match="five scenes"):
        fit_stiffness_law(scenes(1, count=2))


@pytest.mark.parametrize("same", [{"inertial_number": 0.1}, {"friction": 0.4}])
def test_scenes_that_are_alike_say_nothing_of_what_they_share(same: dict[str, float]) -> None:
    with pytest.raises(SeriesError, match="differ too little"):
        fit_stiffness_law([replace(one, **same) for one in scenes(2)])

"""The law of reduced stiffness: known laws are found, and intervals include the truth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import student_quantile
from dragchain.tradeoff.stiffness_law import (
    COEFFICIENTS,
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


def shape(full: float, rate: float) -> Floats:
    """What a law with this rate makes of the moduli, (N,): 1 at E x 0.001 and kappa = 5e4."""
    kappa, unit = full * SCALES ** (2 / 3), 5e4 * 1e-3 ** (2 / 3)
    if rate == 0.0:
        return np.asarray(np.log(full / kappa) / math.log(5e4 / unit))
    return np.asarray((kappa**-rate - full**-rate) / (unit**-rate - 5e4**-rate))


def scene(
    rng: np.random.Generator,
    *,
    amplitude: float = AMPLITUDE,
    noise: float = 0.03,
    rate: float = RATE,
) -> ScaledRuns:
    full, inertial = 10 ** rng.uniform(4.4, 5.3), 10 ** rng.uniform(-2.0, -0.5)
    friction = rng.uniform(0.05, 0.8)
    amplitude += SLOPE * inertial / UNIT_INERTIA + ROUGH * math.log(friction / UNIT_FRICTION)
    logarithms = rng.normal() + amplitude * shape(full, rate) + rng.normal(0.0, noise, len(SCALES))
    return ScaledRuns(full, inertial, friction, SCALES, logarithms, 15.0)


def scenes(
    seed: int, count: int = 12, spread: float = 0.05, noise: float = 0.03, rate: float = RATE
) -> list[ScaledRuns]:
    rng = np.random.default_rng(seed)
    return [
        scene(rng, amplitude=rng.normal(AMPLITUDE, spread), noise=noise, rate=rate)
        for _ in range(count)
    ]


def test_without_noise_the_law_is_found_and_the_extrapolation_exact() -> None:
    law = fit_stiffness_law(scenes(1, spread=0.0, noise=1e-6))
    assert law.rate == pytest.approx(RATE, rel=1e-2)
    assert law.amplitude == pytest.approx((AMPLITUDE, SLOPE, ROUGH), rel=2e-2)
    new = scene(np.random.default_rng(9), noise=0.0)
    only = replace(new, scales=new.scales[8:], logarithms=new.logarithms[8:])
    assert extrapolate(law, only).logarithm == pytest.approx(new.logarithms[0], abs=5e-3)


@pytest.mark.parametrize("rate", [-0.1, 0.0, 0.1, 0.5, 1.0])
def test_no_rate_is_out_of_reach(rate: float) -> None:
    """Beside a limit of the rate, an extrapolation would be wrong by a third."""
    law = fit_stiffness_law(scenes(1, spread=0.0, noise=1e-6, rate=rate))
    assert law.rate == pytest.approx(rate, abs=1e-2)
    new = scene(np.random.default_rng(9), noise=0.0, rate=rate)
    only = replace(new, scales=new.scales[8:], logarithms=new.logarithms[8:])
    assert extrapolate(law, only).logarithm == pytest.approx(new.logarithms[0], abs=5e-3)


def test_what_goes_as_one_over_the_stiffness_number_is_extrapolated_without_bias() -> None:
    """An overlap: from E x 0.001 it falls to a hundredth."""
    rng = np.random.default_rng(5)
    known = [
        replace(one, logarithms=one.softening + rng.normal(0.0, 0.03, len(SCALES)))
        for one in scenes(5)
    ]
    found = [replace(one, stiffness_power=power) for power in (1.0, 0.0) for one in known]
    for own in (found[: len(known)], found[len(known) :]):
        law = fit_stiffness_law(own)
        new = replace(own[0], scales=np.array([1e-3]), logarithms=np.log([100.0]))
        assert extrapolate(law, new).logarithm == pytest.approx(0.0, abs=0.03)


def test_a_misfit_is_charged_to_its_own_modulus_and_vanishes_at_the_physical_one() -> None:
    law = StiffnessLaw(RATE, (0.0,) * 3, ((0.0,) * 4,) * 4, 0.0, 0.03, ((1e-3, 0.2), (1e-2, 0.01)))
    new = scene(np.random.default_rng(3), noise=0.0)
    found = {
        scale: extrapolate(
            law, replace(new, scales=np.array([scale]), logarithms=np.array([0.0]))
        ).law_se
        for scale in (1.0, 0.9999, 0.1, 1e-2, 1e-3, 1e-6)
    }
    assert found[1.0] == 0.0 < found[0.9999] < 1e-5
    assert found[0.1] == pytest.approx(0.005) and found[1e-2] == pytest.approx(0.01)
    assert found[1e-3] == pytest.approx(0.2) and found[1e-6] == pytest.approx(0.4)


def test_scatter_is_told_apart() -> None:
    """Twenty designs: the means of the estimated standard deviations are close to the true ones."""
    laws = [fit_stiffness_law(scenes(seed)) for seed in range(20)]
    assert np.mean([law.run_std for law in laws]) == pytest.approx(0.03, rel=0.05)
    assert np.sqrt(np.mean([law.amplitude_std**2 for law in laws])) == pytest.approx(0.05, rel=0.3)
    assert np.mean([law.amplitude[0] for law in laws]) == pytest.approx(AMPLITUDE, rel=0.1)


def test_intervals_of_scenes_left_out_include_the_truth_as_often_as_they_say() -> None:
    quantile = student_quantile(12 - 1 - COEFFICIENTS)
    inside = [
        abs(error.found.logarithm) <= error.found.half_width(quantile)
        for seed in range(4)
        for of_plan in left_out(scenes(seed), [{1e-3: 2, 1e-2: 2}])
        for error in of_plan
    ]
    assert len(inside) == 48
    assert sum(inside) >= 41  # fewer have a probability of 0.5 % if 95 % are meant


def test_an_unknown_amplitude_is_richardsons_extrapolation() -> None:
    """Two stiffness numbers without noise and without prior: a straight line through them."""
    law = StiffnessLaw(RATE, (0.0,) * 3, ((0.0,) * 4,) * 4, 1e3, 0.01)
    new = scene(np.random.default_rng(3), noise=0.0)
    two = replace(new, scales=new.scales[[4, 8]], logarithms=new.logarithms[[4, 8]])
    got = extrapolate(law, two)
    assert got.logarithm == pytest.approx(new.logarithms[0], abs=1e-6)
    near, far = two.reduction(RATE)
    assert got.se == pytest.approx(0.01 * math.hypot(far, near) / (far - near), rel=1e-3)


def test_at_the_physical_modulus_nothing_is_corrected() -> None:
    row = (0.01, 0.0, 0.0, 0.01)
    law = StiffnessLaw(RATE, (AMPLITUDE, SLOPE, ROUGH), (row,) * 4, 0.1, 0.03, ((1e-3, 0.2),))
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

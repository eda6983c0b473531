"""Effects of settings with a random bed: known effects, coverage of intervals, pairing."""

import numpy as np
import pytest
from scipy import stats

from dragchain.errors import SeriesError
from dragchain.statistics.bed_effects import Factors, fit_effects

REFERENCE = {"modulus": 1.0, "step": 0.2}
SEEDS = range(4)
POINTS = [(1.0, 0.2), (0.1, 0.2), (0.01, 0.2), (1.0, 0.5), (0.01, 0.5)]
TRUE = {1.0: 0.0, 0.1: 0.05, 0.01: 0.1, 0.2: 0.0, 0.5: -0.04}

RUNS = [({"modulus": modulus, "step": step}, seed) for modulus, step in POINTS for seed in SEEDS]
SETTINGS = [setting for setting, _ in RUNS]
BEDS = [seed for _, seed in RUNS]
EXPECTED = np.array([TRUE[one["modulus"]] + TRUE[one["step"]] for one in SETTINGS])


def factors(additive: bool) -> Factors:
    return Factors(SETTINGS, REFERENCE, additive)


def simulated(rng: np.random.Generator, bed_fraction: float, beds: list[int]) -> np.ndarray:
    bed = rng.normal(0.0, np.sqrt(bed_fraction), len(set(beds)))
    chance = rng.normal(0.0, np.sqrt(1.0 - bed_fraction), len(beds))
    return EXPECTED + 0.03 * (bed[beds] + chance)


def weights(own: Factors, setting: dict[str, float]) -> np.ndarray:
    return own.row(setting) - own.row(REFERENCE)


@pytest.mark.parametrize("additive", [True, False])
def test_effects_without_chance_are_found_exactly(additive: bool) -> None:
    own = factors(additive)
    fit = fit_effects(own.design(), EXPECTED, BEDS)
    for setting, expected in zip(SETTINGS, EXPECTED, strict=True):
        assert fit.contrast(weights(own, setting))[0] == pytest.approx(expected, abs=1e-12)
    assert fit.degrees == len(RUNS) - (4 if additive else 5) - (len(SEEDS) - 1)


def test_additive_effects_tell_what_was_not_run() -> None:
    unseen = {"modulus": 0.1, "step": 0.5}
    assert factors(True).tells(unseen) and not factors(False).tells(unseen)
    assert not factors(True).tells({"modulus": 0.001, "step": 0.2})
    assert factors(False).tells(REFERENCE)
    fit = fit_effects(factors(True).design(), EXPECTED, BEDS)
    assert fit.contrast(weights(factors(True), unseen))[0] == pytest.approx(0.01)


@pytest.mark.parametrize("packings", [2, 4])
@pytest.mark.parametrize("bed_fraction", [0.0, 0.7])
def test_an_estimated_share_of_the_bed_counts(bed_fraction: float, packings: int) -> None:
    """Two cases; without the degrees of freedom of the packings 0.86 to 0.92 of them held."""
    rng = np.random.default_rng(20260102)
    beds = [*range(packings)] * 2
    design = np.column_stack([np.ones(2 * packings), np.repeat([0.0, 1.0], packings)])
    count = 0
    for _ in range(600):
        bed = np.sqrt(bed_fraction) * rng.normal(size=packings)[beds]
        values = bed + np.sqrt(1.0 - bed_fraction) * rng.normal(size=len(beds))
        count += fit_effects(design, values, beds).estimate([0.0, 1.0]).contains(0.0)
    assert stats.binomtest(count, 600, 0.95, alternative="less").pvalue > 0.01, count


def test_too_few_runs_to_tell_the_share_of_the_bed_leave_it_out() -> None:
    """Two settings, one of them on one bed of three: nothing tells pairs from chance."""
    design = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    fit = fit_effects(design, np.array([0.0, 1.0, 2.0, 1.0]), [1, 2, 3, 1])
    assert (fit.bed_fraction, fit.degrees) == (0.0, 2)


def test_the_share_of_the_bed_is_found() -> None:
    rng = np.random.default_rng(7)
    design = factors(True).design()
    fractions = [
        fit_effects(design, simulated(rng, 0.7, BEDS), BEDS).bed_fraction for _ in range(60)
    ]
    none = [fit_effects(design, simulated(rng, 0.0, BEDS), BEDS).bed_fraction for _ in range(60)]
    assert np.median(fractions) > 0.5 and np.median(none) < 0.1


def test_a_difference_on_the_same_beds_is_narrower() -> None:
    rng = np.random.default_rng(11)
    own = factors(True)
    contrast = weights(own, {"modulus": 0.01, "step": 0.2})
    apart = list(range(len(RUNS)))

    def scatter(beds: list[int]) -> tuple[float, float]:
        fits = [fit_effects(own.design(), simulated(rng, 0.8, beds), beds) for _ in range(80)]
        found = [fit.contrast(contrast) for fit in fits]
        return float(np.std([one for one, _ in found])), float(np.mean([e for _, e in found]))

    (paired, paired_error), (single, single_error) = scatter(BEDS), scatter(apart)
    assert paired < 0.7 * single and paired_error < 0.7 * single_error


def test_too_few_runs_and_effects_that_go_together_are_refused() -> None:
    with pytest.raises(SeriesError, match="run more seeds"):
        fit_effects(np.eye(2), np.zeros(2), ["a", "b"])
    settings = [REFERENCE, {"modulus": 0.1, "step": 0.5}] * 3
    design = Factors(settings, REFERENCE, additive=True).design()
    with pytest.raises(SeriesError, match="confounded"):
        fit_effects(design, np.zeros(6), list(range(6)))


def test_effects_are_those_of_generalised_least_squares() -> None:
    """Aitken 1936: (X' V^-1 X)^-1 X' V^-1 y, V as the fraction of the bed says."""
    rng, beds = np.random.default_rng(3), ["a", "b", "a", "c", "b", "a", "c", "b"]
    design = np.column_stack([np.ones(8), np.arange(8.0)])
    own = dict(zip("abc", rng.normal(size=3), strict=True))
    values = np.array([own[bed] for bed in beds]) + 0.3 * rng.normal(size=8)
    fit = fit_effects(design, values, beds)
    assert 0.0 < fit.bed_fraction < 0.98
    same = np.array([[one == other for other in beds] for one in beds], dtype=float)
    inverse = np.linalg.inv((1 - fit.bed_fraction) * np.eye(8) + fit.bed_fraction * same)
    normal = design.T @ inverse @ design
    assert fit.effects == pytest.approx(np.linalg.solve(normal, design.T @ inverse @ values))
    left = values - design @ fit.effects
    variance = left @ inverse @ left / 6
    assert fit.residual_std == pytest.approx(np.sqrt(variance))
    assert fit.covariance == pytest.approx(variance * np.linalg.inv(normal))
    assert fit.degrees == 8 - 2 - 2

"""Effects of settings with a random bed: known effects, coverage of intervals, pairing."""

import numpy as np
import pytest
from scipy import stats

from dragchain.errors import SeriesError
from dragchain.statistics.bed_effects import Factors, Whitened, correlation, fit_effects, same

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


OWN_BEDS = ["a", "b", "a", "c", "b", "a"]


def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    design = np.column_stack([np.ones(6), np.arange(6.0)])
    errors = np.diag(rng.uniform(0.1, 1.0, 6))
    return design, rng.normal(size=6), correlation(same(OWN_BEDS), 0.4) + errors


def test_runs_from_one_bed_share_a_part_of_their_variance() -> None:
    assert same(OWN_BEDS)[0].tolist() == [1, 0, 1, 0, 0, 1]
    covariance = correlation(same(OWN_BEDS), 0.25)
    assert np.diag(covariance).tolist() == [1.0] * 6
    assert (covariance[0, 2], covariance[0, 1]) == (0.25, 0.0)


def test_effects_and_what_they_leave() -> None:
    """Aitken 1936: (X' V^-1 X)^-1 X' V^-1 y, and the sum of squares in the metric of V."""
    design, values, covariance = problem()
    model = Whitened.of(design, values, covariance)
    inverse = np.linalg.inv(covariance)
    normal = design.T @ inverse @ design
    effects = np.linalg.solve(normal, design.T @ inverse @ values)
    left = values - design @ effects
    assert model.effects == pytest.approx(effects)
    assert model.covariance == pytest.approx(np.linalg.inv(normal))
    assert model.square == pytest.approx(left @ inverse @ left)
    assert model.degrees == 4


def test_determinants_of_the_restricted_likelihood() -> None:
    design, values, covariance = problem()
    model = Whitened.of(design, values, covariance)
    normal = design.T @ np.linalg.inv(covariance) @ design
    expected = 0.5 * (np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(normal)[1])
    assert model.log_determinants == pytest.approx(expected)

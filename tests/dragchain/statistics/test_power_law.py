"""Power laws with noise that is known."""

import numpy as np
import pytest
from scipy import stats

from dragchain.errors import SeriesError
from dragchain.statistics.power_law import RunMeans, fit_power_law, fit_shifted, fit_two_terms

DEPTHS = (10.0, 20.0, 30.0, 40.0, 50.0)


def sweep(
    random: np.random.Generator,
    *,
    exponent: float = 2.0,
    bend: float = 0.0,
    levels: tuple[float, ...] = DEPTHS,
    seeds: int = 2,
    spread: float = 0.06,
    bed_fraction: float = 0.2,
    error: float = 0.03,
) -> RunMeans:
    """Runs of a power law, bent in logarithms, with beds, chance and errors of the means."""
    x = np.repeat(levels, seeds)
    beds = list(range(seeds)) * len(levels)
    of_bed = random.normal(0.0, spread * np.sqrt(bed_fraction), seeds)
    own = random.normal(0.0, spread * np.sqrt(1.0 - bed_fraction), len(x))
    errors = error * random.uniform(0.5, 1.5, len(x))
    law = exponent * np.log(x / 25.0) + bend * np.log(x / 25.0) ** 2
    noise = of_bed[beds] + own + random.normal(0.0, errors)
    return RunMeans(x, np.exp(law + noise), errors, beds)


@pytest.mark.slow
@pytest.mark.parametrize("bed_fraction", [0.0, 0.6])
def test_the_interval_holds_the_exponent_as_often_as_it_says(bed_fraction: float) -> None:
    random = np.random.default_rng(5)
    laws = [fit_power_law(sweep(random, bed_fraction=bed_fraction)) for _ in range(300)]
    held = sum(law.exponent.contains(2.0) for law in laws)
    falsely = sum(law.lack_of_fit is not None and law.lack_of_fit < 0.05 for law in laws)
    assert stats.binomtest(held, 300, 0.95).pvalue > 0.001
    assert stats.binomtest(falsely, 300, 0.05, alternative="greater").pvalue > 0.001


def test_without_noise_the_law_is_found() -> None:
    x = np.repeat(DEPTHS, 2)
    law = fit_power_law(RunMeans(x, 3.0 * x**1.7, np.full(10, 1e-3), [1, 2] * 5))
    assert law.exponent.value == pytest.approx(1.7, abs=1e-9)
    assert law.at(20.0).value == pytest.approx(3.0 * 20.0**1.7)
    assert [one.value for one in law.local_exponents()] == pytest.approx([1.7] * 4)
    assert [law.level(n).value for n in range(5)] == pytest.approx([3.0 * d**1.7 for d in DEPTHS])


def test_more_noise_makes_wider_intervals() -> None:
    random = np.random.default_rng(1)
    widths = []
    for spread in (0.02, 0.2):
        exponents = [fit_power_law(sweep(random, spread=spread)).exponent for _ in range(5)]
        widths.append(np.median([one.ci95_high - one.ci95_low for one in exponents]))
    assert widths[1] > 3.0 * widths[0]


def test_a_less_certain_run_counts_less() -> None:
    x = np.repeat([1.0, 2.0, 4.0], 2)
    values = x.copy()
    values[-1] *= 2.0  # a run that is off
    beds = list(range(6))
    errors = np.full(6, 0.01)
    same = fit_power_law(RunMeans(x, values, errors, beds)).exponent
    errors[-1] = 1.0
    less = fit_power_law(RunMeans(x, values, errors, beds)).exponent
    assert abs(less.value - 1.0) < 0.2 * abs(same.value - 1.0)


def test_a_bent_law_is_found_out() -> None:
    random = np.random.default_rng(2)
    bent = [fit_power_law(sweep(random, bend=0.5, spread=0.03)) for _ in range(30)]
    found = [law.lack_of_fit is not None and law.lack_of_fit < 0.05 for law in bent]
    assert sum(found) >= 24


def test_one_level_off_the_law_is_named() -> None:
    runs = sweep(np.random.default_rng(3), spread=0.01, error=0.01)
    off = RunMeans(runs.x, np.where(runs.x == 30.0, 1.3, 1.0) * runs.values, runs.errors, runs.beds)
    law = fit_power_law(off)
    deviations = [law.deviation(number) for number in range(5)]
    third = deviations[2]
    assert third is not None and third.ci95_low > 0.1 and third.contains(0.3)
    assert law.lack_of_fit is not None and law.lack_of_fit < 0.01


def test_one_run_a_level_cannot_test_the_fit() -> None:
    law = fit_power_law(sweep(np.random.default_rng(4), seeds=1))
    assert law.lack_of_fit is None and law.exponent.contains(2.0)


def test_an_offset_and_a_lower_term_are_found() -> None:
    x = np.repeat(DEPTHS, 2)
    errors, beds = np.full(10, 0.01), [1, 2] * 5
    noise = np.exp(np.random.default_rng(6).normal(0.0, 0.01, 10))
    shifted = RunMeans(x, 0.01 * (x + 8.0) ** 2 * noise, errors, beds)
    found = fit_shifted(fit_power_law(shifted), 2.0)
    assert found.offset is not None and found.offset.contains(8.0)
    assert 6.0 < found.offset.ci95_low < found.offset.ci95_high < 10.0
    assert found.at(30.0) == pytest.approx(0.01 * 38.0**2, rel=0.03)
    summed = RunMeans(x, (0.01 * x**2 + 0.3 * x) * noise, errors, beds)
    terms = fit_two_terms(fit_power_law(summed), 2.0)
    assert terms.lower_fraction.contains(15.0 / 40.0)


def test_an_offset_without_bound_is_none() -> None:
    runs = sweep(np.random.default_rng(7), exponent=0.0, levels=(3.0, 3.1, 3.2), spread=0.3)
    assert fit_shifted(fit_power_law(runs), 1.0).offset is None


@pytest.mark.parametrize(
    ("values", "words"),
    [([1.0, 2.0, -1.0, 1.0], "above zero"), ([1.0, 2.0, np.nan, 1.0], "finite")],
)
def test_values_that_have_no_logarithm_are_refused(values: list[float], words: str) -> None:
    with pytest.raises(SeriesError, match=words):
        RunMeans(np.array([1.0, 2.0, 3.0, 4.0]), np.array(values), np.full(4, 0.1), [1, 2, 3, 4])


def test_too_few_levels_and_runs_are_refused() -> None:
    with pytest.raises(SeriesError, match="2 level"):
        RunMeans(np.array([1.0, 2.0, 2.0]), np.ones(3), np.full(3, 0.1), [1, 2, 3])
    with pytest.raises(SeriesError, match="more seeds"):
        RunMeans(np.array([1.0, 2.0, 3.0]), np.ones(3), np.full(3, 0.1), [1, 1, 2])

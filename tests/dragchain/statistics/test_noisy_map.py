"""Percentiles of maps whose patches are known with errors."""

import numpy as np
import pytest

from dragchain.arrays import Floats
from dragchain.statistics.noisy_map import LARGEST_ERROR, map_spread

AREA, PATCH = np.ones(200), np.arange(200)


def measured(true: Floats, packings: int, events: float, seed: int = 1) -> tuple[Floats, Floats]:
    """A map with so many contact events of equal size on a mean patch, and its errors."""
    random = np.random.default_rng(seed)
    number = random.poisson(true * events, (packings, len(true)))
    return number / events, np.sqrt(number) / events


def fifth(true: Floats) -> float:
    return float(np.quantile(true / true.mean(), 0.05, method="inverted_cdf"))


@pytest.mark.parametrize("packings", [1, 3])
def test_a_percentile_is_shrunk_to_that_of_the_true_map(packings: int) -> None:
    """Half of the patches have a sixth of the load of the others."""
    true = np.where(PATCH < 100, 0.3, 1.7)
    values, errors = measured(true, packings, 60 / packings)
    low, high = map_spread(values, errors, AREA, PATCH).percentiles
    naive = fifth(values.mean(axis=0))
    assert naive < 0.8 * 0.3  # what was reported
    assert abs(low.value - 0.3) < 0.8 * abs(naive - 0.3)
    assert abs(high.value - 1.7) < 0.3


@pytest.mark.parametrize("packings", [1, 2, 3, 5])
@pytest.mark.parametrize("low_n", [0.3, 1.0])
def test_the_intervals_contain_the_percentiles_of_groups_of_equal_loads(
    packings: int, low_n: float
) -> None:
    """Two groups, and one; 60 events on a mean patch. A wide prior alone contained half of them."""
    hits, true = [], np.where(PATCH < 100, low_n, 2 - low_n)
    for seed in range(12):
        values, errors = measured(true, packings, 60 / packings, seed)
        low, high = map_spread(values, errors, AREA, PATCH).percentiles
        hits += [low.contains(low_n), high.contains(2 - low_n)]
    assert np.mean(hits) > 0.9


def test_without_errors_the_percentiles_are_those_of_the_map() -> None:
    true = np.random.default_rng(2).lognormal(0.0, 0.5, 200)
    values, errors = measured(true, 1, 1e7)
    low, _ = map_spread(values, errors, AREA, PATCH).percentiles
    assert low.value == pytest.approx(fifth(true), rel=0.03)
    assert low.relative_half_width < 0.1


def test_facets_of_a_patch_are_one_measurement() -> None:
    """Four facets to a patch are the patch of their area."""
    true = np.random.default_rng(2).lognormal(0.0, 0.5, 200)
    values, errors = measured(true, 2, 50)
    whole = map_spread(values, errors, AREA, PATCH)
    four = map_spread(
        np.repeat(values, 4, axis=1), np.repeat(errors, 4, axis=1),
        np.repeat(AREA / 4, 4), np.repeat(PATCH, 4),
    )  # fmt: skip
    assert four.percentiles == whole.percentiles


@pytest.mark.parametrize("packings", [1, 2, 5])
def test_a_short_path_has_no_percentile(packings: int) -> None:
    """Patches with three events, and a map of which a tenth was not touched."""
    values, errors = measured(np.ones(200), packings, 3 / packings)
    spread = map_spread(values, errors, AREA, PATCH)
    assert not spread.percentiles[0].known and spread.errors[0] > LARGEST_ERROR
    values, errors = measured(np.where(PATCH < 20, 0.0, 1.0), packings, 1000)
    spread = map_spread(values, errors, AREA, PATCH)
    assert not spread.percentiles[0].known and spread.errors[0] > LARGEST_ERROR
    assert spread.percentiles[1].known


def test_a_map_without_any_load() -> None:
    nothing = np.zeros((2, 200))
    spread = map_spread(nothing, nothing, AREA, PATCH)
    assert not any(one.known for one in spread.percentiles)

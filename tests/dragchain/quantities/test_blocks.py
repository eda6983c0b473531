"""The estimator of all quantities: values by hand, and intervals that cover a known truth."""

import math

import numpy as np
import pytest

from dragchain.arrays import Floats
from dragchain.quantities.blocks import Blocks, estimate_of
from dragchain.quantities.document import PathQuantities
from dragchain.quantities.registry import MEASURED, Quantity
from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import NORMAL_QUANTILE
from dragdeck.records.windows import UNKNOWN, Known

NAMED = {quantity.name: quantity for quantity in MEASURED}
DRAG, STD, RATIO = (NAMED[name] for name in ("drag_mean", "drag_std", "ahead_behind"))


def known(**changes: float) -> Known:
    return UNKNOWN.model_copy(update=changes)


def plain(values: Floats) -> Blocks:
    return Blocks(values, np.ones(len(values)))


def test_a_mean_of_ratios_is_the_ratio_of_the_sums() -> None:
    blocks = Blocks.ratio([2.0, 0.0, 9.0], [1.0, 0.0, 3.0])
    assert blocks.values == pytest.approx([2.0, math.nan, 3.0], nan_ok=True)
    assert blocks.mean == pytest.approx(11.0 / 4.0)
    assert blocks.series.mean() == pytest.approx(blocks.mean)
    assert blocks.means(3) == pytest.approx([2.0, math.nan, 3.0], nan_ok=True)
    assert math.isnan(blocks.part(slice(1, 2)).mean)


def test_squares_are_rooted_and_fractions_become_ratios_after_their_mean() -> None:
    along = PathQuantities(
        blocks={"drag_mean": (1.0, 7.0), "drag_std": (1.0, 7.0), "ahead_behind": (0.7, 0.8)},
        weights={"ahead_behind": (1.0, 1.0)},
    )
    assert along.values() == pytest.approx({"drag_mean": 4, "drag_std": 2, "ahead_behind": 3})
    assert along.values(1) == pytest.approx({"drag_mean": 7, "drag_std": 7**0.5, "ahead_behind": 4})


def test_a_block_without_a_value_is_left_out_and_a_quantity_without_any_too() -> None:
    along = PathQuantities(
        blocks={"chain_length": (None, 4.0, 5.0), "path_bottleneck": (None, None, None)},
        weights={"chain_length": (0.0, 1.0, 3.0), "path_bottleneck": (0.0, 0.0, 0.0)},
    )
    assert along.values() == pytest.approx({"chain_length": 4.75})
    assert set(along.estimates({})) == {"chain_length"}
    assert not along.estimates({})["chain_length"].reliable  # three blocks


def test_contacts_on_one_side_alone_have_no_ratio() -> None:
    along = PathQuantities(blocks={"ahead_behind": (1.0,) * 12})
    assert along.values() == {}


def test_the_interval_is_that_of_a_correlated_series() -> None:
    """The estimator by the whole autocorrelation is its check, on a path long enough for it."""
    values = correlated(np.random.default_rng(1), 4000, 0.4)
    estimate, expected = estimate_of(DRAG, plain(values)), estimate_mean(values).estimate
    assert estimate.value == pytest.approx(expected.value)
    assert estimate.half_width == pytest.approx(expected.half_width, rel=0.05)


def test_the_scatter_from_packing_to_packing_adds_to_that_along_the_path() -> None:
    blocks = plain(1.0 + 0.1 * np.random.default_rng(1).normal(size=40))
    alone, wider = estimate_of(DRAG, blocks), estimate_of(DRAG, blocks, known(packing_std=0.05))
    between = NORMAL_QUANTILE * 0.05 * alone.value
    assert wider.half_width == pytest.approx(math.hypot(alone.half_width, between))


def test_what_is_zero_all_along_has_no_interval() -> None:
    estimate = estimate_of(NAMED["chain_count"], plain(np.zeros(12)))
    assert estimate.value == 0.0 and not estimate.known


def test_an_interval_from_a_few_events_is_not_reliable() -> None:
    few, many = np.zeros(40), np.random.default_rng(1).poisson(9.0, 40).astype(float)
    few[[3, 20]] = 1.0
    peaks = NAMED["peaks"]
    assert not estimate_of(peaks, plain(few)).reliable
    assert estimate_of(peaks, plain(many)).reliable


# --- coverage ------------------------------------------------------------------------------------


def correlated(rng: np.random.Generator, count: int, correlation: float) -> Floats:
    """A normal series of mean 0 and variance 1 with this correlation from one to the next."""
    noise = rng.normal(size=count) * math.sqrt(1.0 - correlation**2)
    noise[0] = rng.normal()
    for at in range(1, count):
        noise[at] += correlation * noise[at - 1]
    return np.asarray(noise)


TRIALS = 2000
LOWEST, HIGHEST = 0.93, 0.97


def truth_is_covered(
    rng: np.random.Generator, quantity: Quantity, count: int, correlation: float, of_others: float
) -> bool:
    """Whether the interval of one path includes the value of an infinitely long one."""
    others, waves = known(correlation=of_others), correlated(rng, count, correlation)
    if quantity is STD:
        three = [correlated(rng, count, correlation) for _ in range(3)]
        squares = np.square([waves, *three]).mean(axis=0)
        return estimate_of(STD, plain(squares), others).contains(1.0)
    if quantity is RATIO:
        load = rng.gamma(10.0, size=count)
        fraction = 1.0 / (1.0 + np.exp(-2.0 - 0.5 * waves))
        return estimate_of(RATIO, Blocks(fraction, load), others).contains(_ODDS)
    contacts = rng.poisson(30.0, count).astype(float)
    return estimate_of(DRAG, Blocks(-2.5 + 0.4 * waves, contacts), others).contains(-2.5)


_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(60)
_MEAN = float(_WEIGHTS @ (1.0 / (1.0 + np.exp(-2.0 - 0.5 * _NODES))) / _WEIGHTS.sum())
_ODDS = _MEAN / (1.0 - _MEAN)


@pytest.mark.slow
@pytest.mark.parametrize(("correlation", "of_others"), [(0.0, 0.1), (0.2, 0.2), (0.3, 0.3)])
@pytest.mark.parametrize("count", [6, 12, 40, 100])
@pytest.mark.parametrize("quantity", [DRAG, STD, RATIO], ids=lambda quantity: quantity.name)
def test_intervals_cover_the_truth(
    quantity: Quantity, count: int, correlation: float, of_others: float
) -> None:
    rng = np.random.default_rng(count)
    covered = np.mean(
        [truth_is_covered(rng, quantity, count, correlation, of_others) for _ in range(TRIALS)]
    )
    chance = 2.5 * math.sqrt(0.95 * 0.05 / TRIALS)
    assert LOWEST - chance <= covered <= HIGHEST + chance

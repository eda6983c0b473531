"""Values at physical stiffness from windows of which the truth is known."""

import math

import numpy as np
import pytest

from dragchain.statistics.estimate import Estimate, student_quantile
from dragchain.windows.estimate import Paired, corrected_map, paired, windows_needed
from dragdeck.records.windows import UNKNOWN

KNOWN = UNKNOWN.model_copy(update={"slope": 0.5, "variance_ratio": 1.0, "degrees": 10.0})
SOFT = np.array([0.9, 1.0, 1.1] * 6)


def test_without_knowledge_it_is_the_mean_with_students_interval() -> None:
    windows = np.array([-2.0, -2.4, -2.2, -2.6])
    value = paired(windows, np.full(4, -3.0), np.array([-3.0, -3.0]), UNKNOWN)
    half = student_quantile(3) * windows.std(ddof=1) / 2
    assert value.value == pytest.approx(-2.3)
    assert value.estimate(4).half_width == pytest.approx(half)
    assert value.estimate(4).ci95_low == pytest.approx(-2.3 - half)


def test_the_mean_follows_the_soft_run_by_the_slope() -> None:
    """Beside the windows the soft run is a tenth above its mean."""
    windows = np.array([2.1, 2.2, 2.3])
    value = paired(windows, np.array([1.1, 1.1, 1.1]), SOFT, KNOWN)
    assert value.value == pytest.approx(2.2 * (1 + 0.5 * (1 / 1.1 - 1)))
    assert value.path_variance == pytest.approx(0.25 * (SOFT / 1.0).var(ddof=1) / len(SOFT))


@pytest.mark.parametrize(("slope_std", "slope"), [(0.0, 0.5), (1e3, 0.8), (0.2, 0.8)])
def test_the_slope_is_shrunk_to_that_of_other_scenes(slope_std: float, slope: float) -> None:
    beside = np.array([0.8, 1.2, 0.9, 1.1])
    rest = 0.01 * np.array([1.0, 1.0, -1.0, -1.0])
    windows = 3.0 * (1.0 + 0.8 * (beside - 1.0) + rest)
    known = UNKNOWN.model_copy(update={"slope": 0.5, "slope_std": slope_std})
    value = paired(windows, beside, np.full(8, 1.1), known)
    learned = (value.value / windows.mean() - 1.0) / 0.1
    assert learned == pytest.approx(slope, abs=0.03 if slope_std == 0.2 else 1e-4)
    assert 0.5 <= learned <= 0.8 + 1e-4


def test_the_root_of_a_mean_square_has_half_its_relative_errors() -> None:
    squares = np.array([0.98, 1.0, 1.02, 1.0]) * 9.0
    known = KNOWN.model_copy(update={"packing_std": 0.1})
    root = paired(squares, squares, squares, known).root
    linear = paired(np.sqrt(squares), np.sqrt(squares), np.sqrt(squares), known)
    assert root.value == pytest.approx(3.0, rel=1e-3)
    assert root.relative_half_width(4) == pytest.approx(linear.relative_half_width(4), rel=1e-2)


def test_the_scatter_of_the_soft_run_counts_beside_that_of_the_windows() -> None:
    known = KNOWN.model_copy(update={"slope": 0.0, "variance_ratio": 0.5})
    soft = 1.0 + 0.2 * np.random.default_rng(1).normal(size=400)
    equal = paired(np.ones(3), np.ones(3), soft, known)
    assert equal.window_variance == pytest.approx(10 * 0.5 * 0.2**2 / 12, rel=0.15)
    assert equal.degrees == 12


def test_the_scatter_between_packings_is_not_reduced_by_windows() -> None:
    known = KNOWN.model_copy(update={"packing_std": 0.06})
    value = paired(np.array([1.0, 1.02, 0.98]), np.ones(3), np.array([0.99, 1.0, 1.01]), known)
    alone = value.relative_half_width(1000)
    assert alone > 0.12
    assert value.relative_half_width(1000, packings=4) == pytest.approx(alone / 2)
    assert windows_needed(value, 3, 0.1, 16).packings == 2


def test_as_many_windows_as_needed_bring_the_half_width_inside() -> None:
    known = KNOWN.model_copy(update={"slope": 0.0})
    windows = np.array([0.9, 1.0, 1.1])
    value = paired(windows, np.ones(3), windows, known)
    need = windows_needed(value, 3, 0.05, 64)
    assert need.packings == 1
    enough, fewer = map(value.relative_half_width, (need.windows, need.windows - 1))
    assert enough <= 0.05 < fewer


def test_packings_have_the_whole_drag_where_that_says_more() -> None:
    value = Paired(1.0, 0.04, 0.0, 0.0, 10, whole_variance=0.05**2)
    assert value.relative_half_width(4) > 0.2
    assert windows_needed(value, 3, 0.05, 4).packings == math.ceil((1.96 * 0.05 / 0.05) ** 2)


BINS, WINDOWS, LENGTH, TRIALS = 48, 3, 12, 200


@pytest.mark.parametrize(
    ("event", "unlike"), [(0.002, 0.0), (0.002, 0.3), (0.01, 0.3), (0.0002, 0.3), (0.0002, 0.0)]
)
def test_the_error_is_as_stated_and_below_that_of_either_map(event: float, unlike: float) -> None:
    """A bin is a sum of events of one size; the soft run's map is another one by `unlike`."""
    rng = np.random.default_rng(1)

    def measured(load: np.ndarray, lengths: int) -> np.ndarray:
        return rng.poisson(load * lengths / event) * event / lengths

    errors = []
    for _ in range(TRIALS):
        truth = rng.gamma(0.6, 1.0, BINS)
        truth /= truth.sum()
        windows = [measured(truth, 1) for _ in range(WINDOWS)]
        soft = measured(1.2 * truth * np.exp(unlike * rng.normal(size=BINS)), LENGTH)
        total = Estimate.around(1.0 + 0.05 * rng.normal(), 0.1)
        found = corrected_map(soft, windows, total, LENGTH)
        assert found is not None
        own, of_soft, of_windows = (
            np.abs(np.asarray(one) - truth).sum()
            for one in (found.value, soft, np.mean(windows, axis=0))
        )
        errors.append((own, found.error, of_soft, found.soft_error, of_windows))
    own, stated, of_soft, stated_of_soft, of_windows = np.mean(errors, axis=0)
    assert stated == pytest.approx(own, rel=0.15)
    assert stated_of_soft == pytest.approx(of_soft, rel=0.1)
    assert own < of_soft
    assert own < of_windows + 0.04  # the error of the total load, which windows here lack


def test_a_single_window_is_too_few() -> None:
    assert corrected_map([1.0, 2.0], [[1.0, 2.0]], Estimate.around(3.0, 0.1), 5.0) is None
    assert corrected_map([1.0, 2.0], [[1.0, 2.0], []], Estimate.around(3.0, 0.1), 5.0) is None

"""Values at physical stiffness from windows of which the truth is known."""

import math

import numpy as np
import pytest

from dragchain.quantities.known import UNKNOWN
from dragchain.statistics.estimate import Estimate, student_quantile
from dragchain.windows.estimate import corrected_map, joined, joined_squares, windows_needed

DRAG = UNKNOWN.model_copy(
    update={"ratio_log": 0.1, "ratio_log_std": 0.05, "variance_ratio": 1.0, "degrees": 10.0}
)


def test_without_knowledge_it_is_the_mean_with_students_interval() -> None:
    windows = np.array([-2.0, -2.4, -2.2, -2.6])
    found = joined(windows, np.array([-3.0, -3.0]), UNKNOWN)
    half = student_quantile(3) * windows.std(ddof=1) / 2
    assert found.value == pytest.approx(-2.3)
    assert found.half_width(4) == pytest.approx(half)
    assert found.estimate(4).ci95_low == pytest.approx(-2.3 - half)


def test_the_root_of_a_mean_square_has_half_its_relative_errors() -> None:
    squares = np.array([0.98, 1.0, 1.02, 1.0]) * 9.0
    root = joined_squares(squares, squares, DRAG.model_copy(update={"ratio_log": 0.0}))
    linear = joined(np.sqrt(squares), np.sqrt(squares), DRAG.model_copy(update={"ratio_log": 0.0}))
    assert root.value == pytest.approx(3.0, rel=1e-3)
    assert root.half_width(4) == pytest.approx(linear.half_width(4), rel=1e-2)


def test_other_scenes_narrow_the_interval_if_they_agree() -> None:
    soft = np.array([0.9, 1.0, 1.1] * 6)
    near, far = ([ratio - 0.1, ratio, ratio + 0.1] for ratio in (1.12, 1.8))
    alone = DRAG.model_copy(update={"ratio_log_std": math.inf})
    assert joined(near, soft, DRAG).half_width(3) < 0.9 * joined(near, soft, alone).half_width(3)
    assert joined(far, soft, DRAG).value == pytest.approx(1.8)
    between = joined(near, soft, DRAG).value
    assert math.exp(0.1) < between < 1.12


def test_the_scatter_of_the_soft_run_counts_beside_that_of_the_windows() -> None:
    known = DRAG.model_copy(update={"ratio_log_std": math.inf})
    soft = 1.0 + 0.2 * np.random.default_rng(1).normal(size=400)
    equal = joined([1.0, 1.0, 1.0], soft, known)
    assert equal.window_variance == pytest.approx(10 * 0.2**2 / 12, rel=0.15)
    assert equal.degrees == 12


def test_the_scatter_between_packings_is_not_reduced_by_windows() -> None:
    known = DRAG.model_copy(update={"ratio_log_std": math.inf, "packing_std": 0.06})
    found = joined([1.0, 1.02, 0.98], np.array([0.99, 1.0, 1.01]), known)
    assert found.half_width(1000) > 0.12
    assert found.half_width(1000, packings=4) == pytest.approx(found.half_width(1000) / 2)
    assert windows_needed(found, 3, 0.1, 16).packings == 2


def test_as_many_windows_as_needed_bring_the_half_width_inside() -> None:
    known = DRAG.model_copy(update={"ratio_log_std": math.inf})
    found = joined([0.9, 1.0, 1.1], np.array([0.9, 1.0, 1.1]), known)
    need = windows_needed(found, 3, 0.05, 64)
    assert need.packings == 1
    assert found.half_width(need.windows) <= 0.05 < found.half_width(need.windows - 1)


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

"""Load maps at physical stiffness, of simulated windows with a known map."""

import numpy as np
import pytest

from dragchain.statistics.estimate import Estimate
from dragchain.windows.load_map import corrected

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
        found = corrected(soft, windows, total, LENGTH)
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
    assert corrected([1.0, 2.0], [[1.0, 2.0]], Estimate.around(3.0, 0.1), 5.0) is None
    assert corrected([1.0, 2.0], [[1.0, 2.0], []], Estimate.around(3.0, 0.1), 5.0) is None

"""Values at physical stiffness from windows of which the truth is known."""

import math

import numpy as np
import pytest

from dragchain.statistics.estimate import student_quantile
from dragchain.windows.estimate import UNKNOWN, Known, joined, windows_needed

DRAG = Known(ratio_log=0.1, ratio_log_std=0.05, variance_ratio=1.0, degrees=10.0, packing_std=0.0)


def test_without_knowledge_it_is_the_mean_with_students_interval() -> None:
    windows = np.array([-2.0, -2.4, -2.2, -2.6])
    found = joined(windows, np.array([-3.0, -3.0]), UNKNOWN)
    half = student_quantile(3) * windows.std(ddof=1) / 2
    assert found.value == pytest.approx(-2.3)
    assert found.half_width(4) == pytest.approx(half)
    assert found.estimate(4).ci95_low == pytest.approx(-2.3 - half)


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

"""The distribution of contact forces as it is drawn."""

import numpy as np
import pytest

from dragchain.tradeoff.figures import exceedance


def test_the_share_above_a_force_is_counted_from_above() -> None:
    counts = np.zeros(70, dtype=int)
    counts[[10, 20]] = 3, 1
    force, fraction, mean = exceedance(counts.tolist())
    assert fraction[10] == 1.0 and fraction[11] == 0.25 and fraction[21] == 0.0
    assert mean == pytest.approx((3 * force[10] + force[20]) / 4 * 10**0.05)

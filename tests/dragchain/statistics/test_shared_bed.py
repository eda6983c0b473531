"""Generalised least squares against its textbook form."""

import numpy as np
import pytest

from dragchain.statistics.shared_bed import Whitened, alike, same

BEDS = ["a", "b", "a", "c", "b", "a"]


def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    design = np.column_stack([np.ones(6), np.arange(6.0)])
    errors = np.diag(rng.uniform(0.1, 1.0, 6))
    return design, rng.normal(size=6), alike(same(BEDS), 0.4) + errors


def test_runs_from_one_bed_share_a_part_of_their_variance() -> None:
    assert same(BEDS)[0].tolist() == [1, 0, 1, 0, 0, 1]
    covariance = alike(same(BEDS), 0.25)
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

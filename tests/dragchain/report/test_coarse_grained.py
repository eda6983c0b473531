"""Extrapolation to the true size of the particles, of runs whose true values are known."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dragchain.quantities.document import RunQuantities
from dragchain.report.coarse_grained import (
    NO_RULE,
    TOO_FEW,
    Extrapolation,
    coarse_grained,
    fit_line,
    table_of_sizes,
)
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate


def run(factor: float, seed: int = 1, relative: float = 0.05, **more: Any) -> RunQuantities:
    """A run whose drag is linear in the size, whose contacts follow d^-2, and f = 1.25 F / n."""
    drag, contacts = 0.25 * (1 + 0.8 * (factor - 1)), 25.0 / factor**2
    values = {
        "drag_mean": -drag,
        "workpiece_contacts": contacts,
        "contact_force_mean": 1.25 * drag / contacts,
        "drag_std": 0.1,
        **more.pop("values", {}),
    }
    estimates = {
        name: Estimate.around(value, NORMAL_QUANTILE * relative * abs(value))
        for name, value in values.items()
    }
    media = SimpleNamespace(typical_radius_m=1e-3 * factor, fill_height_m=0.05, mass_kg=None)
    inputs = {"media.radius_mean_m": 1e-3 * factor, "seed": seed, "reduction.coarser": factor,
              "bowl.radius_m": 0.05, **more}  # fmt: skip
    reduction = SimpleNamespace(coarser=factor)
    study = SimpleNamespace(reduction=reduction, media=media, inputs=lambda: inputs)
    fidelity = {"youngs_modulus_scale": 1e-3, "timestep_fraction": 0.6, "speed_factor": 1.0}
    return RunQuantities.model_construct(
        study=study, run=f"{factor}-{seed}", values_of_run=estimates,
        fidelity=SimpleNamespace(**fidelity, skin_m=1e-4 * factor),
    )  # fmt: skip


def by_name(rows: list[Extrapolation]) -> dict[str, Extrapolation]:
    return {row.quantity: row for row in rows}


def test_each_rule_gives_the_value_at_the_true_size() -> None:
    rows = by_name(coarse_grained([run(k, seed) for k in (1.5, 2.0, 3.0) for seed in (1, 2)]))
    expected = {"drag_mean": -0.25, "workpiece_contacts": 25.0, "contact_force_mean": 0.0125}
    for name, value in expected.items():
        estimate = rows[name].value
        assert estimate is not None and estimate.value == pytest.approx(value)
        assert estimate.ci95_low < value < estimate.ci95_high
        assert rows[name].at_true_size is None and "not contradicted" in rows[name].linearity
    assert rows["drag_std"].value is None and rows["drag_std"].linearity == NO_RULE


def test_the_interval_is_that_of_weighted_least_squares() -> None:
    """Two sizes, by hand: ``a = 2 y(1.5) - y(2)``."""
    line = fit_line(np.array([1.5, 2.0]), np.array([3.0, 4.0]), np.array([0.1, 0.3]))
    assert line is not None and line.value.value == pytest.approx(2.0)
    half = NORMAL_QUANTILE * math.hypot(2 * 0.1, 0.3)
    assert line.value.half_width == pytest.approx(half)
    assert "two sizes" in line.words


def test_scatter_between_packings_widens_the_interval() -> None:
    k, error = np.array([1.5, 1.5, 2.0, 2.0]), np.full(4, 0.01)
    calm = fit_line(k, np.array([3.0, 3.0, 4.0, 4.0]), error)
    wild = fit_line(k, np.array([2.5, 3.5, 3.5, 4.5]), error)
    assert calm is not None and wild is not None
    assert wild.value.half_width > 20 * calm.value.half_width


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    random, inside, tries = np.random.default_rng(1), 0, 400
    k = np.repeat([1.5, 2.0, 3.0], 2)
    error = 0.05 * k
    for _ in range(tries):
        line = fit_line(k, 1.0 + 0.8 * (k - 1) + error * random.standard_normal(6), error)
        assert line is not None
        inside += line.value.contains(1.0)
    assert 0.93 < inside / tries <= 1.0


def test_curvature_is_noticed_with_three_sizes() -> None:
    k = np.array([1.5, 2.0, 3.0])
    line = fit_line(k, (k - 1) ** 2, np.full(3, 0.01))
    assert line is not None and line.p < 1e-6 and "contradicted" in line.words


def test_true_sizes_are_compared_and_not_fitted() -> None:
    runs = [run(k, seed) for k in (1.5, 2.0) for seed in (1, 2)]
    off = [run(1.0, 3, values={"drag_mean": -9.0})]
    drag, without = (by_name(coarse_grained(rows))["drag_mean"] for rows in (runs + off, runs))
    assert drag.at_true_size is not None and drag.at_true_size.value == pytest.approx(-9.0)
    assert drag.value == without.value


def test_scenes_are_kept_apart_and_single_sizes_left_out() -> None:
    wide = [run(k, **{"bowl.radius_m": 0.09}) for k in (1.5, 2.0)]
    rows = coarse_grained([*wide, run(1.5), run(2.0), run(2.0, 1, **{"bowl.height_m": 1.0})])
    assert len(rows) == 2 * len(by_name(rows))
    assert coarse_grained([run(1.5), run(1.5, 2)]) == []
    assert {"value", "value_ci95_low", "linearity"} <= {*table_of_sizes(rows).columns}


def test_a_quantity_without_intervals_is_not_available() -> None:
    missing = {"drag_mean": math.nan}
    rows = by_name(coarse_grained([run(k, values=missing) for k in (1.5, 2.0)]))
    assert rows["drag_mean"].value is None and rows["drag_mean"].linearity == TOO_FEW
    assert rows["contact_force_mean"].value is None
    assert rows["workpiece_contacts"].value is not None

"""A trade of speed against accuracy with made-up numbers, for tests of what reads one."""

from __future__ import annotations

from typing import Any

from dragdeck.cases.case import Case
from dragdeck.scenes.dimensionless import describe


def entry(error: float, bound: float) -> dict[str, Any]:
    """A measured error whose interval is half as wide as its bound to either side."""
    return {
        "error": error, "se": bound / 4, "ci95_low": error - bound / 2,
        "ci95_high": error + bound / 2, "bound": bound, "alone": abs(error), "resolved": False,
    }  # fmt: skip


def setting(
    scale: float, fraction: float, factor: float, cost: float, bound: float | None, **more: Any
) -> dict[str, Any]:
    """A setting with an error of the mean drag."""
    errors = {"drag_mean": None if bound is None else entry(bound / 2, bound)}
    return {
        "youngs_modulus_scale": scale, "timestep_fraction": fraction, "speed_factor": factor,
        "seeds": 4, "runs": 4, "failed": 0, "breaks": False, "arc_m": 0.4,
        "relative_cost": cost, "errors": errors,
    } | more  # fmt: skip


def made_tradeoff(case: Case, **more: Any) -> dict[str, Any]:
    """A trade whose measured scene is that of a case."""
    return {
        "schema": 2, "measured": "2026-01-02", "plan": "made", "study": case.study_name,
        "scene": describe(case),
        "reference": {"youngs_modulus_scale": 1.0, "timestep_fraction": 0.2, "speed_factor": 1.0},
        "quantities": {
            "drag_mean": {
                "label": "mean drag", "unit": "N", "reference": -2.5, "se": 0.02,
                "run_std": 0.04, "arc_m": 0.05,
            },
            "drag_std": {
                "label": "spread of the drag", "unit": "N", "reference": 0.5,
                "se": 0.05, "run_std": 0.1, "arc_m": 0.05,
            },
        },
        "settings": [
            setting(1e-3, 0.6, 1.0, 0.011, 0.13),
            setting(1e-2, 0.5, 1.0, 0.04, 0.045),
            setting(1e-2, 0.5, 4.0, 0.012, 0.08),
            setting(0.1, 0.5, 1.0, 0.13, 0.02),
        ],
        "drop_test": [
            {"timestep_fraction": 0.02, "restitution_error": -1e-4, "relative_cost": 1.0},
            {"timestep_fraction": 0.1, "restitution_error": 4e-3, "relative_cost": 0.2},
        ],
        "costs": [], "checks": [],
    } | more  # fmt: skip

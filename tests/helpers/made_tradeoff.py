"""A trade-off of speed against accuracy with made-up numbers, for tests of what reads one."""

from typing import Any

from dragdeck.cases.case import Case
from dragdeck.outlook.measured import (
    MeasuredCost,
    MeasuredError,
    MeasuredSetting,
    StiffnessRecord,
    Tradeoff,
)
from dragdeck.scenes.dimensionless import describe


def error(value: float, bound: float) -> MeasuredError:
    """A measured error whose interval is half as wide as its bound to either side."""
    return MeasuredError(
        value=value, se=bound / 4, ci95_low=value - bound / 2, ci95_high=value + bound / 2,
        bound=bound, single_parameter_error=abs(value),
    )  # fmt: skip


def setting(
    scale: float, fraction: float, factor: float, cost: float, bound: float | None, **more: Any
) -> MeasuredSetting:
    """A setting with an error of the mean drag."""
    content = {
        "youngs_modulus_scale": scale, "timestep_fraction": fraction, "speed_factor": factor,
        "runs": 4, "failed": 0, "breaks": False, "relative_cost": cost,
        "errors": {} if bound is None else {"drag_mean": error(bound / 2, bound)},
    }  # fmt: skip
    return MeasuredSetting.model_validate(content | more)


def cost(name: str, ratio: float = 1.0, **more: Any) -> MeasuredCost:
    """A cost of the process without an interval."""
    content = {"name": name, "scene": "process", "what": name, "ratio": ratio}
    return MeasuredCost.model_validate(content | {"ci95_low": None, "ci95_high": None} | more)


def made_tradeoff(case: Case, **more: Any) -> Tradeoff:
    """A trade-off whose measured scene is that of a case."""
    content = {
        "measured": "2026-01-02", "plan": "made", "study": case.study_name,
        "versions": {"engine": "3.8.0"},
        "scene": describe(case),
        "reference": {"youngs_modulus_scale": 1.0, "timestep_fraction": 0.2, "speed_factor": 1.0},
        "quantities": {
            "drag_mean": {
                "label": "mean drag", "reference": -2.5, "se": 0.02, "run_std": 0.04,
                "arc_m": 0.05,
            },
            "drag_std": {
                "label": "spread of the drag", "reference": 0.5, "se": 0.05, "run_std": 0.1,
                "arc_m": 0.05,
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
        "costs": [], "promises": [],
    }  # fmt: skip
    return Tradeoff.model_validate(content | more)


def with_settings(tradeoff: Tradeoff, *more: MeasuredSetting) -> Tradeoff:
    """The same with further settings."""
    return tradeoff.model_copy(update={"settings": [*tradeoff.settings, *more]})


def made_stiffness(case: Case, *, amplitude_std: float = 0.05, **numbers: float) -> StiffnessRecord:
    """Laws from scenes whose numbers are half and twice those of a case, but for the given ones."""
    here = {**describe(case), **numbers}
    law = {
        "label": "contacts on the workpiece", "friction": "particle_friction",
        "quantile": 2.0, "path_to_particle": 15.0,
        "law": {
            "rate": 0.25,
            "amplitude": [0.3, 0.1, 0.05],
            "covariance": [
                [2e-4, -1e-4, 0.0, 1e-4], [-1e-4, 1e-4, 0.0, 0.0], [0.0, 0.0, 1e-4, 0.0],
                [1e-4, 0.0, 0.0, 1e-3],
            ],
            "amplitude_std": amplitude_std, "run_std": 0.06,
            "misfit": [[1e-3, 0.02], [1e-2, 0.005]],
        },
    }  # fmt: skip
    scenes = [
        {"numbers": {name: factor * value for name, value in here.items()}, "runs": {"0.001": 1}}
        for factor in (0.5, 2.0)
    ]
    laws = {"workpiece_contacts": law, "drag_mean": {**law, "label": "mean drag"}}
    step = {
        "stiffness": 69.0,
        "damping": 46.0,
        "spread": -1.3,
        "scatter": 0.04,
        "largest": 0.1,
        "runs": 42,
    }
    return StiffnessRecord.model_validate(
        {"measured": "2026-01-03", "scenes": scenes, "laws": laws, "stable_step": step}
    )

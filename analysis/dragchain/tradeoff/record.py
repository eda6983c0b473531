"""The record of a trade, ``tradeoff.json``, which the advisor reads."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.tradeoff.compare import PARAMETERS, Comparison, Setting, Tradeoff, breaks
from dragchain.tradeoff.findings import Costs, Drop
from dragchain.tradeoff.words import long_label

TRADEOFF_SCHEMA = 2


@dataclass(frozen=True)
class Findings:
    """All that tables, figures and page are made of.

    Attributes
    ----------
    trade : Trade
    drops : list of Drop
    costs : Costs
    checks : list of dict
        What `dragchain.checks` wrote.
    provenance : dict
        Head of ``tradeoff.json``.
    """

    tradeoff: Tradeoff
    drops: list[Drop]
    costs: Costs
    checks: list[dict[str, Any]]
    provenance: dict[str, Any]


def provenance(tradeoff: Tradeoff, plan: str, commands: Sequence[str]) -> dict[str, Any]:
    """When, with what and on what a trade was measured."""
    measures = [run.measures for run in tradeoff.runs]
    return {
        "schema": TRADEOFF_SCHEMA,
        "measured": max(one["started"] for one in measures)[:10],
        "commands": list(commands),
        "plan": plan,
        "study": ", ".join(sorted({one["study"] for one in measures})),
        "versions": {
            **{
                name: ", ".join(sorted({str(one["versions"][name]) for one in measures}))
                for name in ("dragdeck", "engine")
            },
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "machine": {"cores": os.cpu_count(), "processor": _processor()},
        "runs": len(measures),
        "engine_hours": sum(one["cost"]["cpu_time_s"] for one in measures) / 3600.0,
    }


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def summarise(found: Findings) -> dict[str, Any]:
    """The content of ``tradeoff.json``, which the advisor reads; a null is a number there is none of.

    An ``arc_m`` of a setting is the compared path of all its complete runs together;
    a ``restitution_error`` is that of the worst impact.
    """
    tradeoff = found.tradeoff
    content = {
        **found.provenance,
        "scene": scene_numbers(tradeoff),
        "reference": {name: getattr(tradeoff.reference, name) for name in PARAMETERS},
        "quantities": {
            name: _quantity_entry(own, tradeoff.arc_m) for name, own in tradeoff.comparisons.items()
        },
        "settings": [_setting_entry(tradeoff, one) for one in tradeoff.settings() if not one.other],
        "drop_test": [
            {
                "timestep_fraction": drop.timestep_fraction,
                "restitution_error": drop.bound,
                "relative_cost": drop.relative_cost,
            }
            for drop in found.drops
            if not drop.other
        ],
        "costs": found.costs.entries,
        "checks": [
            {**check, "scene": check["numbers"], "met": check["met"]} for check in found.checks
        ],
    }
    return {name: _finite(value) for name, value in content.items()}


def scene_numbers(tradeoff: Tradeoff) -> Mapping[str, Any]:
    """Dimensionless numbers of the scene, as the runs at the reference have them."""
    numbers = [run.measures.get("numbers") for run in tradeoff.of(tradeoff.reference)]
    return next((own for own in numbers if own), {})


def _quantity_entry(comparison: Comparison, arc_m: float) -> dict[str, Any]:
    return {
        "label": long_label(comparison.quantity),
        "unit": comparison.quantity.unit,
        "signed": comparison.quantity.signed,
        "reference": comparison.reference,
        "se": comparison.se,
        "run_std": comparison.run_std,
        "arc_m": arc_m,
    }


def _setting_entry(tradeoff: Tradeoff, setting: Setting) -> dict[str, Any]:
    runs = tradeoff.of(setting)
    complete = [run for run in runs if run.complete]
    return {
        **{name: getattr(setting, name) for name in PARAMETERS},
        "seeds": len({run.measures["inputs"]["seed"] for run in runs}),
        "runs": len(runs),
        "failed": len(runs) - len(complete),
        "arc_m": tradeoff.arc_m * len(complete),
        "breaks": breaks(tradeoff, setting),
        "relative_cost": tradeoff.cost(setting),
        "errors": {
            name: {
                **vars(own.errors[setting]),
                "alone": own.alone(setting, tradeoff.reference),
            }
            for name, own in tradeoff.comparisons.items()
            if setting in own.errors
        },
    }


def _finite(value: Any) -> Any:
    """The same with None for every number that is not finite."""
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(own) for own in value]
    return value

"""A trade-off of speed against accuracy with made-up numbers, for tests of what reads one."""

from typing import Any

from dragdeck.records.tradeoff import CostEntry, TradeoffRecord


def cost(name: str, ratio: float = 1.0, **more: Any) -> CostEntry:
    """A cost of the process without an interval."""
    content = {"name": name, "scene": "process", "what": name, "ratio": ratio}
    return CostEntry.model_validate(content | {"ci95_low": None, "ci95_high": None} | more)


def made_tradeoff(**more: Any) -> TradeoffRecord:
    """Two drop tests, and no costs unless they are given."""
    content = {
        "measured": "2026-01-02",
        **dict.fromkeys(("commands", "settings"), ()),
        **{name: {} for name in ("scene", "quantities")},
        **dict.fromkeys(("plan", "study"), "any"),
        **dict.fromkeys(("runs", "engine_hours"), 0),
        "machine": {"cores": 2, "processor": "any"},
        "reference": {"youngs_modulus_scale": 1.0, "timestep_fraction": 0.2, "speed_factor": 1.0},
        "versions": {"engine": "3.8.0"},
        "drop_test": [
            {"timestep_fraction": 0.02, "restitution_error": -1e-4, "relative_cost": 1.0},
            {"timestep_fraction": 0.1, "restitution_error": 4e-3, "relative_cost": 0.2},
        ],
        "costs": [],
    }
    return TradeoffRecord.model_validate(content | more)

"""The motion of a made run, as a study would have it: entries and inputs of its ``case.json``."""

import math
from collections.abc import Mapping
from typing import Any

from dragdeck.study.base import flat
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.model import Motion


def with_motion(
    case: Mapping[str, Any], path: Mapping[str, Any], speed_m_s: float | None = None, **motion: Any
) -> dict[str, Any]:
    """A case whose workpiece is driven along a path in the steps of its drag.

    Parameters
    ----------
    case : mapping
        The content of its ``case.json``.
    path, motion : mapping
        Fields of the study; the length of a line or circle is that of the drag.
    speed_m_s : float, optional
        Speed that is driven; None for one that gives its own.
    """
    drag = next(phase for phase in case["phases"] if phase["name"] == "drag")
    timestep, factor = case["timestep_s"], case["fidelity"]["speed_factor"]
    length = (speed_m_s or 0.0) * (drag["end_step"] - drag["start_step"]) * timestep
    lengths = {
        "line": {"length_m": length},
        "circle": {"revolutions": length / math.tau / path.get("radius_m", 1.0)},
    }
    study = Motion.model_validate(
        {
            "path": {**lengths.get(path["kind"], {}), **path},
            "speed_m_s": None if speed_m_s is None else speed_m_s / factor,
            "immersion_depth_m": case["workpiece"]["immersion_depth_m"],
            "transient_m": 0.0,
            "orientation": "fixed",
            **motion,
        }
    )
    driven = DrivenMotion.of(study, timestep, factor, drag["start_step"])
    inputs = {name: value for name, value in case["inputs"].items() if "motion." not in name}
    return {
        **case,
        "inputs": {**inputs, **flat(study.plain(), "motion.")},
        "motion": driven.path_entry().model_dump(),
        "superposed": [one.model_dump() for one in driven.superposed_entries()],
    }

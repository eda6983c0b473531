"""A study whose windows cost little."""

from typing import Any

import yaml
from paths import SMALL_STUDY

ASKED = ["drag_mean", "workpiece_contacts", "force_slide"]
WINDOWS = {"tolerance": 0.01, "quantities": ASKED, "most": 3}
COEFFICIENT_M2_N = 1e-15


def soft_study() -> dict[str, Any]:
    """The small study with physical moduli as low as cheap windows need, and a longer path."""
    data: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    for material in data["materials"].values():
        material["youngs_modulus_pa"] = float(material["youngs_modulus_pa"]) / 100
    data["motion"] |= {"speed_m_s": 0.05, "transient_m": 0.012}
    data["motion"]["path"]["revolutions"] = 1
    data["motion"]["spin"] = {"rpm": 30}
    data["removal"] = {"coefficient_m2_n": COEFFICIENT_M2_N}
    data["outputs"] = {"first_touch_fraction": 0.05}
    return data


def study_with_windows() -> dict[str, Any]:
    """The study with windows that do not suffice."""
    return soft_study() | {
        "fidelity": {
            "youngs_modulus_scale": 0.1, "timestep_fraction": 0.5, "ranks": 1, "windows": WINDOWS,
        }
    }  # fmt: skip

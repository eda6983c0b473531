"""What the tests of scenes share."""

from typing import Any

import pytest
from made_study import Made

from dragdeck.cases.case import Case

OWN_SPEED = ("rest", "waypoints")
"""Kinds of paths that have a speed of their own."""


@pytest.fixture
def moved(made: Made) -> Made:
    """The one case of the small study with these fields of its motion and of its fidelity."""

    def make(fidelity: dict[str, Any] | None = None, **motion: Any) -> Case:
        if motion.get("path", {}).get("kind") in OWN_SPEED:
            motion = {"speed_m_s": None, **motion}
        chosen = {f"fidelities.quick.{name}": value for name, value in (fidelity or {}).items()}
        return made({"motion": motion, **chosen})

    return make

"""What every kind of superposed motion knows of itself."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from markupsafe import Markup
from pydantic import BaseModel, ConfigDict

LIVE_REFERENCE = Markup("${reference_x} ${reference_y} ${reference_z}")
"""The reference point where the engine has it when the drag begins or is resumed."""


class SuperposedOfRun(BaseModel):
    """An entry of ``motion.superposed`` in ``case.json``."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    kind: str


@dataclass(frozen=True)
class DragSteps:
    """The drag in steps: when it begins and ends, and how long a step is."""

    start: int
    end: int
    timestep_s: float


@dataclass(frozen=True)
class EngineMotion:
    """How the engine makes a superposed motion.

    Attributes
    ----------
    variables : mapping
        Formulas of equal-style variables by name, in the order of their definition. When the
        engine evaluates them, ``step`` is the one that the workpiece is moved to.
    mover : str
        Style and arguments of ``fix move/mesh``.
    """

    variables: Mapping[str, str]
    mover: str

    def ending(self, ending: str) -> "EngineMotion":
        """The same motion with an ending after the name of each of its variables."""
        if not ending:
            return self
        names = "|".join([*self.variables, "reference_[xyz]"])
        used = re.compile(rf"(v_|\$\{{)({names})\b")

        def renamed(text: str) -> str:
            return type(text)(used.sub(rf"\g<0>{ending}", text))

        variables = {f"{name}{ending}": renamed(text) for name, text in self.variables.items()}
        return EngineMotion(variables, renamed(self.mover))


class SuperposedMotion(ABC):
    """Block of a study: a motion that is superposed on the path during the whole drag.

    Attributes
    ----------
    part : type
        Its model in ``case.json``.
    """

    part: ClassVar[type[SuperposedOfRun]]

    @abstractmethod
    def faster(self, factor: float) -> Self:
        """The same motion with every speed multiplied."""

    @abstractmethod
    def surface_speed_m_s(self, radius_m: float) -> float:
        """What it adds at most to the speed of a surface point of a workpiece of this radius."""

    @property
    def horizontal_reach_m(self) -> float:
        """How far it takes the workpiece aside from its path."""
        return 0.0

    @property
    def vertical_reach_m(self) -> float:
        """How far it takes the workpiece below, and above, its path."""
        return 0.0

    def lift_m(self, time_s: float) -> float:
        """How far it has the workpiece above its path, this long after the start of the drag, m."""
        return 0.0

    def turn_rad(self, time_s: float) -> float:
        """How far it has turned the workpiece about +z, this long after the start of the drag."""
        return 0.0

    @abstractmethod
    def of_run(self, drag: DragSteps) -> SuperposedOfRun:
        """Its entry in ``case.json``."""

    @abstractmethod
    def on_engine(self, drag: DragSteps) -> EngineMotion:
        """Its part of the input script."""

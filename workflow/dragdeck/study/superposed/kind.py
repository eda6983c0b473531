"""What every kind of superposed motion knows of itself."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field

LIVE_REFERENCE = Markup("${reference_x} ${reference_y} ${reference_z}")
"""The reference point where the engine has it when the drag begins or is resumed."""


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


class SuperposedOfRun(BaseModel, ABC):
    """An entry of ``superposed`` in ``case.json``: the motion in whole steps, as simulated.

    Attributes
    ----------
    ramp_steps : int
        Steps in which the motion starts from rest; absent if it starts at full speed.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    kind: str
    ramp_steps: int = Field(default=0, exclude_if=lambda value: not value)

    def advance(self, steps: float) -> float:
        """Steps at full speed that get the motion as far as so many steps from its start.

        Its derivative is 3 x^2 - 2 x^3 at the fraction x of the ramp: speed and acceleration have
        no jump.
        """
        if steps > self.ramp_steps:
            return steps - self.ramp_steps / 2
        x = steps / max(self.ramp_steps, 1)
        return steps * x**2 * (1 - x / 2)

    def advance_formula(self, start_step: int) -> str:
        """`advance` at the engine's ``step``."""
        since, ramp = f"(step-{start_step})", self.ramp_steps
        if not ramp:
            return since
        starting = f"{since}*({since}/{ramp}.0)^2*(1.0-{since}/{2 * ramp}.0)"
        return f"({starting}*({since}<={ramp})+({since}-{ramp / 2!r})*({since}>{ramp}))"

    def lift_m(self, steps: float, timestep_s: float) -> float:
        """How far it has the workpiece above its path so long after the start of the drag, m."""
        return 0.0

    def turn_rad(self, steps: float, timestep_s: float) -> float:
        """How far it has turned the workpiece about +z so long after the start of the drag."""
        return 0.0

    @abstractmethod
    def on_engine(self, start_step: int) -> EngineMotion:
        """Its part of the input script, for a drag that starts at this step."""


RAMP = Field(
    default=0.1,
    description="time in which the motion starts smoothly from rest when the drag begins, in "
    "seconds at the study's own speed; no statistic includes it",
)
"""The field `ramp_s` of every block."""


class SuperposedMotion(ABC):
    """Block of a study: a motion that is superposed on the path during the whole drag.

    Attributes
    ----------
    part : type
        Its model in ``case.json``.
    ramp_s : float
        Time in which it starts.
    """

    part: ClassVar[type[SuperposedOfRun]]
    ramp_s: float

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

    @abstractmethod
    def of_run(self, drag: DragSteps) -> SuperposedOfRun:
        """The motion in whole steps, which is its entry in ``case.json``."""

    def ramp_steps(self, drag: DragSteps) -> int:
        """Steps in which it starts."""
        return round(self.ramp_s / drag.timestep_s)

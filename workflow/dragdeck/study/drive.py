"""How a run drives the drag: its steps, and what LIGGGHTS needs to know of a motion.

Paths and superposed motions build on this, and on `rotations` and `stages`.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partialmethod
from typing import Any, Literal

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from dragdeck.arrays import Floats

Orientation = Literal["follow_path", "fixed"]


LIVE_REFERENCE = Markup("${reference_x} ${reference_y} ${reference_z}")
"""The reference point where the engine has it when the drag begins or is resumed."""


@dataclass(frozen=True)
class SmoothStart:
    """A motion that starts from rest: its speed rises as ``3 x^2 - 2 x^3`` in so many steps.

    Speed and acceleration have no jump.
    """

    steps: int = 0

    def advance(self, since: ArrayLike) -> Floats:
        """Steps at full speed that get the motion as far as so many from its start."""
        since, ramp = np.asarray(since, dtype=np.float64), max(self.steps, 1)
        begun = np.minimum(since, self.steps)
        return np.asarray(begun**3 / ramp**2 * (1.0 - begun / (2.0 * ramp)) + (since - begun))

    def pace(self, since: ArrayLike) -> Floats:
        """Speed after so many steps over the full one."""
        since = np.asarray(since)
        x = np.minimum(since / max(self.steps, 1), 1.0) if self.steps else np.ones(1)
        return np.broadcast_to(x**2 * (3.0 - 2.0 * x), since.shape)

    def pace_formula(self, start_step: int) -> str:
        """`pace` of a start that takes time, at the engine's ``step``."""
        share = f"((step-{start_step})/{self.steps}.0)"
        started = f"(step-{start_step}>={self.steps})"
        return f"({share}^2*(3.0-2.0*{share})*(1-{started})+{started})"

    def formula(self, start_step: int) -> str:
        """`advance` at the engine's ``step``."""
        since, ramp = f"(step-{start_step})", self.steps
        if not ramp:
            return since
        starting = f"{since}*({since}/{ramp}.0)^2*(1.0-{since}/{2 * ramp}.0)"
        return f"({starting}*({since}<={ramp})+({since}-{ramp / 2!r})*({since}>{ramp}))"


@dataclass(frozen=True)
class Drive:
    """A drag in whole steps: it ends at the end of the path.

    Attributes
    ----------
    start, end : int
        First and last step.
    timestep_s : float
    length_m : float
        Of the path.
    orientation : str
        With ``follow_path`` the workpiece turns with its path.
    tilt_deg : float
        Between the workpiece's axis and the vertical; its upper end leans to its front.
    begin : SmoothStart
        How the workpiece starts along its path.
    """

    start: int
    end: int
    timestep_s: float
    length_m: float
    orientation: Orientation = "follow_path"
    tilt_deg: float = 0.0
    begin: SmoothStart = field(default_factory=SmoothStart)

    @property
    def steps(self) -> int:
        """How many it takes."""
        return self.end - self.start

    @property
    def full_steps(self) -> float:
        """How many it would take at full speed from its first step on."""
        return self.steps - self.begin.steps / 2 if self.begin.steps else self.steps

    @property
    def full_speed_m_s(self) -> float:
        """Speed along the path after the start, the mean of a path with several."""
        return self.length_m / (self.full_steps * self.timestep_s)

    @property
    def full_duration_s(self) -> float:
        """Time that the path takes at that speed."""
        return self.length_m / self.full_speed_m_s

    @property
    def duration_s(self) -> float:
        """Time that it takes."""
        return self.full_duration_s + self.begin.steps / 2 * self.timestep_s

    @property
    def speed_m_s(self) -> float:
        """The same speed as ``case.json`` has it."""
        return self.length_m / self.full_duration_s

    @property
    def own_axis(self) -> Floats:
        """The workpiece's axis in the frame of its front, (3,)."""
        tilt = math.radians(self.tilt_deg)
        return np.array([math.sin(tilt), 0.0, math.cos(tilt)])

    def time_to(self, path_m: float) -> float:
        """Time after which the workpiece is so far along its path, and no longer starts, s."""
        return path_m / self.speed_m_s + self.begin.steps / 2 * self.timestep_s

    def time_s(self, since: ArrayLike) -> Floats:
        """Time that the way of so many steps takes at full speed."""
        return np.asarray(self.begin.advance(since) * self.full_duration_s / self.full_steps)

    def share(self, since: ArrayLike) -> Floats:
        """Part of the path's time that has passed after so many steps."""
        return np.asarray(self.begin.advance(since) / self.full_steps)

    def share_formula(self, late: int = 0) -> "Formula":
        """`share` at the engine's ``step``, or so many steps before."""
        return Formula(f"({self.begin.formula(self.start + late)}/{self.full_steps!r})")


class Formula:
    """A formula of the engine, with which numpy computes as with a number."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __str__(self) -> str:
        return self.text

    def _joined(self, sign: str, other: Any, *, swapped: bool = False) -> "Formula":
        first, second = (self, other)[:: -1 if swapped else 1]
        return Formula(f"({formula(first)}{sign}{formula(second)})")

    __add__, __radd__ = partialmethod(_joined, "+"), partialmethod(_joined, "+", swapped=True)
    __sub__, __rsub__ = partialmethod(_joined, "-"), partialmethod(_joined, "-", swapped=True)
    __mul__, __rmul__ = partialmethod(_joined, "*"), partialmethod(_joined, "*", swapped=True)
    __truediv__, __ge__ = partialmethod(_joined, "/"), partialmethod(_joined, ">=")

    def sin(self) -> "Formula":
        """What ``np.sin`` calls."""
        return Formula(f"sin({self})")

    def cos(self) -> "Formula":
        """What ``np.cos`` calls."""
        return Formula(f"cos({self})")


def formula(value: Any) -> str:
    """A formula or a number as the engine reads it."""
    if isinstance(value, Formula):
        return str(value)
    number = float(value)
    return f"({number!r})" if math.copysign(1.0, number) < 0 else f"{number!r}"


@dataclass(frozen=True)
class EngineMotion:
    """How the engine makes a motion.

    Attributes
    ----------
    movers : mapping
        Style and arguments of each ``fix move/mesh``, in the order in which they act, by the
        ending of its name.
    variables : mapping
        Formulas of equal-style variables by name, in the order of their definition. When the
        engine evaluates them, ``step`` is the one that the workpiece is moved to.
    comment : str
        What the input script says of it.
    """

    movers: Mapping[str, str]
    variables: Mapping[str, str] = field(default_factory=dict)
    comment: str = ""

    @property
    def about_reference(self) -> bool:
        """Whether it turns the workpiece about its live reference point."""
        return any(LIVE_REFERENCE in mover for mover in self.movers.values())

    def ending(self, ending: str) -> "EngineMotion":
        """The same motion with an ending after the name of each of its variables."""
        if not ending:
            return self
        names = re.compile(r"\bv_\w+|\$\{reference_[xyz]")

        def renamed(text: str) -> str:
            return type(text)(names.sub(rf"\g<0>{ending}", text))

        return EngineMotion(
            {name: renamed(mover) for name, mover in self.movers.items()},
            {f"{name}{ending}": renamed(text) for name, text in self.variables.items()},
            self.comment,
        )


def rotating(omega: str, axis: str = "0. 0. 1.") -> Markup:
    """The mover that rotates about the live reference point: a restart keeps no moved centre."""
    mover = Markup("rotate/variable origin {} axis {} omega v_{}")
    return mover.format(LIVE_REFERENCE, axis, omega)


def rotating_by(names: Sequence[str]) -> dict[str, str]:
    """Movers about three axes that make one rotation: the variables of x, y and z.

    The engine carries the centre of a later mover along, but never its axis: the axes are the
    bowl's, and the rotation is that about x after that about y after that about z.
    """
    axes = {"_z": "0. 0. 1.", "_y": "0. 1. 0.", "_x": "1. 0. 0."}
    turns = zip(axes.items(), reversed(names), strict=True)
    return {part: rotating(name, axis) for (part, axis), name in turns}


def rates_about_axes(matrix: Floats, drive: Drive) -> tuple[float, float, float]:
    """Angular speeds about x, y and z that make a rotation, (3, 3), in a step, rad/s.

    Not by scipy's Euler angles, whose error of 1e-16 is not small beside the turn of a step.
    """
    x = math.atan2(-matrix[1, 2], matrix[2, 2])
    y, z = math.asin(matrix[0, 2]), math.atan2(-matrix[0, 1], matrix[0, 0])
    return x / drive.timestep_s, y / drive.timestep_s, z / drive.timestep_s


class PathEntry(BaseModel):
    """The simulated drag: speed of the workpiece's axis, its initial direction, and its path.

    Attributes
    ----------
    kind : str
        Of the path, which adds fields of its own.
    axis_speed_m_s : float
        Mean speed of the workpiece's axis relative to the bowl.
    start_direction_rad : float
        Direction of that motion when the drag begins, from x towards y.
    orientation : str
        With ``follow_path`` the workpiece turns with its path.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="allow")

    kind: str
    axis_speed_m_s: float = Field(gt=0)
    start_direction_rad: float
    orientation: Orientation = "fixed"


class SuperposedEntry(BaseModel):
    """A motion superposed on the path, in whole steps; its kind adds fields of its own."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="allow")

    kind: str

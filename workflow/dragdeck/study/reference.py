"""Published figures to compare the results with."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from dragdeck.parts import omitted
from dragdeck.study.base import Distinct, Line, Model, NonNegative, Number, Positive


class Drag(Model):
    """A published drag force; negative: opposes the motion."""

    drag_mean_n: Number
    """published mean drag force, N; negative: opposes the motion"""
    drag_std_n: NonNegative | None = None
    """published standard deviation of the drag force over time, N"""


Span = tuple[Number, Number]
"""Beginning and end, s."""


class Signal(Model):
    """A measured force signal, with which that of the simulation is compared."""

    file: Line = Field(pattern=r"^[^{}]*$")
    """CSV file of force against time, <= 64 MB"""
    column: Annotated[
        Annotated[Line, Tag("a-name")]
        | Annotated[list[Line], Distinct, Field(min_length=2, max_length=3), Tag("a-list")],
        Discriminator(lambda value: "a-list" if isinstance(value, list) else "a-name"),
    ]
    """name of the force column, which ends in `_n`, `_mn` or `_kn`; or a list of those along x, y
    and perhaps z of a sensor, counter-clockwise seen from above, from which `component` is
    computed"""
    orientation: Literal["follow_path", "fixed"] | None = None
    """follow_path: the axes of the sensor turn with the path; fixed: they do not, as below a bowl
    or table; none: fixed, and refused for a single column on a path that turns"""
    x_axis_deg: Number = 0.0
    """direction of the sensor's x axis, degrees: in the bowl; with `angle_column`, where this
    counts from; with `follow_path`, from the direction of motion"""
    angle_column: Line | None = None
    """name of a column with the direction of motion, counter-clockwise seen from above, which ends
    in `_deg` or `_rad`; none: from the motion of the study"""
    rate_hz: Positive | None = None
    """sampling rate, Hz; none: a column `time_s`, `_ms` or `_us`"""
    component: Literal["drag", "lateral", "vertical"] = "drag"
    """axis of the force: along the motion, to its left, or upwards"""
    sign: Literal[1, -1] = 1
    """1: force on the workpiece along this axis; -1: resistance"""
    rest_s: Annotated[tuple[Span, ...], Distinct, Field(max_length=2)] = ()
    """stretches without load, s: one for the offset, two for a drift too"""
    starts_at_s: Number | None = None
    """start of the drag, s; none: found after the first stretch of `rest_s`"""
    ends_at_s: Number | None = None
    """end of the drag, s; none: the second stretch of `rest_s`, or the end of the file"""
    low_pass_hz: Positive
    """bandwidth of the comparison, Hz: at most a fifth of both rates"""
    margin: Annotated[Number, Field(gt=0, lt=1)] = 0.1
    """largest relative difference that is called equivalent"""

    @model_validator(mode="after")
    def _axes(self) -> Self:
        axes = len(self.columns)
        if axes == 2 and self.component == "vertical":
            raise ValueError("two columns have no vertical force: give that column, or all three")
        if self.angle_column and (axes == 1 or self.orientation == "follow_path"):
            raise ValueError("angle_column is for two or three columns of a fixed sensor")
        return self

    @property
    def columns(self) -> Sequence[str]:
        """The columns of the force."""
        return self.column if isinstance(self.column, list) else [self.column]

    def fits(self, *, turning: bool) -> bool:
        """Whether it has the force in the frame of a path that turns or not."""
        single = len(self.columns) == 1 and self.component != "vertical"
        return not (turning and single and self.orientation != "follow_path")


class Reference(Model):
    """Published values with which the results are compared."""

    source: str
    """source of the values"""
    experiment: Drag | None = None
    """values measured in an experiment"""
    simulation: Drag | None = None
    """values simulated by others"""
    signal: Signal | None = omitted(None)
    """a measured force signal to compare with"""

"""Published figures to compare the results with."""

from typing import Annotated, Literal

from pydantic import Field

from dragdeck.study.base import Line, Model, NonNegative, Number, Positive


class Drag(Model):
    """A published drag force; negative: opposes the motion."""

    drag_mean_n: Number = Field(
        description="published mean drag force, N; negative: opposes the motion"
    )
    drag_std_n: NonNegative | None = Field(
        default=None, description="published standard deviation of the drag force over time, N"
    )


Span = tuple[Number, Number]
"""Beginning and end, s."""


class Signal(Model):
    """A measured force signal, with which that of the simulation is compared."""

    file: Line = Field(
        pattern=r"^[^{}]*$",
        description="CSV file of the force against time, beside the study; at most 64 MB",
    )
    column: Line = Field(
        description="name of the force column, which ends in its unit: `_n`, `_mn` (millinewton) "
        "or `_kn`"
    )
    rate_hz: Positive | None = Field(
        default=None,
        description="sampling rate, Hz; none: the file has a column `time_s`, `time_ms` or "
        "`time_us`",
    )
    component: Literal["drag", "lateral", "vertical"] = Field(
        default="drag",
        description="axis of the sensor: along the motion, to its left, or upwards",
    )
    sign: Literal[1, -1] = Field(
        default=1,
        description="1: the column is the force on the workpiece, positive along this axis; -1: "
        "it is positive in the opposite direction, as a resistance is",
    )
    rest_s: Annotated[tuple[Span, ...], Field(max_length=2)] = Field(
        default=(),
        description="stretches of the file without load, beginning and end in s: the mean of one "
        "is the offset, the line through two is offset and drift; none: already subtracted",
    )
    starts_at_s: Number | None = Field(
        default=None,
        description="time in the file at which the drag starts, s; none: where the force leaves "
        "the noise of the first stretch in `rest_s`",
    )
    ends_at_s: Number | None = Field(
        default=None,
        description="time in the file at which the drag ends, s; none: the end of the file, or "
        "the second stretch in `rest_s`",
    )
    low_pass_hz: Positive = Field(
        description="bandwidth of the comparison, Hz, at most a fifth of both sampling rates"
    )
    margin: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=0.1,
        description="largest relative difference at which a quantity is called equivalent",
    )


class Reference(Model):
    """Published values with which the results are compared."""

    source: str = Field(description="publication from which the values are taken")
    experiment: Drag | None = Field(default=None, description="values measured in an experiment")
    simulation: Drag | None = Field(default=None, description="values simulated by others")
    signal: Signal | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="a measured force signal, with which that of the simulation is compared",
    )

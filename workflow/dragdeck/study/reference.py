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

    file: Line = Field(pattern=r"^[^{}]*$", description="CSV file of force against time, <= 64 MB")
    column: Line = Field(description="name of the force column; ends in `_n`, `_mn` or `_kn`")
    rate_hz: Positive | None = Field(
        default=None, description="sampling rate, Hz; none: a column `time_s`, `_ms` or `_us`"
    )
    component: Literal["drag", "lateral", "vertical"] = Field(
        default="drag", description="axis of the force: along the motion, to its left, or upwards"
    )
    sign: Literal[1, -1] = Field(
        default=1, description="1: force on the workpiece along this axis; -1: resistance"
    )
    rest_s: Annotated[tuple[Span, ...], Field(max_length=2)] = Field(
        default=(), description="stretches without load, s: one for the offset, two for a drift too"
    )
    starts_at_s: Number | None = Field(
        default=None,
        description="start of the drag, s; none: found after the first stretch of `rest_s`",
    )
    ends_at_s: Number | None = Field(
        default=None,
        description="end of the drag, s; none: the second stretch of `rest_s`, or the end of the "
        "file",
    )
    low_pass_hz: Positive = Field(
        description="bandwidth of the comparison, Hz: at most a fifth of both rates"
    )
    margin: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=0.1, description="largest relative difference that is called equivalent"
    )


class Reference(Model):
    """Published values with which the results are compared."""

    source: str = Field(description="source of the values")
    experiment: Drag | None = Field(default=None, description="values measured in an experiment")
    simulation: Drag | None = Field(default=None, description="values simulated by others")
    signal: Signal | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="a measured force signal to compare with",
    )

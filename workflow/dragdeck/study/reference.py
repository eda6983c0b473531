"""Published figures to compare the results with."""

from pydantic import Field

from dragdeck.study.base import Model, NonNegative, Number


class Drag(Model):
    """A published drag force; negative: opposes the motion."""

    drag_mean_n: Number = Field(
        description="published mean drag force, N; negative: opposes the motion"
    )
    drag_std_n: NonNegative | None = Field(
        default=None, description="published standard deviation of the drag force over time, N"
    )


class Reference(Model):
    """Published values with which the results are compared."""

    source: str = Field(description="publication from which the values are taken")
    experiment: Drag | None = Field(default=None, description="values measured in an experiment")
    simulation: Drag | None = Field(default=None, description="values simulated by others")

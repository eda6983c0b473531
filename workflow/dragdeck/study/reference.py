"""Published figures to compare the results with."""

from pydantic import Field

from dragdeck.study.base import Model, NonNegative, Number


class Drag(Model):
    """A published drag force along the motion; negative: against it."""

    drag_mean_n: Number = Field(description="mean drag, N; negative: against the motion")
    drag_std_n: NonNegative | None = Field(
        default=None, description="standard deviation over time, N"
    )


class Reference(Model):
    """Published figures to stand beside the results."""

    source: str = Field(description="source of the figures")
    experiment: Drag | None = Field(default=None, description="measured values")
    simulation: Drag | None = Field(default=None, description="simulated values")

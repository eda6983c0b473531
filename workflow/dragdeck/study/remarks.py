"""What a study says about its own values: what it assumes, and what it accepts on purpose."""

from typing import Annotated

from pydantic import Field

from dragdeck.study.base import Line, Model, Whole


class Assumption(Model):
    """A value that the source of the study does not give."""

    field: str = Field(description="dotted name of the field whose value is assumed")
    why: str = Field(description="what the source reports, and the reason for the value")


class Accepted(Model):
    """Limits that a study goes beyond on purpose."""

    unsafe_timestep: Line | None = Field(
        default=None,
        description="reason for a process time step that is forecast to be unstable, and "
        "for accepting its run; shown among assumptions and acceptance checks of the report",
    )
    cases: Annotated[Whole, Field(ge=1)] = Field(
        default=200, description="largest accepted number of cases of `sweep`"
    )

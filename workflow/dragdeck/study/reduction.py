"""Smaller scenes that stand for the machine of a study."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from dragdeck.study.base import Model, Number, Positive
from dragdeck.study.quantities import QUANTITIES

RADIAL = {row["name"] for row in QUANTITIES if row["radial"]}
"""Quantities that depend on the curvature of the path and on unequal walls beside it."""


class Reduction(Model):
    """A smaller scene in place of the machine: the rest of the study describes the machine."""

    cut_out: bool = False
    """whether a straight trough around a part of the path stands for the machine"""
    counted_m: Positive | None = None
    """length of the line that the statistics include, m; none: that of the study, at most 40
    particle diameters"""

    coarser: Annotated[Number, Field(ge=1, le=4)] | None = None
    """factor on the diameters of the particles, in the same space; the report extrapolates from two
    or more in `sweep` to 1"""

    @model_validator(mode="after")
    def _of_cut_out(self) -> Self:
        if self.counted_m is not None and not self.cut_out:
            raise ValueError("counted_m is of a cut-out: add cut_out: true, or remove it")
        return self

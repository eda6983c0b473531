"""Settings for speed and accuracy, and a tolerance in place of them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from dragdeck.parts import omitted
from dragdeck.study.base import Distinct, Model, Number, Positive, Whole
from dragdeck.study.quantities import QUANTITIES

Ranks = Annotated[
    Annotated[Literal["auto"], Tag("a-word")]
    | Annotated[Whole, Field(ge=1, le=1024), Tag("a-number")],
    Discriminator(lambda value: "a-word" if value == "auto" else "a-number"),
]


if TYPE_CHECKING:
    Quantity = str
else:
    Quantity = Literal[tuple(row["name"] for row in QUANTITIES if row["tolerance"])]
"""Quantities to which a tolerance can apply; docs/evidence/tradeoff.md defines each."""


RESTITUTION = "restitution"
"""The quantity of the drop test; all others are of the process."""


LARGEST_TIMESTEP_FRACTION = 2.0
"""Of the Rayleigh time: no larger step was ever stable (docs/development/liggghts.md)."""


class Windows(Model):
    """Short runs at physical stiffness along the path, until quantities are known well enough."""

    tolerance: Annotated[Number, Field(ge=1e-4, lt=1)]
    """relative half-width of the 95 % confidence interval at which no further window is run"""
    quantities: Annotated[list[Quantity], Distinct] = Field(default=["drag_mean"], min_length=1)
    """quantities to which the tolerance applies"""
    most: Annotated[Whole, Field(ge=2, le=64)] = 16
    """largest number of windows"""
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = 0.64
    """time step of the windows as a fraction of the Rayleigh time"""


class SoftStart(Model):
    """Settings of the process until shortly before its statistics, with smaller moduli.

    The moduli are raised to those of the run before the statistics begin. The filling has those of
    the run: the bed's surface, from which depth is measured, depends on them.
    """

    youngs_modulus_scale: Annotated[Number, Field(gt=0, lt=1)]
    """multiplier of every Young's modulus"""
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = 0.3
    """time step as a fraction of the Rayleigh time"""


class Fidelity(Model):
    """Settings for speed and accuracy."""

    youngs_modulus_scale: Annotated[Number, Field(gt=0, le=1)] = 1.0
    """multiplier of every Young's modulus; 1: physical stiffness"""
    soft_start: SoftStart | None = omitted(None)
    """settings of plunge, approach and the start of the drag; none: those of the rest"""
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = 0.2
    """time step of the process as a fraction of the Rayleigh time"""
    filling_timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = 0.25
    """time step of the filling as a fraction of the Rayleigh time"""
    filling_youngs_modulus_scale: Annotated[Number, Field(gt=0, le=1)] | None = omitted(None)
    """multiplier of every Young's modulus in the filling; none: that of the results, which is 1
    with windows"""
    speed_factor: Annotated[Number, Field(ge=1, le=100)] = 1.0
    """multiplier of the speed of the workpiece"""
    skin_m: Positive | None = None
    """neighbour skin, m; none: 10 % of the mean particle radius, in a fast process up to 30 %"""
    ranks: Ranks = 2
    """number of MPI ranks; auto: from particles, cases and cores (docs/howto/running.md)"""

    windows: Windows | None = omitted(None)
    """windows of a run with reduced moduli; none: none are run"""

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        start, scale = self.soft_start, self.youngs_modulus_scale
        whole = scale < 1 and self.speed_factor == 1 and start is None
        if self.windows is not None and not whole:
            raise ValueError(
                "windows require a youngs_modulus_scale below 1, a speed_factor of 1 and no "
                "soft_start"
            )
        if start is not None and start.youngs_modulus_scale >= scale:
            raise ValueError(
                f"soft_start has a youngs_modulus_scale of {start.youngs_modulus_scale:g}, not "
                f"below {scale:g}"
            )
        first = (start or self).youngs_modulus_scale
        if self._filling_scale < first:
            raise ValueError(
                f"filling_youngs_modulus_scale is {self._filling_scale:g}: a process that starts "
                f"with {first:g} would throw so soft a bed up; use {first:g} or more"
            )
        return self

    @property
    def _filling_scale(self) -> float:
        of_results = 1.0 if self.windows else self.youngs_modulus_scale
        return self.filling_youngs_modulus_scale or of_results

    @property
    def of_filling(self) -> "Fidelity":
        """The settings of the filling, which has the modulus at which the results hold.

        A bed of softer particles is lower, and depth is measured from its surface.
        """
        if self._filling_scale == self.youngs_modulus_scale:
            return self
        return self.model_copy(update={"youngs_modulus_scale": self._filling_scale})

    @property
    def of_start(self) -> "Fidelity":
        """The settings of plunge, approach and the start of the drag."""
        if self.soft_start is None:
            return self
        filling = {"filling_youngs_modulus_scale": self._filling_scale}
        return self.model_copy(update={**dict(self.soft_start), "soft_start": None, **filling})


class Tolerance(Model):
    """A tolerance instead of settings: runs go on until the results are inside it."""

    tolerance: Annotated[Number, Field(ge=1e-4, lt=1)]
    """relative half-width of the 95 % confidence interval at the physical Young's modulus"""
    quantity: Annotated[
        Annotated[Quantity, Tag("a-name")]
        | Annotated[list[Quantity], Distinct, Field(min_length=1, max_length=8), Tag("a-list")],
        Discriminator(lambda value: "a-list" if isinstance(value, list) else "a-name"),
    ] = "drag_mean"
    """quantity, or list of up to eight, to which the tolerance applies"""

    @property
    def quantities(self) -> Sequence[Quantity]:
        """All of them."""
        return self.quantity if isinstance(self.quantity, list) else [self.quantity]


def _form(value: object) -> str:
    """Which of its three forms a fidelity has."""
    if isinstance(value, Tolerance) or (isinstance(value, Mapping) and "tolerance" in value):
        return "a-tolerance"
    return "settings" if isinstance(value, Mapping | Fidelity) else "a-name"


AnyFidelity = Annotated[
    Annotated[str, Tag("a-name")]
    | Annotated[Fidelity, Tag("settings")]
    | Annotated[Tolerance, Tag("a-tolerance")],
    Discriminator(_form),
]


BUILT_IN_FIDELITIES: Mapping[str, Fidelity] = {
    "draft": Fidelity(youngs_modulus_scale=1e-3, timestep_fraction=0.6),
    "standard": Fidelity(youngs_modulus_scale=1e-2, timestep_fraction=0.5),
    "fine": Fidelity(youngs_modulus_scale=0.1, timestep_fraction=0.5),
    "full": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.64),
    "reference": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.2),
}

"""What evidence measured of stable time steps: ``stability.json`` and ``stable_step.json``."""

import math
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator

from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.physics.contact_mechanics import damping_ratio

_DATA = Path(str(resources.files("dragdeck"))) / "data"
"""The records that were measured with this version."""


class StableStepLaw(Part):
    """The law of the stability number of a time step.

    With the step f over the Rayleigh time, the stiffness number kappa of the run and the damping
    ratio z of a contact between particles and the relative standard deviation s of their radii,
    number^2 = (`stiffness` u^2 + `damping` z u) exp(2 `spread` s), where u = f kappa^(-1/4).
    `scatter`: standard deviation of the logarithm of a number about that; `largest`: how far one
    was above it at most.
    """

    stiffness: float
    damping: float
    spread: float
    scatter: float
    largest: float
    runs: int

    def number(self, fraction: float, kappa: float, restitution: float, spread: float) -> float:
        """The stability number of a step over the Rayleigh time."""
        u = fraction * kappa**-0.25
        square = self.stiffness * u**2 + self.damping * damping_ratio(restitution) * u
        return math.sqrt(square) * math.exp(self.spread * spread)

    def largest_fraction(
        self, kappa: float, restitution: float, spread: float, number: float = 1.0
    ) -> float:
        """The step over the Rayleigh time at which the stability number has a value."""
        number /= math.exp(self.spread * spread)
        drag = self.damping * damping_ratio(restitution)
        root = math.sqrt(drag**2 + 4.0 * self.stiffness * number**2)
        return float((root - drag) / (2.0 * self.stiffness) * kappa**0.25)


class StableStepRecord(Document):
    """What is read of ``stable_step.json``."""

    remedy = "restore it: it is a part of dragdeck"

    measured: str
    stable_step: StableStepLaw


def _to_digits(digits: int) -> BeforeValidator:
    def rounded(value: object) -> object:
        if not isinstance(value, float):
            return value
        return None if math.isnan(value) else float(f"{value:.{digits}g}")

    return BeforeValidator(rounded)


Step = Annotated[float | None, _to_digits(4)]
"""A step over another, to four digits; NaN becomes None."""

KnownStep = Annotated[float, _to_digits(4)]
"""The same of a step that is always known."""

Rounded = Annotated[float, _to_digits(3)]
"""A number to three digits."""


class SafeSteps(Part):
    """The largest safe step of a regime: the smallest of its usable conditions.

    ``..._fraction`` is over the Rayleigh time, ``..._critical`` over the critical step.

    Attributes
    ----------
    conditions, usable : int
        How many there are, and how many of them have a stable reference.
    base : float or None
        Safe at the base point.
    safe, recommended : float
        Safe in all usable conditions, and that times the safety factor.
    over_rule : float
        The safe step over the 20 % rule.
    stable : float
        No energy gained and no particle lost in any usable condition.
    limited_by : str
        The condition with the smallest safe step.
    ordinary : float or None
        Safe without the strongly damped conditions, those with a restitution below 0.5.
    """

    conditions: int
    usable: int
    base_fraction: Step
    base_critical: Step
    safe_fraction: KnownStep
    recommended_fraction: KnownStep
    over_rule: KnownStep
    stable_fraction: Step
    safe_critical: Step
    recommended_critical: Step
    stable_critical: Step
    limited_by: str
    ordinary_fraction: Step
    ordinary_critical: Step


class RestitutionErrors(Part):
    """Errors of head-on impacts in bins of steps per contact, fewest steps first.

    Attributes
    ----------
    steps_per_contact : (B,) tuple of float
        Geometric mean of a bin.
    median : (B,) tuple of float
        Of the largest restitution error among a run's impacts.
    worst, ordinary_worst : (B,) tuple of float
        Largest of the bin and of all with more steps; ordinary: where the restitution is at least
        0.5.
    peak_force_worst : (B,) tuple of float
        The same of the relative error of the peak force.
    runs : (B,) tuple of int
    """

    steps_per_contact: tuple[Rounded, ...]
    median: tuple[Rounded, ...]
    ordinary_worst: tuple[Rounded, ...]
    worst: tuple[Rounded, ...]
    peak_force_worst: tuple[Rounded, ...]
    runs: tuple[int, ...]


class Criteria(Part):
    """The limits that points were classified with; see `evidence.stability.judge`."""

    tolerance: float
    overlap_limit: float
    energy_limits: Mapping[str, float]
    rest_floor: float


class StabilityFile(Document):
    """The content of ``stability.json``.

    Attributes
    ----------
    measured : str
        Date of the last run.
    points : int
    engine_wall_time_s : float
        Of all runs.
    safety_factor : float
        Recommended over safe step.
    regimes : mapping of str to SafeSteps
    """

    remedy = "measure it: ./run stability; then copy its stability.json to workflow/dragdeck/data/"

    commands: tuple[str, ...]
    engine_versions: tuple[str, ...]
    dragdeck_versions: tuple[str, ...]
    measured: str
    points: int
    engine_wall_time_s: float
    safety_factor: float
    criteria: Criteria
    regimes: Mapping[str, SafeSteps]
    restitution_error: RestitutionErrors


@cache
def stable_step_law() -> StableStepLaw:
    """The law that was measured with this version in designed scenes."""
    return StableStepRecord.read(_DATA / "stable_step.json").stable_step


@cache
def stability_map() -> StabilityFile:
    """The map that was measured with this version."""
    return StabilityFile.read(_DATA / "stability.json")

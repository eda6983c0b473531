"""What was measured on the engine: the records in ``data/``, as read."""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Literal

from dragdeck.documents import Document, Part
from dragdeck.errors import InputError
from dragdeck.physics.damping import damping_ratio

_DATA = Path(str(resources.files("dragdeck"))) / "data"
_TRADEOFF_FILE = _DATA / "tradeoff.json"
"""The trade-off that was measured with this version."""


class MeasuredDrop(Part):
    """A time step of the drop test: largest relative error of an impact, and relative cost."""

    timestep_fraction: float
    restitution_error: float
    relative_cost: float


class MeasuredCost(Part):
    """CPU time with one change, relative to that without it.

    Attributes
    ----------
    name, what : str
        Of the variant, and for readers.
    unit : str
        Unit to which `ratio` refers; `per_step` is the ratio of the CPU times per step.
    ci95_low, ci95_high : float or None
        None after a single round.
    parameter, level
        The fidelity parameter that was changed and its value, if it is about one.
    """

    name: str
    scene: str
    what: str
    unit: Literal["per_step", "per_second"] = "per_second"
    ratio: float
    ci95_low: float | None
    ci95_high: float | None
    per_step: float | None = None
    parameter: str | None = None
    level: float | None = None


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


class EngineVersion(Part):
    """The version of LIGGGHTS."""

    engine: str


class Tradeoff(Document):
    """What is read of the measured trade-off: costs of settings and options, and drop tests."""

    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade-off, `snakemake "
        "tradeoff --config study=uhlmann2015 plan=long`, and copy its "
        "tradeoff.json to workflow/dragdeck/data/"
    )

    measured: str
    versions: EngineVersion
    drop_test: Sequence[MeasuredDrop]
    costs: Sequence[MeasuredCost]

    def cost(self, name: str) -> MeasuredCost | None:
        """The cost of a variant, None if it was not timed."""
        return next((cost for cost in self.costs if cost.name == name), None)


@cache
def stable_step_law() -> StableStepLaw:
    """The law that was measured with this version in designed scenes."""
    return StableStepRecord.read(_DATA / "stable_step.json").stable_step


@cache
def measured_tradeoff(file: Path = _TRADEOFF_FILE) -> Tradeoff:
    """The measured trade-off.

    Raises
    ------
    InputError
        It has not been measured, or another version of dragdeck wrote it.
    """
    return Tradeoff.read(file)


def tradeoff_if_measured(file: Path = _TRADEOFF_FILE) -> Tradeoff | None:
    """`measured_tradeoff`, or None where it cannot be read.

    For what is only told, not chosen.
    """
    try:
        return measured_tradeoff(file)
    except InputError:
        return None


class RegimeSteps(Part):
    """Safe time steps of a regime of the stability map, over the Rayleigh time.

    Attributes
    ----------
    safe_fraction : float
        Of all conditions.
    ordinary_fraction : float or None
        Of those without strong damping; None where there were none.
    """

    safe_fraction: float
    ordinary_fraction: float | None


class RestitutionErrors(Part):
    """Errors of the restitution by steps per contact, which rise.

    Attributes
    ----------
    steps_per_contact, worst, ordinary_worst : (N,) sequence of float
        Steps, and the largest errors of any impacts and of those without strong damping.
    """

    steps_per_contact: Sequence[float]
    worst: Sequence[float]
    ordinary_worst: Sequence[float]


class StabilityMap(Document):
    """What is read of the stability map.

    Attributes
    ----------
    measured : str
        Date of its last run.
    safety_factor : float
        Recommended over safe step.
    """

    remedy = "measure it: snakemake stability; then copy its stability.json here"

    engine_versions: Sequence[str]
    measured: str
    safety_factor: float
    regimes: Mapping[str, RegimeSteps]
    restitution_error: RestitutionErrors


@cache
def stability_map() -> StabilityMap:
    """The map that was measured with this version."""
    return StabilityMap.read(_DATA / "stability.json")

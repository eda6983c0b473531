"""What was measured on the engine: ``data/tradeoff.json`` and ``data/stability.json``, as read."""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Literal

from dragdeck.documents import Document, Part
from dragdeck.errors import InputError

_DATA = Path(str(resources.files("dragdeck"))) / "data"
_TRADEOFF_FILE = _DATA / "tradeoff.json"
"""The trade-off that was measured with this version."""


class FidelityParameters(Part):
    """The three settings that trade accuracy for speed."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float


class MeasuredError(Part):
    """A measured error relative to the reference settings, dimensionless.

    Attributes
    ----------
    value, se : float
    ci95_low, ci95_high : float
        95 % confidence interval.
    bound : float
        The absolute error is below it with 95 % confidence.
    single_parameter_error : float
        The largest absolute error of one of the parameters, turned alone.
    """

    value: float
    se: float
    ci95_low: float
    ci95_high: float
    bound: float
    single_parameter_error: float

    @property
    def limit(self) -> float:
        """What a tolerance is compared with.

        Parameters must not hold it by cancelling each other.
        """
        return max(self.bound, self.single_parameter_error)


class MeasuredSetting(FidelityParameters):
    """Settings that were run.

    Attributes
    ----------
    runs, failed : int
    breaks : bool
        Its step is too long: a run failed, or the drag is wrong because of it.
    relative_cost : float or None
        Processor time for a metre of path over the reference's; None if it failed at once.
    errors : mapping of str to MeasuredError
        By quantity.
    """

    runs: int
    failed: int
    breaks: bool
    relative_cost: float | None
    errors: Mapping[str, MeasuredError]


class MeasuredQuantity(Part):
    """A quantity at the reference settings.

    Attributes
    ----------
    label : str
        For readers.
    reference : float or None
    se, run_std : float or None
        Relative: standard error of `reference`, standard deviation of one run's value.
    arc_m : float
        The path that such a value covers, m.
    """

    label: str
    reference: float | None
    se: float | None
    run_std: float | None
    arc_m: float


class MeasuredDrop(Part):
    """A time step of the drop test: largest relative error of an impact, and relative cost."""

    timestep_fraction: float
    restitution_error: float
    relative_cost: float


class MeasuredCost(Part):
    """Processor time with one thing changed over that without.

    Attributes
    ----------
    name, what : str
        Of the variant, and for readers.
    unit : str
        What `ratio` counts; `per_step` is that of a step.
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


class Prediction(Part):
    """A scene that was not measured on: its numbers, and whether the predicted error was met."""

    numbers: Mapping[str, float]
    met: bool


class EngineVersion(Part):
    """The version of LIGGGHTS."""

    engine: str


class Tradeoff(Document):
    """The measured trade-off.

    Attributes
    ----------
    scene : mapping
        Dimensionless numbers of the measured scene.
    """

    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade, `snakemake tradeoff --config"
        " study=uhlmann2015 plan=long`, and copy its tradeoff.json to workflow/dragdeck/data/"
    )

    measured: str
    plan: str
    study: str
    versions: EngineVersion
    scene: Mapping[str, float]
    reference: FidelityParameters
    quantities: Mapping[str, MeasuredQuantity]
    settings: Sequence[MeasuredSetting]
    drop_test: Sequence[MeasuredDrop]
    costs: Sequence[MeasuredCost]
    promises: Sequence[Prediction]

    def cost(self, name: str) -> MeasuredCost | None:
        """The cost of a variant, None if it was not timed."""
        return next((cost for cost in self.costs if cost.name == name), None)


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

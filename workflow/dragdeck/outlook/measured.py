"""What was measured on the engine: the records in ``data/``, as read."""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Literal

import numpy as np

from dragdeck.documents import Document, Part
from dragdeck.errors import InputError
from dragdeck.physics.damping import damping_ratio

_DATA = Path(str(resources.files("dragdeck"))) / "data"
_TRADEOFF_FILE = _DATA / "tradeoff.json"
"""The trade-off that was measured with this version."""

_STIFFNESS_FILE = _DATA / "stiffness.json"
"""The laws of reduced moduli that were measured with this version."""


class FidelityParameters(Part):
    """Young's modulus, time step and speed: the settings that trade accuracy for speed."""

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
        One-sided 95 % upper bound of the absolute error.
    single_parameter_error : float
        Largest absolute error by a single parameter, the others as in the reference.
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
        Whether the time step is too large: a run failed, or the mean drag is wrong.
    relative_cost : float or None
        CPU time per metre of path / that of the reference; None if the runs failed at once.
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


class Prediction(Part):
    """A scene that was not measured on: its numbers, and whether the predicted error was met."""

    numbers: Mapping[str, float]
    met: bool


UNIT_STIFFNESS, UNIT_SCALE, UNIT_INERTIA, UNIT_FRICTION = 5e4, 1e-3, 0.1, 0.3
"""Stiffness number, modulus scale, inertial number and friction about which the laws of reduced
moduli are written."""

_RATE_STEP = 0.02
"""Step of the difference that takes the place of the derivative by the rate."""


class StiffnessLaw(Part):
    """What a reduced modulus does to a quantity: `dragchain.tradeoff.stiffness_law` defines it.

    Attributes
    ----------
    rate : float
        Exponent of the stiffness number.
    amplitude : (float, float, float)
        Its mean, and slopes over inertial number and logarithm of friction.
    covariance : 4 rows of 4 floats
        Of these and of the rate.
    amplitude_std : float
        From scene to scene.
    run_std : float
        Of the logarithm in one run.
    misfit : sequence of (float, float)
        Modulus scales, and the standard deviation of what the law does not explain there.
    """

    rate: float
    amplitude: tuple[float, float, float]
    covariance: tuple[
        tuple[float, float, float, float],
        tuple[float, float, float, float],
        tuple[float, float, float, float],
        tuple[float, float, float, float],
    ]
    amplitude_std: float
    run_std: float
    misfit: Sequence[tuple[float, float]]

    def effect(
        self, stiffness: float, inertia: float, friction: float, scale: float
    ) -> tuple[float, float]:
        """Expected change of a quantity's logarithm by a modulus scale, and its standard error.

        Parameters
        ----------
        stiffness, inertia, friction : float
            Stiffness number, inertial number and coefficient of friction of the scene.
        scale : float
            Factor on every Young's modulus.
        """
        softening = -2 / 3 * math.log(scale)
        g = _reduction(stiffness, softening, self.rate)
        above, below = (
            _reduction(stiffness, softening, self.rate + step) for step in (_RATE_STEP, -_RATE_STEP)
        )
        of_amplitude = [1.0, inertia / UNIT_INERTIA, math.log(friction / UNIT_FRICTION)]
        mean = sum(map(math.prod, zip(of_amplitude, self.amplitude, strict=True)))
        along = [*(g * one for one in of_amplitude), mean * (above - below) / (2 * _RATE_STEP)]
        variance = sum(
            one * entry * other
            for one, row in zip(along, self.covariance, strict=True)
            for entry, other in zip(row, along, strict=True)
        )
        return mean * g, math.sqrt(
            max(0.0, variance) + (self.amplitude_std * g) ** 2 + self._misfit(softening) ** 2
        )

    def _misfit(self, softening: float) -> float:
        """Between the measured scales, and beyond them, in proportion."""
        known = sorted((-2 / 3 * math.log(scale), std) for scale, std in self.misfit)
        at, stds = zip((0.0, 0.0), *known, strict=True)
        beyond = max(softening / at[-1], 1.0) if known else 1.0
        return beyond * float(np.interp(softening, at, stds))


def _reduction(stiffness: float, softening: float, rate: float) -> float:
    """The function of stiffness number and modulus that the amplitude is multiplied with."""
    unit = -2 / 3 * math.log(UNIT_SCALE)
    full = math.pow(stiffness / UNIT_STIFFNESS, -rate)
    return full * _growth(rate, softening) / _growth(rate, unit)


def _growth(rate: float, softening: float) -> float:
    """What (exp(rate softening) - 1) / rate is, also for a rate of 0."""
    return math.expm1(rate * softening) / rate if rate else softening


class MeasuredLaw(Part):
    """The law of a quantity, and the path over particle diameter that a value of it covers.

    `quantile`: half-width of a 95 % interval over its standard error; `friction`: the number of a
    scene that is the law's coefficient of friction.
    """

    label: str
    friction: str
    quantile: float
    path_to_particle: float
    law: StiffnessLaw

    def effect(self, numbers: Mapping[str, float], scale: float) -> tuple[float, float]:
        """As of the law, in a scene with these dimensionless numbers."""
        stiffness, inertia = numbers["stiffness_number"], numbers["inertial_number"]
        return self.law.effect(stiffness, inertia, numbers[self.friction], scale)


class MeasuredScene(Part):
    """A scene that was run at several moduli: its numbers, and its runs by modulus scale."""

    numbers: Mapping[str, float]
    runs: Mapping[str, int]


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


class StiffnessRecord(Document):
    """What is read of ``stiffness.json``: laws by quantity, measured in designed scenes."""

    remedy = (
        "measure it, `snakemake stiffness --config study=uhlmann2015 plan=scenes`, and copy its"
        " stiffness.json to workflow/dragdeck/data/"
    )

    measured: str
    scenes: Sequence[MeasuredScene]
    laws: Mapping[str, MeasuredLaw]
    stable_step: StableStepLaw

    @property
    def lowest_stiffness_number(self) -> float:
        """Of a run with a reduced modulus."""
        softest: list[float] = [
            scene.numbers["stiffness_number"] * math.pow(float(scale), 2 / 3)
            for scene in self.scenes
            for scale in scene.runs
        ]
        return min(softest)


class EngineVersion(Part):
    """The version of LIGGGHTS."""

    engine: str


class Tradeoff(Document):
    """The measured trade-off.

    Attributes
    ----------
    scene : mapping
        Dimensionless numbers of the measured scene.
    stiffness : StiffnessRecord or None
        Effect of reduced moduli in other scenes; a separate record.
    """

    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade-off, `snakemake "
        "tradeoff --config study=uhlmann2015 plan=long`, and copy its "
        "tradeoff.json to workflow/dragdeck/data/"
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
    stiffness: StiffnessRecord | None = None

    def label(self, quantity: str) -> str:
        """A quantity in words."""
        if quantity in self.quantities or self.stiffness is None:
            return self.quantities[quantity].label
        return self.stiffness.laws[quantity].label

    def cost(self, name: str) -> MeasuredCost | None:
        """The cost of a variant, None if it was not timed."""
        return next((cost for cost in self.costs if cost.name == name), None)


@cache
def measured_stiffness() -> StiffnessRecord:
    """The laws that were measured with this version in designed scenes."""
    return StiffnessRecord.read(_STIFFNESS_FILE)


@cache
def measured_tradeoff(file: Path = _TRADEOFF_FILE) -> Tradeoff:
    """The measured trade-off, with the laws of reduced moduli.

    Raises
    ------
    InputError
        It has not been measured, or another version of dragdeck wrote it.
    """
    return Tradeoff.read(file).model_copy(update={"stiffness": measured_stiffness()})


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

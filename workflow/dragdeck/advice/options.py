"""Measured settings as they are for a case: carried to its scene, within its stability limits."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dragdeck.cases.case import Case
from dragdeck.outlook.measured import (
    FidelityParameters,
    MeasuredDrop,
    MeasuredError,
    MeasuredSetting,
    Tradeoff,
)
from dragdeck.outlook.timestep import largest_fraction
from dragdeck.physics.similarity import carried_scale, carried_speed, softest_scale
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Study, Tolerance

_FEWEST_RUNS = 2
"""Runs of a setting below which its error is not believed."""

_PROCESS_OF_DROP = "standard"
"""Fidelity of the process in a study whose tolerance is about the drop test."""


@dataclass(frozen=True)
class Option:
    """Settings that were measured, as they are for a study.

    Attributes
    ----------
    fidelity : Fidelity
    error : MeasuredError or None
        None for the reference, which errors are measured against.
    relative_cost : float
        Processor time against the reference's.
    drop_timestep_fraction : float or None
        Step of the drop test over the Rayleigh time, if the option is about it.
    """

    fidelity: Fidelity
    error: MeasuredError | None
    relative_cost: float
    drop_timestep_fraction: float | None = None

    def __str__(self) -> str:
        if self.drop_timestep_fraction is not None:
            return f"drop at {100 * self.drop_timestep_fraction:.3g} % of the Rayleigh time"
        chosen = self.fidelity
        return (
            f"E x {chosen.youngs_modulus_scale:g}, {100 * chosen.timestep_fraction:.3g} % of the "
            f"Rayleigh time, speed x {chosen.speed_factor:g}"
        )

    def same_settings(self, fidelity: Fidelity | FidelityParameters) -> bool:
        """Whether a fidelity asks for the same modulus, step and speed."""
        names = FidelityParameters.model_fields
        return all(math.isclose(getattr(self.fidelity, n), getattr(fidelity, n)) for n in names)


def with_option(study: Study, option: Option) -> Study:
    """A study with the settings of an option."""
    if option.drop_timestep_fraction is None:
        return study.model_copy(update={"fidelity": option.fidelity})
    drop = study.drop_test.model_copy(update={"timestep_fraction": option.drop_timestep_fraction})
    return study.model_copy(update={"fidelity": _PROCESS_OF_DROP, "drop_test": drop})


def process_options(case: Case, tradeoff: Tradeoff, asked: Tolerance) -> Iterator[Option]:
    """Every measured setting that may be used, carried to the case's scene.

    Left out are settings whose step breaks, that too few runs stand
    behind, whose error was not measured, whose step is beyond the stability
    limit of the measured scene, or that cost as much as the reference.
    """
    here, there = describe(case), tradeoff.scene
    limit = largest_fraction("drag", there["lowest_restitution"])
    for setting in tradeoff.settings:
        error, cost = setting.errors.get(asked.quantity), setting.relative_cost
        sound = setting.failed == 0 and not setting.breaks and setting.runs >= _FEWEST_RUNS
        stable = sound and setting.timestep_fraction <= limit * (1 + 1e-9)
        if error is None or cost is None or not stable:
            continue
        fidelity, steps = _carried(case.study, setting, here, there)
        option = Option(fidelity, error, cost * steps)
        if option.relative_cost < 1 and not option.same_settings(tradeoff.reference):
            yield option


def _carried(
    study: Study, setting: MeasuredSetting, here: Mapping[str, float], there: Mapping[str, float]
) -> tuple[Fidelity, float]:
    """A measured setting in another scene, and how many times as many steps it takes there."""
    scale, fraction = setting.youngs_modulus_scale, setting.timestep_fraction
    stiffer = here["stiffness_number"] / there["stiffness_number"]
    slower = there["inertial_number"] / here["inertial_number"]
    fidelity = Fidelity(
        youngs_modulus_scale=max(carried_scale(scale, stiffer), softest_scale(study)),
        timestep_fraction=min(fraction, largest_fraction("drag", here["lowest_restitution"])),
        filling_timestep_fraction=_filling_fraction(here),
        speed_factor=carried_speed(setting.speed_factor, slower),
    )
    steps = math.sqrt(fidelity.youngs_modulus_scale / scale)
    steps *= fraction / fidelity.timestep_fraction * setting.speed_factor / fidelity.speed_factor
    return fidelity, steps


def _filling_fraction(here: Mapping[str, float]) -> float:
    """Step of the filling over the Rayleigh time: the usual, less where damping is strong."""
    usual = float(Fidelity().filling_timestep_fraction)
    return min(usual, largest_fraction("settle", here["lowest_restitution"]))


def process_reference(case: Case, tradeoff: Tradeoff) -> Option:
    """The settings that errors are measured against."""
    filling = _filling_fraction(describe(case))
    fidelity = Fidelity(**tradeoff.reference.model_dump(), filling_timestep_fraction=filling)
    return Option(fidelity, None, 1.0)


def drop_options(case: Case, tradeoff: Tradeoff) -> Iterator[Option]:
    """Every measured step of the drop test that is within the stability limit."""
    limit = _drop_limit(case)
    for drop in tradeoff.drop_test:
        if drop.timestep_fraction <= limit * (1 + 1e-9):
            yield _drop_option(case, drop, drop.timestep_fraction)


def finest_drop(case: Case, tradeoff: Tradeoff) -> Option:
    """The drop test with the smallest measured step, or a smaller one where damping is strong."""
    finest = min(tradeoff.drop_test, key=lambda drop: drop.timestep_fraction)
    return _drop_option(case, finest, min(finest.timestep_fraction, _drop_limit(case)))


def _drop_limit(case: Case) -> float:
    return largest_fraction("impact", describe(case)["lowest_restitution"])


def _drop_option(case: Case, drop: MeasuredDrop, fraction: float) -> Option:
    """A step of the drop test. The error has no chance in it: it is its own bound."""
    value = drop.restitution_error
    error = MeasuredError(
        value=value,
        se=0.0,
        ci95_low=value,
        ci95_high=value,
        bound=abs(value),
        single_parameter_error=0.0,
    )
    process = {**BUILT_IN_FIDELITIES, **case.study.fidelities}[_PROCESS_OF_DROP]
    return Option(process, error, drop.relative_cost, fraction)

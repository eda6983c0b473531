"""Measured settings as they are for a case: carried to its scene, and passing every check."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain

from dragdeck.cases.bed import widest_skin
from dragdeck.cases.case import Case
from dragdeck.outlook.measured import (
    FidelityParameters,
    MeasuredDrop,
    MeasuredError,
    MeasuredSetting,
    Tradeoff,
    stability_map,
)
from dragdeck.outlook.timestep import largest_fraction
from dragdeck.physics.similarity import carried_scale, carried_speed, softest_scale
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.filling import filling_cautions
from dragdeck.scenes.fit import process_cautions
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
        Processor time of the process against that of the measured reference: more if a case's
        checks take a stiffer modulus or a shorter step.
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
    update: dict[str, object] = {"fidelity": option.fidelity}
    if (fraction := option.drop_timestep_fraction) is not None:
        update["drop_test"] = study.drop_test.model_copy(update={"timestep_fraction": fraction})
    return study.model_copy(update=update)


def breaking_step(case: Case, tradeoff: Tradeoff | None) -> tuple[float, str]:
    """The step over the Rayleigh time at which soft particles were seen to break, and where.

    Soft particles break at shorter steps, as shares of the Rayleigh time: the next softer level
    that was measured counts. Infinite where nothing was measured.
    """
    limit = case.study.chosen_fidelity().youngs_modulus_scale * (1 + 1e-9)
    broken = [
        (-one.youngs_modulus_scale, one.timestep_fraction)
        for one in (tradeoff.settings if tradeoff else ())
        if one.breaks and one.speed_factor == 1 and one.youngs_modulus_scale <= limit
    ]
    if tradeoff is None or not broken:
        return math.inf, ""
    level, fraction = min(broken)
    return fraction, (
        f"{100 * fraction:.3g} %, where the drag was wrong or a run failed with E x {-level:g} "
        f"({tradeoff.study}, {tradeoff.measured})"
    )


def consistent(case: Case, fidelity: Fidelity, tradeoff: Tradeoff | None) -> Fidelity:
    """Settings that pass every check of a case: the given ones, or the nearest to them.

    Modulus and time step change only to the accurate side, so that a measured error still holds;
    skin, filling step and ranks do not change the process. Warnings that remain are about the
    scene itself.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    fidelity : Fidelity
    tradeoff : Tradeoff or None
        Steps that were seen to break.
    """
    lowest = describe(case)["lowest_restitution"]
    filling = min(fidelity.filling_timestep_fraction, largest_fraction("settle", lowest))
    remedy: Mapping[str, float] = {
        "youngs_modulus_scale": max(fidelity.youngs_modulus_scale, softest_scale(case.study)),
        "timestep_fraction": min(fidelity.timestep_fraction, largest_fraction("drag", lowest)),
        "filling_timestep_fraction": filling,
    }
    while remedy:
        fidelity = fidelity.model_copy(update=remedy)
        study = case.study.model_copy(update={"fidelity": fidelity})
        remedy = next(_remedies(replace(case, study=study), tradeoff), {})
    return fidelity


def _remedies(case: Case, tradeoff: Tradeoff | None) -> Iterator[Mapping[str, float]]:
    """What checks that a case's settings do not pass take; the next one may need less after it."""
    found = chain(filling_cautions(case), process_cautions(case))
    yield from (one.settings for one in found if one.settings)
    breaking, _ = breaking_step(case, tradeoff)
    if case.study.chosen_fidelity().timestep_fraction >= breaking:
        yield {"timestep_fraction": stability_map().safety_factor * breaking}


def process_options(case: Case, tradeoff: Tradeoff, asked: Tolerance) -> Iterator[Option]:
    """Every measured setting that may be used, carried to the case's scene.

    Left out are settings whose step breaks, that too few runs stand
    behind, whose error was not measured, whose step is beyond the stability
    limit of the measured scene, or that cost as much as the reference.
    """
    reference = process_reference(case, tradeoff)
    limit = largest_fraction("drag", tradeoff.scene["lowest_restitution"])
    for setting in tradeoff.settings:
        error, cost = setting.errors.get(asked.quantity), setting.relative_cost
        sound = setting.failed == 0 and not setting.breaks and setting.runs >= _FEWEST_RUNS
        stable = sound and setting.timestep_fraction <= limit * (1 + 1e-9)
        if error is None or cost is None or not stable:
            continue
        fidelity = consistent(case, _carried(case, setting, tradeoff.scene), tradeoff)
        option = Option(fidelity, error, cost * _steps(fidelity, setting))
        dearest = option.relative_cost >= reference.relative_cost
        if not dearest and not option.same_settings(reference.fidelity):
            yield option


def _carried(case: Case, setting: MeasuredSetting, there: Mapping[str, float]) -> Fidelity:
    """A measured setting in another scene."""
    here = describe(case)
    stiffer = here["stiffness_number"] / there["stiffness_number"]
    slower = there["inertial_number"] / here["inertial_number"]
    return Fidelity(
        youngs_modulus_scale=carried_scale(setting.youngs_modulus_scale, stiffer),
        timestep_fraction=setting.timestep_fraction,
        speed_factor=carried_speed(setting.speed_factor, slower),
        skin_m=widest_skin(case.study),
    )


def _steps(fidelity: Fidelity, measured: FidelityParameters) -> float:
    """How many times as many steps as the measured settings a metre of path takes."""
    steps = math.sqrt(fidelity.youngs_modulus_scale / measured.youngs_modulus_scale)
    steps *= measured.timestep_fraction / fidelity.timestep_fraction
    return steps * measured.speed_factor / fidelity.speed_factor


def process_reference(case: Case, tradeoff: Tradeoff) -> Option:
    """The settings that errors are measured against, or the nearest that pass every check."""
    plain = Fidelity(**tradeoff.reference.model_dump(), skin_m=widest_skin(case.study))
    fidelity = consistent(case, plain, tradeoff)
    return Option(fidelity, None, _steps(fidelity, tradeoff.reference))


def drop_options(case: Case, tradeoff: Tradeoff) -> Iterator[Option]:
    """Every measured step of the drop test that is within the stability limit."""
    process, limit = _beside_drop(case, tradeoff)
    for drop in tradeoff.drop_test:
        if drop.timestep_fraction <= limit * (1 + 1e-9):
            yield _drop_option(process, drop, drop.timestep_fraction)


def finest_drop(case: Case, tradeoff: Tradeoff) -> Option:
    """The drop test with the smallest measured step, or a smaller one where damping is strong."""
    process, limit = _beside_drop(case, tradeoff)
    finest = min(tradeoff.drop_test, key=lambda drop: drop.timestep_fraction)
    return _drop_option(process, finest, min(finest.timestep_fraction, limit))


def _beside_drop(case: Case, tradeoff: Tradeoff) -> tuple[Fidelity, float]:
    """If the drop test is asked about: settings of the process, and largest step of the drop."""
    named = {**BUILT_IN_FIDELITIES, **case.study.fidelities}[_PROCESS_OF_DROP]
    limit = largest_fraction("impact", describe(case)["lowest_restitution"])
    return consistent(case, named, tradeoff), limit


def _drop_option(process: Fidelity, drop: MeasuredDrop, fraction: float) -> Option:
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
    return Option(process, error, drop.relative_cost, fraction)

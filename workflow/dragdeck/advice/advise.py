"""From a tolerance to settings.

The settings of a process promise nothing: its windows measure what they give in the scene itself,
and stop when the tolerance is met (docs/evidence/windows.md). Those of a drop test were measured
beforehand. Nothing here runs LIGGGHTS.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain

from dragdeck.advice.ways import Way, Ways, Work
from dragdeck.cases.bed import expected_surface, full_stiffness_number, softest_scale, widest_skin
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook import timestep as timesteps
from dragdeck.physics.contact_mechanics import FAST
from dragdeck.physics.rounding import rounded
from dragdeck.records.advised import AdvisedSettings
from dragdeck.records.tradeoff import DropEntry, TradeoffRecord, measured_tradeoff
from dragdeck.records.windows import WindowsRecord, front_of
from dragdeck.scenes.filling_cautions import filling_cautions
from dragdeck.scenes.fit import JAMMING_GAP, may_jam
from dragdeck.scenes.lead import FIRST_WINDOWS
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process_cautions import process_cautions
from dragdeck.study.fidelity import (
    BUILT_IN_FIDELITIES,
    LARGEST_TIMESTEP_FRACTION,
    RESTITUTION,
    Fidelity,
    SoftStart,
    Tolerance,
    Windows,
)
from dragdeck.study.model import Study

_PROCESS_OF_DROP = "standard"
"""Fidelity of the process in a study whose tolerance is about the drop test."""

_SOFT_STIFFNESS = 1000.0
"""Stiffness number of the softer runs from which others go on (docs/evidence/windows.md)."""

_SOFTEST_START = 0.3
"""Modulus scale from which on a softer start saves nothing."""

_FILLING_FRACTION = 0.5
"""Time step of a filling over the Rayleigh time, where it is stable: the bed and its drag are those
of smaller steps (docs/evidence/simplifications.md)."""

_STABILITY_NUMBER = 0.72
"""Stability number that steps at the physical modulus are forecast to have. In fast drags they are
no larger than those of the plain run: a sliding distance was 12 % too small."""

_PLAIN_FRACTION = 0.64
"""Time step over the Rayleigh time of the plain run that costs are compared with."""


@dataclass(frozen=True)
class Option:
    """Settings, as they are for a study.

    Attributes
    ----------
    fidelity : Fidelity
    relative_cost : float
        Forecast CPU time of all runs that depend on the settings, with the first windows, over
        that of the plain run.
    largest_cost : float
        The same with all windows that there can be.
    error : float or None
        Of a drop test: the largest measured one of an impact.
    drop_timestep_fraction : float or None
        Step of the drop test over the Rayleigh time, if the option is about it.
    """

    fidelity: Fidelity
    relative_cost: float
    largest_cost: float
    error: float | None = None
    drop_timestep_fraction: float | None = None

    def __str__(self) -> str:
        if self.drop_timestep_fraction is not None:
            return f"drop at {100 * self.drop_timestep_fraction:.3g} % of the Rayleigh time"
        chosen, windows = self.fidelity, self.fidelity.windows
        text = (
            f"E x {chosen.youngs_modulus_scale:g}, {100 * chosen.timestep_fraction:.3g} % of the "
            "Rayleigh time"
        )
        if chosen.soft_start is not None:
            text += f", begun with E x {chosen.soft_start.youngs_modulus_scale:g}"
        if windows is not None:
            step = f"{100 * windows.timestep_fraction:.3g} %"
            count = f"{FIRST_WINDOWS} to {windows.most}"
            text += f", {count} windows or the whole drag with E x 1 at {step}"
        return text


def with_option(study: Study, option: Option) -> Study:
    """A study with the settings of an option."""
    update: dict[str, object] = {"fidelity": option.fidelity}
    if (fraction := option.drop_timestep_fraction) is not None:
        update["drop_test"] = study.drop_test.model_copy(update={"timestep_fraction": fraction})
    return study.model_copy(update=update)


def consistent(case: Case) -> Fidelity:
    """Settings that pass every check of a case: its own, or the nearest to them.

    Modulus and time step change only to the accurate side; skin, filling step and ranks do not
    change the process. Warnings that remain are about the scene itself.
    """
    fidelity, lowest = case.study.chosen_fidelity(), describe(case)["lowest_restitution"]
    filling = min(fidelity.filling_timestep_fraction, timesteps.largest_fraction("settle", lowest))
    remedy: Mapping[str, float] = {
        "youngs_modulus_scale": max(fidelity.youngs_modulus_scale, softest_scale(case.study)),
        "filling_timestep_fraction": filling,
    }
    while remedy:
        fidelity = fidelity.model_copy(update=remedy)
        study = case.study.model_copy(update={"fidelity": fidelity})
        remedy = next(_remedies(replace(case, study=study)), {})
    return fidelity


def _remedies(case: Case) -> Iterator[Mapping[str, float]]:
    """What checks that a case's settings do not pass take; the next one may need less after it."""
    stable = timesteps.stable_step_cautions(case, surely=True)
    settling = timesteps.settling_cautions(case)
    cautions = chain(filling_cautions(case), settling, process_cautions(case), stable)
    yield from (caution.settings for caution in cautions if caution.settings)


def _with(case: Case, **settings: float | str | SoftStart) -> Case:
    """The case with these settings of a process."""
    chosen = {
        "skin_m": widest_skin(case.study),
        "ranks": "auto",
        "filling_timestep_fraction": _FILLING_FRACTION,
        **settings,
    }
    fidelity = Fidelity.model_validate(chosen)
    return replace(case, study=case.study.model_copy(update={"fidelity": fidelity}))


def soft_settings(case: Case) -> Fidelity:
    """Those of the soft run from which others go on, with its largest stable step."""
    scale = min((_SOFT_STIFFNESS / full_stiffness_number(case.study)) ** 1.5, 1.0)
    scale = max(rounded(scale, up=True), softest_scale(case.study))
    stable = timesteps.stable_fraction(_with(case, youngs_modulus_scale=scale))
    return consistent(_with(case, youngs_modulus_scale=scale, timestep_fraction=_step(stable)))


def stiff_settings(case: Case) -> Fidelity:
    """Those of a run at the physical modulus, begun softer if that saves anything."""
    stable = _step(timesteps.stable_fraction(_with(case), math.log(_STABILITY_NUMBER)))
    if describe(case)["inertial_number"] > FAST:
        stable = min(stable, _PLAIN_FRACTION)
    chosen = consistent(_with(case, timestep_fraction=stable))
    soft = soft_settings(case)
    if soft.youngs_modulus_scale > _SOFTEST_START:
        return chosen
    start = SoftStart(
        youngs_modulus_scale=soft.youngs_modulus_scale, timestep_fraction=soft.timestep_fraction
    )
    return chosen.model_copy(update={"soft_start": start})


def _step(stable: float) -> float:
    """A time step over the Rayleigh time that is stable and may be set."""
    return min(rounded(stable, up=False), LARGEST_TIMESTEP_FRACTION)


def ways_of(case: Case, requested: Tolerance, tradeoff: TradeoffRecord) -> Ways | None:
    """The ways to a tolerance; None where a softer run saves nothing, or no windows fit."""
    stiff = stiff_settings(case)
    if stiff.soft_start is None:
        return None
    windows = Windows(
        tolerance=requested.tolerance,
        quantities=list(requested.quantities),
        timestep_fraction=stiff.timestep_fraction,
    )
    soft = soft_settings(case).model_copy(update={"windows": windows})
    work = Work.of(case, tradeoff)
    plain = work.cpu_time(plain_option(case).fidelity)
    front = front_of(describe(case))
    ways = Ways(work, soft, stiff, requested, plain, WindowsRecord.shipped(), front)
    return ways if ways.most >= FIRST_WINDOWS else None


def plain_option(case: Case) -> Option:
    """The plain run at the physical modulus that costs are compared with."""
    return Option(consistent(_with(case, timestep_fraction=_PLAIN_FRACTION)), 1.0, 1.0)


def drop_options(case: Case, tradeoff: TradeoffRecord) -> Iterator[Option]:
    """Every measured step of the drop test that is within the stability limit."""
    process, limit = _beside_drop(case)
    for drop in tradeoff.drop_test:
        if drop.timestep_fraction <= limit * (1 + 1e-9):
            yield _drop_option(process, drop, drop.timestep_fraction)


def finest_drop(case: Case, tradeoff: TradeoffRecord) -> Option:
    """The drop test with the smallest measured step, or a smaller one where damping is strong."""
    process, limit = _beside_drop(case)
    finest = min(tradeoff.drop_test, key=lambda drop: drop.timestep_fraction)
    return _drop_option(process, finest, min(finest.timestep_fraction, limit))


def _beside_drop(case: Case) -> tuple[Fidelity, float]:
    """If the drop test is asked about: settings of the process, and largest step of the drop."""
    named = {**BUILT_IN_FIDELITIES, **case.study.fidelities}[_PROCESS_OF_DROP]
    limit = timesteps.largest_fraction("impact", describe(case)["lowest_restitution"])
    study = case.study.model_copy(update={"fidelity": named})
    return consistent(replace(case, study=study)), limit


def _drop_option(process: Fidelity, drop: DropEntry, fraction: float) -> Option:
    """A step of the drop test, whose error has no scatter."""
    cost = drop.relative_cost
    return Option(process, cost, cost, abs(drop.restitution_error), fraction)


@dataclass(frozen=True)
class Advice:
    """The settings for a tolerance.

    Attributes
    ----------
    requested : Tolerance
    chosen : Option
    reference : Option
        That costs are compared with; of a drop test, the finest.
    fallback : str or None
        Why the reference was chosen.
    ways : iterable of Way
        What could be done instead; none for a drop test, or where a softer run saves nothing.
    """

    requested: Tolerance
    chosen: Option
    reference: Option
    fallback: str | None = None
    ways: Iterable[Way] = ()

    @property
    def for_case(self) -> AdvisedSettings:
        """What ``case.json`` keeps of it."""
        return AdvisedSettings(
            tolerance=self.requested.tolerance,
            quantities=self.requested.quantities,
            error=self.chosen.error,
            relative_cost=self.chosen.relative_cost,
            largest_cost=self.chosen.largest_cost,
            fallback=self.fallback,
        )


def resolve(case: Case, requested: Tolerance, tradeoff: TradeoffRecord | None = None) -> Case:
    """The case with the settings that a tolerance asks for; it remembers the question.

    Parameters
    ----------
    case : Case
    requested : Tolerance
    tradeoff : TradeoffRecord, optional
        Instead of `measured_tradeoff`.

    Raises
    ------
    InputError
        The quantities do not go together.
    """
    advice = advised_settings(case, requested, tradeoff or measured_tradeoff())
    study = with_option(case.study, advice.chosen)
    return replace(case, study=study, requested=requested, advised=advice.for_case)


def advised_settings(case: Case, requested: Tolerance, tradeoff: TradeoffRecord) -> Advice:
    """The settings for a tolerance.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    requested : Tolerance
    tradeoff : TradeoffRecord
        Errors of the drop test, and what steps cost.

    Raises
    ------
    InputError
        The quantities do not go together.
    """
    if RESTITUTION not in requested.quantities:
        return _process_advice(case, requested, tradeoff)
    if len(requested.quantities) > 1:
        raise InputError(
            "the restitution is a quantity of the drop test, others are of the process",
            file=case.file,
            field="fidelity.quantity",
            value=", ".join(requested.quantities),
            limit=f"{RESTITUTION} alone, or quantities of the process",
            remedy="remove one of them",
        )
    finest = finest_drop(case, tradeoff)
    good = [
        option
        for option in drop_options(case, tradeoff)
        if (option.error or 0.0) <= requested.tolerance
    ]
    if good:
        return Advice(requested, min(good, key=lambda option: option.relative_cost), finest)
    why = (
        "no measured time step has an error of the restitution below "
        f"{shown_share(requested.tolerance)}: the smallest one is used, with "
        f"{shown_share(finest.error or 0.0)}"
    )
    return Advice(requested, finest, finest, why)


def _process_advice(case: Case, requested: Tolerance, tradeoff: TradeoffRecord) -> Advice:
    """The settings with which a tolerance is met in a case's own scene.

    A soft run over the whole path, and windows at the physical modulus until the tolerance is met;
    where the whole drag at that modulus is expected to cost less, that, after a soft start.

    Raises
    ------
    InputError
        Particles may jam between workpiece and bowl: a few events decide the means then, and
        neither the soft run nor the windows need contain one.
    """
    if may_jam(_with(case), expected_surface(case.study)):
        raise InputError(
            "a tolerance cannot be promised where particles may jam",
            file=case.file,
            field="fidelity.tolerance",
            value=requested.tolerance,
            limit=f"a gap of at least {JAMMING_GAP:g} particle diameters between workpiece and "
            "bowl, wall and floor",
            remedy="use a larger gap, or fidelity: {youngs_modulus_scale: 1} with several seeds",
        )
    plain, ways = plain_option(case), ways_of(case, requested, tradeoff)
    if ways is None:
        stiff, work = stiff_settings(case), Work.of(case, tradeoff)
        cost = work.cpu_time(stiff) / work.cpu_time(plain.fidelity)
        return Advice(requested, Option(stiff, cost, cost), plain)
    if ways.windows_pay:
        counts = FIRST_WINDOWS, ways.most
        option = Option(ways.soft, *(ways.with_windows(count).relative_cost for count in counts))
    else:
        cost = ways.whole.relative_cost
        option = Option(ways.stiff, cost, cost)
    return Advice(requested, option, plain, ways=ways)


def shown_share(fraction: float) -> str:
    """A share without its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * abs(fraction):.2g}'):g} %"

"""Measured settings as they are for a case: carried to its scene, and passing every check."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from dragdeck.cases.bed import bed_timestep, widest_skin
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.outlook.measured import (
    FidelityParameters,
    MeasuredDrop,
    MeasuredError,
    MeasuredLaw,
    MeasuredSetting,
    Tradeoff,
)
from dragdeck.outlook.stable_step import stable_step_cautions
from dragdeck.outlook.timestep import largest_fraction
from dragdeck.physics.similarity import (
    SAME_NUMBER,
    carried_scale,
    carried_speed,
    softest_scale,
)
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.filling import FILLING, expected_surface, expected_time, filling_cautions
from dragdeck.scenes.fit import process_cautions
from dragdeck.scenes.legs import plunge_point
from dragdeck.scenes.workpiece import FACET_STEP_S, PARTICLE_STEPS_PER_S, workpiece_facets
from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Study, Tolerance

_FEWEST_RUNS = 2
"""Runs of a setting below which its error is not believed."""

_PROCESS_OF_DROP = "standard"
"""Fidelity of the process in a study whose tolerance is about the drop test."""


@dataclass(frozen=True)
class Work:
    """What the filling and the process of a case take. Its drop test is the same at all settings.

    Attributes
    ----------
    study : Study
    tradeoff : Tradeoff
    filling_s, process_s : float
        Simulated time, that of the process at the study's own speed, s.
    facets : int
        Of all workpieces.
    """

    study: Study
    tradeoff: Tradeoff
    filling_s: float
    process_s: float
    facets: int

    @classmethod
    def of(cls, case: Case, tradeoff: Tradeoff) -> "Work":
        """Of a case; its own fidelity does not matter."""
        study, motion = case.study, case.study.motion
        way = math.dist(plunge_point(motion), motion.path.start_point)
        process_s = (
            expected_surface(study) / motion.plunge_speed_m_s
            + way / motion.approach_speed_m_s
            + motion.path_length_m / motion.axis_speed_m_s
        )
        facets = sum(workpiece_facets(one) for one in of_each_workpiece(case))
        return cls(study, tradeoff, expected_time(study), process_s, facets)

    def cpu_time(self, fidelity: Fidelity) -> float:
        """CPU time of both runs with some settings, s: only ratios of it count."""
        study = self.study.model_copy(update={"fidelity": fidelity})
        filling = self.filling_s / bed_timestep(study, "filling_timestep_fraction")
        process = self.process_s / bed_timestep(study, "timestep_fraction")
        process *= step_cost(fidelity.youngs_modulus_scale, self.tradeoff) / fidelity.speed_factor
        count = study.media.count
        of_facets = self.facets * FACET_STEP_S
        return filling * count / FILLING.particle_steps_per_s + process * (
            count / PARTICLE_STEPS_PER_S + of_facets
        )


def step_cost(scale: float, tradeoff: Tradeoff) -> float:
    """Time of a step of the drag at a modulus scale, over that at the others that were timed.

    Soft particles have more contacts, and their steps cost more. Interpolated over
    logarithms; 1 where nothing was timed.

    Parameters
    ----------
    scale : float
        Factor on every Young's modulus.
    tradeoff : Tradeoff
    """
    timed = sorted(
        (cost.level, cost.per_step)
        for cost in tradeoff.costs
        if cost.parameter == "youngs_modulus_scale" and cost.level and cost.per_step
    )
    if not timed:
        return 1.0
    levels, logs = zip(*((level, math.log(time)) for level, time in timed), strict=True)
    return math.exp(np.interp(math.log(scale), np.log(levels), logs))


@dataclass(frozen=True)
class Option:
    """Settings that were measured, as they are for a study.

    Attributes
    ----------
    fidelity : Fidelity
    error : MeasuredError or None
        None for the reference, which errors are measured against.
    relative_cost : float
        Forecast CPU time of all runs that depend on the settings, over that with the reference.
    drop_timestep_fraction : float or None
        Step of the drop test over the Rayleigh time, if the option is about it.
    extrapolated : bool
        The error is that of the value extrapolated to the physical Young's modulus.
    by_law : bool
        It was not measured in the scene of the trade-off, but follows from the law.
    """

    fidelity: Fidelity
    error: MeasuredError | None
    relative_cost: float
    drop_timestep_fraction: float | None = None
    extrapolated: bool = False
    by_law: bool = False

    def __str__(self) -> str:
        if self.drop_timestep_fraction is not None:
            return f"drop at {100 * self.drop_timestep_fraction:.3g} % of the Rayleigh time"
        chosen = self.fidelity
        return (
            f"E x {chosen.youngs_modulus_scale:g}, {100 * chosen.timestep_fraction:.3g} % of the "
            f"Rayleigh time, speed x {chosen.speed_factor:g}"
            f"{', extrapolated to E x 1' if self.extrapolated else ''}"
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


def consistent(case: Case, fidelity: Fidelity) -> Fidelity:
    """Settings that pass every check of a case: the given ones, or the nearest to them.

    Modulus and time step change only to the accurate side, so that a measured error still holds;
    skin, filling step and ranks do not change the process. Warnings that remain are about the
    scene itself.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    fidelity : Fidelity
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
        remedy = next(_remedies(replace(case, study=study)), {})
    return fidelity


def _remedies(case: Case) -> Iterator[Mapping[str, float]]:
    """What checks that a case's settings do not pass take; the next one may need less after it."""
    stable = stable_step_cautions(case, surely=True)
    found = chain(filling_cautions(case), process_cautions(case), stable)
    yield from (one.settings for one in found if one.settings)


def process_options(case: Case, tradeoff: Tradeoff, asked: Tolerance) -> Iterator[Option]:
    """Every measured setting that may be used, carried to the case's scene.

    Left out are settings whose step breaks, that too few runs stand
    behind, whose error was not measured, whose step is beyond the stability
    limit of the measured scene, or that cost as much as the reference.
    """
    reference = process_reference(case, tradeoff)
    known = _law(tradeoff, asked)
    work = Work.of(case, tradeoff)
    whole = work.cpu_time(reference.fidelity)
    for setting in _sound_settings(tradeoff):
        error = setting.errors.get(asked.quantity)
        if error is None:
            continue
        fidelity = consistent(case, _carried(case, setting, tradeoff.scene))
        corrected = fidelity.youngs_modulus_scale < 1 and fidelity.speed_factor == 1
        shown = _corrected(error, setting, known, tradeoff.scene) if corrected else None
        cost = work.cpu_time(fidelity) / whole
        option = Option(fidelity, shown or error, cost, extrapolated=shown is not None)
        dearest = option.relative_cost >= reference.relative_cost
        if not dearest and not option.same_settings(reference.fidelity):
            yield option


def _law(tradeoff: Tradeoff, asked: Tolerance) -> MeasuredLaw | None:
    """The law by which the report extrapolates a quantity."""
    return tradeoff.stiffness.laws.get(asked.quantity) if tradeoff.stiffness else None


def _corrected(
    error: MeasuredError,
    setting: MeasuredSetting,
    known: MeasuredLaw | None,
    scene: Mapping[str, float],
) -> MeasuredError | None:
    """A measured error of the extrapolated value; None where nothing is extrapolated.

    The law multiplies every value of a setting by the same number, and so does it the error.
    """
    if known is None or not scene.get(known.friction):
        return None
    factor = math.exp(-known.effect(scene, setting.youngs_modulus_scale)[0])

    def shifted(value: float) -> float:
        return (1 + value) * factor - 1

    reach = error.bound - abs(error.value)
    ends = (abs(shifted(error.value + sign * reach)) for sign in (-1, 1))
    return MeasuredError(
        value=shifted(error.value),
        se=error.se * factor,
        ci95_low=shifted(error.ci95_low),
        ci95_high=shifted(error.ci95_high),
        bound=max(ends),
        single_parameter_error=error.single_parameter_error,
    )


SCALES = tuple(step * 10.0**power for power in (-5, -4, -3, -2, -1) for step in (1, 2, 5))
"""Modulus scales from which a law is asked to extrapolate: so dense that the advice has no jump."""


def extrapolated_options(case: Case, tradeoff: Tradeoff, asked: Tolerance) -> Iterator[Option]:
    """Settings with a reduced modulus whose results are extrapolated to the physical one.

    None where no law of the quantity was measured, and none softer than the runs that it was
    measured with. The error is that of the law in one scene: how far the effect of a reduced
    modulus scatters from scene to scene, how well its mean is known, and what extrapolations erred
    in scenes that were left out.
    """
    known, numbers = _law(tradeoff, asked), describe(case)
    fractions = [
        setting.timestep_fraction
        for setting in _sound_settings(tradeoff)
        if setting.speed_factor == 1 and setting.youngs_modulus_scale < 1
    ]
    if (
        tradeoff.stiffness is None
        or known is None
        or not numbers.get(known.friction)
        or not fractions
    ):
        return
    softest = tradeoff.stiffness.lowest_stiffness_number / numbers["stiffness_number"]
    work = Work.of(case, tradeoff)
    whole = work.cpu_time(process_reference(case, tradeoff).fidelity)
    lowest = max(softest_scale(case.study), (softest * (1 - SAME_NUMBER)) ** 1.5)
    for scale in (one for one in SCALES if one >= lowest):
        fidelity = consistent(
            case,
            Fidelity(
                youngs_modulus_scale=scale,
                timestep_fraction=max(fractions),
                skin_m=widest_skin(case.study),
                ranks="auto",
            ),
        )
        error = _law_error(known, numbers, fidelity.youngs_modulus_scale)
        cost = work.cpu_time(fidelity) / whole
        yield Option(fidelity, error, cost, extrapolated=True, by_law=True)


def _sound_settings(tradeoff: Tradeoff) -> Iterator[MeasuredSetting]:
    """The measured settings that may be used anywhere."""
    limit = largest_fraction("drag", tradeoff.scene["lowest_restitution"]) * (1 + 1e-9)
    for setting in tradeoff.settings:
        sound = setting.failed == 0 and not setting.breaks and setting.runs >= _FEWEST_RUNS
        if sound and setting.timestep_fraction <= limit and setting.relative_cost is not None:
            yield setting


def toward_law(
    case: Case, option: Option, close: float, tradeoff: Tradeoff, asked: Tolerance
) -> Option:
    """An extrapolated option as it is at some distance from the scene of the trade-off.

    Its error passes from the one that was measured there (`close` is 1) to that of the law (0), so
    that nothing jumps where a scene leaves the range.
    """
    known = _law(tradeoff, asked)
    if known is None or option.error is None:
        return option
    there = dict(option.error)
    scale = option.fidelity.youngs_modulus_scale
    here = dict(_law_error(known, describe(case), scale))
    mixed = {name: close * there[name] + (1 - close) * here[name] for name in there}
    return replace(option, error=MeasuredError(**mixed), by_law=close == 0)


def _law_error(known: MeasuredLaw, numbers: Mapping[str, float], scale: float) -> MeasuredError:
    """The relative error of an extrapolation from a modulus scale in a scene.

    The standard error of `dragchain.tradeoff.stiffness_law.extrapolate`, without the scatter of
    the run.
    """
    _, se = known.effect(numbers, scale)
    low, high = (math.expm1(sign * known.quantile * se) for sign in (-1, 1))
    return MeasuredError(
        value=0.0, se=se, ci95_low=low, ci95_high=high, bound=high, single_parameter_error=0.0
    )


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
        ranks="auto",
    )


def process_reference(case: Case, tradeoff: Tradeoff) -> Option:
    """The settings that errors are measured against, or the nearest that pass every check."""
    plain = Fidelity(
        **tradeoff.reference.model_dump(), skin_m=widest_skin(case.study), ranks="auto"
    )
    return Option(consistent(case, plain), None, 1.0)


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
    return consistent(case, named), limit


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

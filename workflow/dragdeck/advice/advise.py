"""From a tolerance to settings: the cheapest measured settings that meet it.

Pure arithmetic on the measured trade-off (docs/evidence/tradeoff.md) and on a study. Nothing here
runs LIGGGHTS.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from dragdeck.advice.options import (
    Option,
    drop_options,
    extrapolated_options,
    finest_drop,
    process_options,
    process_reference,
    toward_law,
    with_option,
)
from dragdeck.cases.case import Case
from dragdeck.decks.advised import AdvisedSettings
from dragdeck.errors import InputError
from dragdeck.outlook.measured import Tradeoff, measured_tradeoff
from dragdeck.outlook.measured_range import LAW_NAMES, RANGE_LABELS, Outside, beyond, closeness
from dragdeck.physics.similarity import SAME_NUMBER
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import Study, Tolerance

OUTSIDE_FACTOR = 0.5
"""On the tolerance when a scene lies outside of the measured range, which keeps a value at the
physical Young's modulus alone. An assumption: nothing measured says how much an error grows."""

_NORMAL_95 = 1.96
"""Half-width of a 95 % interval in standard deviations of a normal distribution."""

RESTITUTION = "restitution"
"""The quantity of the drop test; all others are of the process."""


@dataclass(frozen=True)
class Spread:
    """What chance makes of one run, whatever its settings.

    Attributes
    ----------
    half_width : float
        Half of the 95 % interval of one run's value, relative.
    counted_m : float
        Path that the run's statistics count.
    needed_m : float
        Counted path at which the half-width is the tolerance.
    """

    half_width: float
    counted_m: float
    needed_m: float


@dataclass(frozen=True)
class Advice:
    """The settings for a tolerance, and all that must be said of them.

    Attributes
    ----------
    asked : Tolerance
    held_to : float
        The tolerance that the settings were chosen for: the asked one, or a
        smaller one outside of the measured range.
    label : str
        The quantity in words.
    chosen : Option
    cheaper, dearer : Option or None
        The next ones; the cheaper misses the tolerance, the dearer errs less.
    reference : Option
    outside : sequence of Outside
    fallback : str or None
        Why the reference was chosen although nothing measured meets the tolerance.
    spread : Spread or None
        None for the drop test.
    source : str
        Where the errors come from.
    """

    asked: Tolerance
    held_to: float
    label: str
    chosen: Option
    cheaper: Option | None
    dearer: Option | None
    reference: Option
    outside: Sequence[Outside]
    fallback: str | None
    spread: Spread | None
    source: str

    @property
    def speedup(self) -> float:
        """How many times cheaper than the reference."""
        return 1 / self.chosen.relative_cost

    @property
    def for_case(self) -> AdvisedSettings:
        """What ``case.json`` keeps of it."""
        error = self.chosen.error
        return AdvisedSettings(
            tolerance=self.asked.tolerance,
            quantity=self.asked.quantity,
            label=self.label,
            held_to=self.held_to,
            extrapolated=self.chosen.extrapolated,
            error=error.value if error else None,
            ci95_low=error.ci95_low if error else None,
            ci95_high=error.ci95_high if error else None,
            bound=error.bound if error else None,
            relative_cost=self.chosen.relative_cost,
            half_width=self.spread.half_width if self.spread else None,
            outside=[str(number) for number in self.outside],
            fallback=self.fallback,
            source=self.source,
        )


def resolve(case: Case, asked: Tolerance, tradeoff: Tradeoff | None = None) -> Case:
    """The case with the settings that a tolerance asks for; it remembers the question.

    Parameters
    ----------
    case : Case
    asked : Tolerance
    tradeoff : Tradeoff, optional
        Instead of `measured_tradeoff`.

    Raises
    ------
    InputError
        This quantity was not measured.
    """
    advice = advise(case, asked, tradeoff or measured_tradeoff())
    study = with_option(case.study, advice.chosen)
    return replace(case, study=study, asked=asked, advised=advice.for_case)


def advise(case: Case, asked: Tolerance, tradeoff: Tradeoff) -> Advice:
    """The cheapest settings whose error is within a tolerance.

    What is promised is the value that the report shows: the one at the physical Young's modulus
    wherever a law extrapolates the quantity. A measured error holds in the range of the trade-off,
    and less and less beyond it; what a law promises holds in the range of the designed scenes, and
    outside of it must be within `OUTSIDE_FACTOR` of the tolerance. A value as it is with a reduced
    modulus is never promised outside. Where nothing meets the tolerance, the reference settings
    are taken.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    asked : Tolerance
    tradeoff : Tradeoff

    Raises
    ------
    InputError
        This quantity was not measured.
    """
    drop = asked.quantity == RESTITUTION
    _check_quantity(case, asked, tradeoff)
    here = describe(case)
    names = ("lowest_restitution",) if drop else tuple(RANGE_LABELS)
    scenes = [tradeoff.scene, *(one.numbers for one in tradeoff.promises if one.met)]
    outside = [*beyond(here, scenes, names), *([] if drop else _outside_numbers(here, tradeoff))]
    close = 0.0 if outside else closeness(here, scenes, names)
    if drop:
        reference = finest_drop(case, tradeoff)
        held = [(one, _held(close), outside) for one in drop_options(case, tradeoff)]
    else:
        reference = process_reference(case, tradeoff)
        by_law = list(_extrapolated(case, here, tradeoff, asked))
        held = [*by_law]
        for one in process_options(case, tradeoff, asked):
            if one.extrapolated and by_law:
                _, share, beside = by_law[0]
                mixed = toward_law(case, one, close, tradeoff, asked)
                held.append((mixed, share + (1.0 - share) * close, beside if outside else []))
            else:
                held.append((one, _held(close) if _at_full_modulus(one) else close**2, outside))
    options = [option for option, _, _ in held]
    holding = [
        one for one in held if one[0].error and one[0].error.limit <= asked.tolerance * one[1]
    ]
    found = reference, _held(close), outside
    chosen, share, beside = min(holding, key=lambda one: _cost_then_bound(one[0]), default=found)
    cheaper, dearer = _neighbours(options, chosen, reference)
    held_to = asked.tolerance * share
    return Advice(
        asked=asked,
        held_to=held_to,
        label=RESTITUTION if drop else tradeoff.label(asked.quantity),
        chosen=chosen,
        cheaper=cheaper,
        dearer=dearer,
        reference=reference,
        outside=beside,
        fallback=None if holding else _fallback(asked, held_to, options, reference, tradeoff),
        spread=None if drop else _spread(case.study, asked, tradeoff),
        source=_source(chosen, tradeoff),
    )


def _held(close: float) -> float:
    """Share of a tolerance that an error must be within where a range is left."""
    return OUTSIDE_FACTOR + (1.0 - OUTSIDE_FACTOR) * close


def _source(chosen: Option, tradeoff: Tradeoff) -> str:
    if chosen.by_law and tradeoff.stiffness is not None:
        scenes = len(tradeoff.stiffness.scenes)
        return f"measured {tradeoff.stiffness.measured} in {scenes} designed scenes"
    return f"measured {tradeoff.measured} on {tradeoff.study}, plan {tradeoff.plan}"


def _check_quantity(case: Case, asked: Tolerance, tradeoff: Tradeoff) -> None:
    """Refuse a tolerance about something that was not measured."""
    known = [RESTITUTION] if tradeoff.drop_test else []
    laws = tradeoff.stiffness.laws if tradeoff.stiffness else {}
    known += [name for name in {**tradeoff.quantities, **laws} if name not in known]
    if asked.quantity not in known:
        raise InputError(
            "the error of this quantity was not measured",
            file=case.file,
            field="fidelity.quantity",
            value=asked.quantity,
            limit=f"one of: {', '.join(known)}",
            remedy="choose one of these, or settings with the physical Young's modulus: "
            "fidelity: {youngs_modulus_scale: 1}",
        )


def _extrapolated(
    case: Case, here: Mapping[str, float], tradeoff: Tradeoff, asked: Tolerance
) -> Iterator[tuple[Option, float, list[Outside]]]:
    """What may be extrapolated to the physical modulus, and which share of a tolerance holds it."""
    if tradeoff.stiffness is None:
        return
    scenes = [scene.numbers for scene in tradeoff.stiffness.scenes]
    share = _held(closeness(here, scenes, LAW_NAMES))
    outside = list(beyond(here, scenes, LAW_NAMES))
    for option in extrapolated_options(case, tradeoff, asked):
        yield option, share, outside


def _at_full_modulus(option: Option) -> bool:
    """Whether only the time step differs from a plain run."""
    return option.fidelity.youngs_modulus_scale == 1 and option.fidelity.speed_factor == 1


def _outside_numbers(here: Mapping[str, float], tradeoff: Tradeoff) -> Iterator[Outside]:
    """Where neither full modulus nor the study's own speed reaches the measured numbers."""
    scale = min((one.youngs_modulus_scale for one in tradeoff.settings), default=1.0)
    factor = max((one.speed_factor for one in tradeoff.settings), default=1.0)
    softest = scale ** (2 / 3) * tradeoff.scene["stiffness_number"]
    fastest = factor * tradeoff.scene["inertial_number"]
    stiffness, inertial = here["stiffness_number"], here["inertial_number"]
    if stiffness < softest * (1 - SAME_NUMBER):
        yield Outside("stiffness number at full modulus", stiffness, softest, math.inf)
    if inertial > fastest * (1 + SAME_NUMBER):
        yield Outside("inertial number at the study's speed", inertial, 0.0, fastest)


def _cost_then_bound(option: Option) -> tuple[float, float]:
    return option.relative_cost, option.error.limit if option.error else 0.0


def _neighbours(
    options: Sequence[Option], chosen: Option, reference: Option
) -> tuple[Option | None, Option | None]:
    """The dearest option below the chosen one's cost, and the cheapest above that errs less."""
    below = [option for option in options if option.relative_cost < chosen.relative_cost]
    cheaper = max(below, key=_cost_then_bound, default=None)
    if chosen.error is None or chosen == reference:
        return cheaper, None
    limit = chosen.error.limit
    above = [
        option
        for option in options
        if option.relative_cost > chosen.relative_cost
        and option.error is not None
        and option.error.limit < limit
    ]
    return cheaper, min(above, key=_cost_then_bound, default=reference)


def _fallback(
    asked: Tolerance,
    held_to: float,
    options: Sequence[Option],
    reference: Option,
    tradeoff: Tradeoff,
) -> str:
    """Why the reference: nothing cheaper meets the tolerance; and what is known of it."""
    best = min((option.error.limit for option in options if option.error), default=None)
    smallest = "" if best is None else f" (smallest upper bound: {percent(best)})"
    text = (
        f"no setting that may be used here has an error below {percent(held_to)}{smallest}: "
        f"the reference settings are used ({reference})"
    )
    quantity = tradeoff.quantities.get(asked.quantity)
    if quantity is None or not quantity.reference or quantity.se is None:
        return text
    known = percent(quantity.se)
    return f"{text}; the reference itself has a standard error of {known}"


def _spread(study: Study, asked: Tolerance, tradeoff: Tradeoff) -> Spread | None:
    """Chance in one run's value, from the spread of measured runs; falls with the root of path."""
    run_std, arc_m = _scatter_of(study, asked.quantity, tradeoff)
    counted = study.motion.path_length_m - study.motion.uncounted_m
    if run_std is None or counted <= 0:
        return None
    alone = _NORMAL_95 * run_std
    half_width = alone * math.sqrt(arc_m / counted)
    return Spread(half_width, counted, arc_m * (alone / asked.tolerance) ** 2)


def _scatter_of(study: Study, name: str, tradeoff: Tradeoff) -> tuple[float | None, float]:
    """Relative standard deviation of a quantity in one run, and the path that it belongs to, m."""
    if name in tradeoff.quantities or tradeoff.stiffness is None:
        quantity = tradeoff.quantities[name]
        return quantity.run_std, quantity.arc_m
    known = tradeoff.stiffness.laws[name]
    return known.law.run_std, known.path_to_particle * 2.0 * study.media.radius_mean_m


def percent(fraction: float) -> str:
    """A share without its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * abs(fraction):.2g}'):g} %"


def signed(fraction: float) -> str:
    """A share with its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * fraction:.2g}'):+g} %"

"""From a tolerance to settings: the cheapest measured settings that meet it.

Pure arithmetic on the measured trade-off (docs/evidence/tradeoff.md) and on a study. Nothing here
runs LIGGGHTS.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from dragdeck.advice.options import (
    Option,
    drop_options,
    extrapolated_options,
    finest_drop,
    process_options,
    process_reference,
    with_option,
)
from dragdeck.cases.case import Case
from dragdeck.decks.advised import AdvisedSettings
from dragdeck.errors import InputError
from dragdeck.outlook.measured import Tradeoff, measured_tradeoff
from dragdeck.physics.similarity import SAME_NUMBER
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.contact_law import compared_labels
from dragdeck.study.model import Study, Tolerance

WIDENING = 0.1
"""How far beyond the measured scenes a number of a scene still counts as measured."""

OUTSIDE_FACTOR = 0.5
"""On the tolerance when a scene lies outside of the measured range. An
assumption: nothing measured says how much an error grows there."""

_NORMAL_95 = 1.96
"""Half-width of a 95 % interval in standard deviations of a normal distribution."""

RESTITUTION = "restitution"
"""The quantity of the drop test; all others are of the process."""

_RANGE_LABELS = {
    "workpiece_to_particle": "ratio of workpiece to particle diameter",
    "depth_to_particle": "ratio of depth to particle diameter",
    "bowl_to_particle": "ratio of bowl to particle diameter",
    **compared_labels(),
    "superposed_speed": "ratio of additional surface speed to mean speed along the path",
    "bowl_froude_number": "Froude number of the bowl's rotation",
    "tilt_deg": "tilt of the workpiece (degrees)",
    "further_workpieces": "number of further workpieces",
}
"""The numbers of a scene that must lie within the measured range."""


@dataclass(frozen=True)
class Outside:
    """A number of a scene that no measured scene comes near."""

    field: str
    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return (
            f"{self.field} {self.value:.3g} is outside the range {self.low:.3g} to {self.high:.3g}"
        )


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
    """The cheapest measured settings whose error is within a tolerance.

    Where the case's scene lies outside of the range of the trade-off, results that are
    extrapolated to the physical Young's modulus are offered, with an error that was measured in
    designed scenes. Outside of their range, too, the error must be within `OUTSIDE_FACTOR` of
    the tolerance. Where no measured setting meets it, the reference settings are taken.

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
    options = list(drop_options(case, tradeoff) if drop else process_options(case, tradeoff, asked))
    reference = finest_drop(case, tradeoff) if drop else process_reference(case, tradeoff)
    names = ("lowest_restitution",) if drop else None
    here = describe(case)
    outside = list(_outside_of(here, tradeoff, names))
    extrapolated = [] if drop else list(_extrapolated(case, here, tradeoff, asked))
    if outside and extrapolated:
        options, outside = [one for one in options if _at_full_modulus(one)], []
    options += extrapolated
    held_to = asked.tolerance * (OUTSIDE_FACTOR if outside else 1.0)
    holding = [option for option in options if option.error and option.error.limit <= held_to]
    chosen = min(holding, key=_cost_then_bound, default=reference)
    cheaper, dearer = _neighbours(options, chosen, reference)
    return Advice(
        asked=asked,
        held_to=held_to,
        label=RESTITUTION if drop else tradeoff.label(asked.quantity),
        chosen=chosen,
        cheaper=cheaper,
        dearer=dearer,
        reference=reference,
        outside=outside,
        fallback=None if holding else _fallback(asked, held_to, options, reference, tradeoff),
        spread=None if drop else _spread(case.study, asked, tradeoff),
        source=_source(chosen, tradeoff),
    )


def _source(chosen: Option, tradeoff: Tradeoff) -> str:
    if chosen.extrapolated and tradeoff.stiffness is not None:
        scenes = sum(bool(one.runs) for one in tradeoff.stiffness.scenes)
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


def _outside_of(
    here: Mapping[str, float], tradeoff: Tradeoff, names: Sequence[str] | None = None
) -> Iterator[Outside]:
    """The numbers of a scene that are outside of the measured range.

    The range spans the measured scene and those in which a prediction was
    checked and met, and `WIDENING` beyond. The stiffness number must not be
    below, nor the inertial number above, what any setting was measured at.
    """
    scenes = [tradeoff.scene, *(one.numbers for one in tradeoff.promises if one.met)]
    yield from _beyond(here, scenes, _RANGE_LABELS if names is None else names)
    if names is None:
        yield from _outside_numbers(here, tradeoff)


def _beyond(
    here: Mapping[str, float], scenes: Sequence[Mapping[str, float]], names: Iterable[str]
) -> Iterator[Outside]:
    """The numbers of a scene that no other scene comes near."""
    for name in names:
        values = [scene.get(name, 0.0) for scene in scenes]
        low, high = (1 - WIDENING) * min(values), (1 + WIDENING) * max(values)
        value = here.get(name, 0.0)  # an absent coefficient
        if not low <= value <= high:
            yield Outside(_RANGE_LABELS.get(name, name.replace("_", " ")), value, low, high)


def _extrapolated(
    case: Case, here: Mapping[str, float], tradeoff: Tradeoff, asked: Tolerance
) -> Iterator[Option]:
    """What may be extrapolated to the physical modulus: nothing in a scene unlike all designed."""
    if tradeoff.stiffness is None:
        return
    scenes = [scene.numbers for scene in tradeoff.stiffness.scenes]
    names = [*_RANGE_LABELS, "stiffness_number", "inertial_number"]
    if not any(_beyond(here, scenes, names)):
        yield from extrapolated_options(case, tradeoff, asked)


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
        f"no measured setting has an error below {percent(held_to)}{smallest}: "
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

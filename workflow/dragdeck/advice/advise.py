"""From an asked tolerance to settings: what is cheapest of all that was measured to hold it.

Pure arithmetic on ``data/tradeoff.json``, the measured trade of speed against
accuracy (docs/trade.md), and on a study. Nothing here runs an engine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from dragdeck.cases.case import Case
from dragdeck.decks.case_file import AdvisedSettings
from dragdeck.errors import InputError
from dragdeck.outlook.measured import Tradeoff, measured_tradeoff, tradeoff_if_measured
from dragdeck.outlook.timestep import largest_fraction
from dragdeck.physics.similarity import SAME_NUMBER, carried_scale, carried_speed, softest_scale
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.motion import path_length
from dragdeck.scenes.process import PROCESS
from dragdeck.study.contact_law import compared_labels
from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Study, Tolerance

FEWEST_RUNS = 2
"""Runs of a setting below which its error is not believed."""

WIDENING = 0.1
"""How far beyond the measured scenes a number of a scene still counts as measured."""

OUTSIDE_FACTOR = 0.5
"""On the tolerance when a scene lies outside of the measured range. An
assumption: nothing measured says how much an error grows there."""

NORMAL_95 = 1.96
"""Half-width of a 95 % interval in standard deviations of a normal distribution."""

PROCESS_OF_DROP = "standard"
"""Fidelity of the process in a study whose tolerance is about the drop test."""

RANGE_LABELS = {
    "workpiece_to_particle": "ratio of workpiece to particle diameter",
    "depth_to_particle": "ratio of depth to particle diameter",
    "bowl_to_particle": "ratio of bowl to particle diameter",
    **compared_labels(),
}
"""The numbers of a scene that must lie within the measured range."""


@dataclass(frozen=True)
class Error:
    """A measured error relative to the reference settings, dimensionless.

    Attributes
    ----------
    error, se : float
    ci95_low, ci95_high : float
        95 % interval.
    bound : float
        The absolute error is below it with 95 % confidence.
    alone : float
        The largest absolute error of one of the parameters, turned alone.
    """

    error: float
    se: float
    ci95_low: float
    ci95_high: float
    bound: float
    alone: float

    @property
    def limit(self) -> float:
        """What a tolerance is compared with.

        Parameters must not hold it by cancelling each other.
        """
        return max(self.bound, self.alone)

    def __str__(self) -> str:
        return f"{signed(self.error)} ({signed(self.ci95_low)} to {signed(self.ci95_high)})"


@dataclass(frozen=True)
class Option:
    """Settings that were measured, as they are for a study.

    Attributes
    ----------
    fidelity : Fidelity
    error : Error or None
        None for the reference, which errors are measured against.
    relative_cost : float
        Processor time against the reference's.
    drop_timestep_fraction : float or None
        Step of the drop test over the Rayleigh time, if the option is about it.
    """

    fidelity: Fidelity
    error: Error | None
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

    def same_settings(self, fidelity: Fidelity) -> bool:
        """Whether a fidelity asks for the same modulus, step and speed."""
        names = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
        return all(math.isclose(getattr(self.fidelity, n), getattr(fidelity, n)) for n in names)


@dataclass(frozen=True)
class Outside:
    """A number of a scene that no measured scene comes near."""

    field: str
    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.field} {self.value:.3g} is outside of {self.low:.3g} to {self.high:.3g}"


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
        Why the reference was chosen although nothing measured holds the tolerance.
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
            error=error.error if error else None,
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
    trade : mapping, optional
        Instead of `measured_tradeoff`.

    Raises
    ------
    InputError
        Nothing was measured, or not this quantity.
    """
    advice = advise(case, asked, tradeoff)
    return replace(
        case,
        study=with_option(case.study, advice.chosen),
        asked=asked,
        advised=advice.for_case,
    )


def with_option(study: Study, option: Option) -> Study:
    """A study with the settings of an option."""
    if option.drop_timestep_fraction is None:
        return study.model_copy(update={"fidelity": option.fidelity})
    drop = study.drop_test.model_copy(update={"timestep_fraction": option.drop_timestep_fraction})
    return study.model_copy(update={"fidelity": PROCESS_OF_DROP, "drop_test": drop})


def advise(case: Case, asked: Tolerance, tradeoff: Tradeoff | None = None) -> Advice:
    """The cheapest measured settings whose error holds a tolerance.

    Where the case's scene lies outside of the measured range the error is held
    to `OUTSIDE_FACTOR` of the tolerance. Where nothing measured holds it, the
    reference settings are taken.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    asked : Tolerance
    trade : mapping, optional
        Instead of `measured_tradeoff`.

    Raises
    ------
    InputError
        Nothing was measured, or not this quantity.
    """
    tradeoff = measured_tradeoff() if tradeoff is None else tradeoff
    drop = asked.quantity == "restitution"
    here = describe(case)
    _check_quantity(case, asked, tradeoff)
    options = list(drop_options(case, tradeoff) if drop else process_options(case, tradeoff, asked))
    reference = finest_drop(case, tradeoff) if drop else process_reference(case, tradeoff)
    outside = list(outside_of(here, tradeoff, ("lowest_restitution",) if drop else None))
    held_to = asked.tolerance * (OUTSIDE_FACTOR if outside else 1.0)
    holding = [option for option in options if option.error and option.error.limit <= held_to]
    chosen = min(holding, key=_cost_then_bound, default=reference)
    cheaper, dearer = _neighbours(options, chosen, reference)
    return Advice(
        asked=asked,
        held_to=held_to,
        label="restitution" if drop else tradeoff["quantities"][asked.quantity]["label"],
        chosen=chosen,
        cheaper=cheaper,
        dearer=dearer,
        reference=reference,
        outside=outside,
        fallback=None if holding else _fallback(asked, held_to, options, reference, tradeoff),
        spread=None if drop else _spread(case.study, asked, tradeoff),
        source=f"measured {tradeoff['measured']} on {tradeoff['study']}, plan {tradeoff['plan']}",
    )


def _check_quantity(case: Case, asked: Tolerance, tradeoff: Tradeoff) -> None:
    """Refuse a tolerance about something that was not measured."""
    known = ["restitution"] if tradeoff["drop_test"] else []
    known += [name for name in tradeoff["quantities"] if name not in known]
    if asked.quantity not in known:
        raise InputError(
            "no error of this quantity was measured",
            file=case.file,
            field="fidelity.quantity",
            value=asked.quantity,
            limit=f"one of: {', '.join(known)}",
            remedy="ask for one of these",
        )


def process_options(case: Case, tradeoff: Tradeoff, asked: Tolerance) -> Iterator[Option]:
    """Every measured setting that may be used, carried to the case's scene.

    Left out are settings whose step breaks, that too few runs stand
    behind, whose error was not measured, whose step is beyond the stability
    limit of the measured scene, or that cost as much as the reference.
    """
    here, there = describe(case), tradeoff["scene"]
    limit = largest_fraction(PROCESS, there["lowest_restitution"])
    for row in tradeoff["settings"]:
        entry = row["errors"].get(asked.quantity)
        sound = row["failed"] == 0 and not row["breaks"]
        stable = sound and row["timestep_fraction"] <= limit * (1 + 1e-9)
        if entry is None or not stable or row["runs"] < FEWEST_RUNS:
            continue
        option = _carried(case.study, row, entry, here, there)
        if option.relative_cost < 1 and not _is_reference(option, tradeoff):
            yield option


def breaking_note(case: Case, tradeoff: Tradeoff | None = None) -> list[tuple[str, str]]:
    """What ``check`` and ``explain`` say of the step at which soft particles were seen to break.

    Soft particles break at shorter steps, as shares of the Rayleigh time: the next
    softer level that was measured counts. Nothing is said where nothing was
    measured.
    """
    tradeoff = tradeoff_if_measured() if tradeoff is None else tradeoff
    chosen = case.study.chosen_fidelity()
    limit = chosen.youngs_modulus_scale * (1 + 1e-9)
    broken = [
        row for row in tradeoff.get("settings", ()) if row["breaks"] and row["speed_factor"] == 1
    ]
    softer = [row for row in broken if row["youngs_modulus_scale"] <= limit]
    if not softer:
        return []
    level = max(row["youngs_modulus_scale"] for row in softer)
    fraction = min(r["timestep_fraction"] for r in softer if r["youngs_modulus_scale"] == level)
    verdict = "below" if chosen.timestep_fraction < fraction else "NOT BELOW"
    text = (
        f"{100 * chosen.timestep_fraction:.3g} % is {verdict} {100 * fraction:.3g} %, "
        f"where the drag "
        f"was wrong or a run failed with E x {level:g} ({tradeoff['study']}, "
        f"{tradeoff['measured']})"
    )
    return [("breaking step", text)]


def _carried(
    study: Study,
    row: Mapping[str, Any],
    entry: Mapping[str, Any],
    here: Mapping[str, float],
    there: Mapping[str, float],
) -> Option:
    """A measured setting in another scene; steps are shorter or more, and so is the cost."""
    scale, fraction, factor = (
        row[name] for name in ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
    )
    stiffer = here["stiffness_number"] / there["stiffness_number"]
    slower = there["inertial_number"] / here["inertial_number"]
    fidelity = Fidelity(
        youngs_modulus_scale=max(carried_scale(scale, stiffer), softest_scale(study)),
        timestep_fraction=min(fraction, largest_fraction(PROCESS, here["lowest_restitution"])),
        filling_timestep_fraction=_filling_fraction(here),
        speed_factor=carried_speed(factor, slower),
    )
    steps = math.sqrt(fidelity.youngs_modulus_scale / scale)
    steps *= fraction / fidelity.timestep_fraction * factor / fidelity.speed_factor
    error = Error(*(float(entry[name]) for name in Error.__dataclass_fields__))
    return Option(fidelity, error, row["relative_cost"] * steps)


def _filling_fraction(here: Mapping[str, float]) -> float:
    """Step of the fill over the Rayleigh time: the usual one, less where damping is strong."""
    usual = float(Fidelity().filling_timestep_fraction)
    return min(usual, largest_fraction(FILLING, here["lowest_restitution"]))


def process_reference(case: Case, tradeoff: Tradeoff) -> Option:
    """The settings that errors are measured against."""
    filling = _filling_fraction(describe(case))
    return Option(Fidelity(**tradeoff["reference"], filling_timestep_fraction=filling), None, 1.0)


def _is_reference(option: Option, tradeoff: Tradeoff) -> bool:
    return option.same_settings(Fidelity(**tradeoff["reference"]))


def drop_options(case: Case, tradeoff: Tradeoff) -> Iterator[Option]:
    """Every measured step of the drop test that is within the stability limit."""
    limit = _drop_limit(case)
    for row in tradeoff["drop_test"]:
        if row["timestep_fraction"] <= limit * (1 + 1e-9):
            yield _drop_option(case, row, row["timestep_fraction"])


def finest_drop(case: Case, tradeoff: Tradeoff) -> Option:
    """The drop test with the smallest measured step, or a smaller one where damping is strong."""
    finest = min(tradeoff["drop_test"], key=lambda row: float(row["timestep_fraction"]))
    return _drop_option(case, finest, min(finest["timestep_fraction"], _drop_limit(case)))


def _drop_limit(case: Case) -> float:
    return largest_fraction(DROP_TEST, describe(case)["lowest_restitution"])


def _drop_option(case: Case, row: Mapping[str, float], fraction: float) -> Option:
    """A step of the drop test. The error has no chance in it: it is its own bound."""
    error = float(row["restitution_error"])
    known = Error(error, 0.0, error, error, abs(error), 0.0)
    process = {**BUILT_IN_FIDELITIES, **case.study.fidelities}[PROCESS_OF_DROP]
    return Option(process, known, row["relative_cost"], fraction)


def outside_of(
    here: Mapping[str, float], tradeoff: Tradeoff, fields: Sequence[str] | None = None
) -> Iterator[Outside]:
    """The numbers of a scene that are outside of the measured range.

    The range spans the measured scene and those in which a prediction was
    checked and met, and `WIDENING` beyond. The stiffness number must not be
    below, nor the inertial number above, what any setting was measured at.
    """
    scenes = [tradeoff["scene"]]
    scenes += [check["scene"] for check in tradeoff["checks"] if check.get("met") is True]
    for name in RANGE_LABELS if fields is None else fields:
        values = [scene.get(name, 0.0) for scene in scenes]
        low, high = (1 - WIDENING) * min(values), (1 + WIDENING) * max(values)
        value = here.get(name, 0.0)  # an absent coefficient
        if not low <= value <= high:
            yield Outside(RANGE_LABELS[name], value, low, high)
    if fields is None:
        yield from _outside_numbers(here, tradeoff)


def _outside_numbers(here: Mapping[str, float], tradeoff: Tradeoff) -> Iterator[Outside]:
    """Where neither full modulus nor the study's own speed reaches the measured numbers."""
    there = tradeoff["scene"]
    scales = [row["youngs_modulus_scale"] for row in tradeoff["settings"]]
    factors = [row["speed_factor"] for row in tradeoff["settings"]]
    stiff, inertia = there["stiffness_number"], there["inertial_number"]
    softest = min(scales, default=1.0) ** (2 / 3) * stiff
    fastest = max(factors, default=1.0) * inertia
    if here["stiffness_number"] < softest * (1 - SAME_NUMBER):
        yield Outside(
            "stiffness number at full modulus", here["stiffness_number"], softest, math.inf
        )
    if here["inertial_number"] > fastest * (1 + SAME_NUMBER):
        yield Outside("inertial number at the study's speed", here["inertial_number"], 0.0, fastest)


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
    """Why the reference: nothing cheaper holds the tolerance; and what is known of it."""
    best = min((option.error.limit for option in options if option.error), default=None)
    smallest = "" if best is None else f"; the smallest bound is {percent(best)}"
    text = (
        f"no measured setting is known to err by less than {percent(held_to)}{smallest}: "
        f"the reference settings are taken ({reference})"
    )
    quantity = tradeoff["quantities"].get(asked.quantity)
    if asked.quantity == "restitution" or not quantity["reference"]:
        return text
    known = percent(quantity["se"])
    return f"{text}; the reference itself is known only to a standard error of {known}"


def _spread(study: Study, asked: Tolerance, tradeoff: Tradeoff) -> Spread | None:
    """Chance in one run's value, from the spread of measured runs; falls with the root of path."""
    quantity = tradeoff["quantities"][asked.quantity]
    if quantity.get("run_std") is None:
        return None
    counted = path_length(study.motion) - study.motion.transient_m
    if counted <= 0:
        return None
    alone = NORMAL_95 * quantity["run_std"]
    half_width = alone * math.sqrt(quantity["arc_m"] / counted)
    return Spread(half_width, counted, quantity["arc_m"] * (alone / asked.tolerance) ** 2)


def percent(fraction: float) -> str:
    """A share without its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * abs(fraction):.2g}'):g} %"


def signed(fraction: float) -> str:
    """A share with its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * fraction:.2g}'):+g} %"

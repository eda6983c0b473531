"""From an asked tolerance to settings: what is cheapest of all that was measured to hold it.

Pure arithmetic on ``data/trade.json``, the measured trade of speed against
accuracy (docs/trade.md), and on a study. Nothing here runs an engine.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from typing import Any

from dragdeck.cases import Case
from dragdeck.errors import InputError
from dragdeck.motion import path_length
from dragdeck.scenes.numbers import describe
from dragdeck.similarity import SAME_NUMBER, carried_scale, carried_speed, softest_scale
from dragdeck.stability import largest_share
from dragdeck.study import BUILT_IN_FIDELITIES, Fidelity, Study, Tolerance

TRADE_FILE = "trade.json"
TRADE_SCHEMA = 1

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
    "tool_to_ball": "tool over ball diameter",
    "depth_to_ball": "depth over ball diameter",
    "bowl_to_ball": "bowl over ball diameter",
    "ball_friction": "friction of ball on ball",
    "tool_friction": "friction of ball on tool",
    "lowest_restitution": "lowest restitution",
}
"""The numbers of a scene that must lie within the measured range."""

Trade = Mapping[str, Any]


@dataclass(frozen=True)
class Error:
    """A measured error relative to the reference settings, dimensionless.

    Attributes
    ----------
    error, standard_error : float
    low, high : float
        95 % interval.
    bound : float
        The absolute error is below it with 95 % confidence.
    alone : float
        The largest absolute error of one of the knobs, turned alone.
    """

    error: float
    standard_error: float
    low: float
    high: float
    bound: float
    alone: float

    @property
    def limit(self) -> float:
        """What a tolerance is compared with: knobs must not hold it by cancelling each other."""
        return max(self.bound, self.alone)

    def __str__(self) -> str:
        return f"{signed(self.error)} ({signed(self.low)} to {signed(self.high)})"


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

    def as_json(self) -> dict[str, Any]:
        """What ``case.json`` keeps of it."""
        error = self.chosen.error
        return {
            "tolerance": self.asked.tolerance,
            "quantity": self.asked.quantity,
            "label": self.label,
            "held_to": self.held_to,
            "error": error.error if error else None,
            "low": error.low if error else None,
            "high": error.high if error else None,
            "bound": error.bound if error else None,
            "relative_cost": self.chosen.relative_cost,
            "half_width": self.spread.half_width if self.spread else None,
            "outside": [str(number) for number in self.outside],
            "fallback": self.fallback,
            "source": self.source,
        }


@lru_cache(maxsize=1)
def measured_trade() -> dict[str, Any]:
    """The measured trade: ``data/trade.json`` of this package.

    Raises
    ------
    InputError
        It has not been measured, or another version of dragdeck wrote it.
    """
    file = resources.files("dragdeck").joinpath("data").joinpath(TRADE_FILE)
    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade, `snakemake trade --config "
        "study=uhlmann2015 plan=long`, and copy its trade.json to workflow/dragdeck/data/"
    )
    if not file.is_file():
        raise InputError(
            "no trade of speed against accuracy was measured, so no tolerance can be resolved",
            file=f"dragdeck/data/{TRADE_FILE}",
            remedy=remedy,
        )
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if found.get("schema") != TRADE_SCHEMA:
        raise InputError(
            "a trade of another schema",
            file=f"dragdeck/data/{TRADE_FILE}",
            field="schema",
            value=found.get("schema"),
            limit=str(TRADE_SCHEMA),
            remedy=remedy,
        )
    return found


def trade_if_measured() -> Trade:
    """`measured_trade`, or nothing where it cannot be read: for what is only told, not chosen."""
    try:
        return measured_trade()
    except InputError:
        return {}


def resolve(case: Case, asked: Tolerance, trade: Trade | None = None) -> Case:
    """The case with the settings that a tolerance asks for; it remembers the question.

    Parameters
    ----------
    case : Case
    asked : Tolerance
    trade : mapping, optional
        Instead of `measured_trade`.

    Raises
    ------
    InputError
        Nothing was measured, or not this quantity.
    """
    advice = advise(case, asked, trade)
    return replace(
        case,
        study=with_option(case.study, advice.chosen),
        asked=asked,
        advised=advice.as_json(),
    )


def with_option(study: Study, option: Option) -> Study:
    """A study with the settings of an option."""
    if option.drop_timestep_fraction is None:
        return study.model_copy(update={"fidelity": option.fidelity})
    drop = study.drop.model_copy(update={"timestep_fraction": option.drop_timestep_fraction})
    return study.model_copy(update={"fidelity": PROCESS_OF_DROP, "drop": drop})


def advise(case: Case, asked: Tolerance, trade: Trade | None = None) -> Advice:
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
        Instead of `measured_trade`.

    Raises
    ------
    InputError
        Nothing was measured, or not this quantity.
    """
    trade = measured_trade() if trade is None else trade
    drop = asked.quantity == "restitution"
    here = describe(case)
    _check_quantity(case, asked, trade)
    options = list(drop_options(case, trade) if drop else process_options(case, trade, asked))
    reference = finest_drop(case, trade) if drop else process_reference(case, trade)
    outside = list(outside_of(here, trade, ("lowest_restitution",) if drop else None))
    held_to = asked.tolerance * (OUTSIDE_FACTOR if outside else 1.0)
    holding = [option for option in options if option.error and option.error.limit <= held_to]
    chosen = min(holding, key=_cost_then_bound, default=reference)
    cheaper, dearer = _neighbours(options, chosen, reference)
    return Advice(
        asked=asked,
        held_to=held_to,
        label="restitution" if drop else trade["quantities"][asked.quantity]["label"],
        chosen=chosen,
        cheaper=cheaper,
        dearer=dearer,
        reference=reference,
        outside=outside,
        fallback=None if holding else _fallback(asked, held_to, options, reference, trade),
        spread=None if drop else _spread(case.study, asked, trade),
        source=f"measured {trade['measured']} on {trade['study']}, plan {trade['plan']}",
    )


def _check_quantity(case: Case, asked: Tolerance, trade: Trade) -> None:
    """Refuse a tolerance about something that was not measured."""
    known = ["restitution"] if trade["drop"] else []
    known += [name for name in trade["quantities"] if name not in known]
    if asked.quantity not in known:
        raise InputError(
            "no error of this quantity was measured",
            file=case.file,
            field="fidelity.quantity",
            value=asked.quantity,
            limit=f"one of: {', '.join(known)}",
            remedy="ask for one of these",
        )


def process_options(case: Case, trade: Trade, asked: Tolerance) -> Iterator[Option]:
    """Every measured setting that may be used, carried to the case's scene.

    Left out are settings whose step breaks, that too few runs stand
    behind, whose error was not measured, whose step is beyond the stability
    limit of the measured scene, or that cost as much as the reference.
    """
    here, there = describe(case), trade["scene"]
    limit = largest_share("process", there["lowest_restitution"])
    for row in trade["settings"]:
        entry = row["errors"].get(asked.quantity)
        sound = row["failed"] == 0 and not row["breaks"]
        stable = sound and row["timestep_fraction"] <= limit * (1 + 1e-9)
        if entry is None or not stable or row["runs"] < FEWEST_RUNS:
            continue
        option = _carried(case.study, row, entry, here, there)
        if option.relative_cost < 1 and not _is_reference(option, trade):
            yield option


def breaking_note(case: Case, trade: Trade | None = None) -> list[tuple[str, str]]:
    """What ``check`` and ``explain`` say of the step at which soft balls were seen to break.

    Soft balls break at shorter steps, as shares of the Rayleigh time: the next
    softer level that was measured counts. Nothing is said where nothing was
    measured.
    """
    trade = trade_if_measured() if trade is None else trade
    chosen = case.study.chosen_fidelity()
    limit = chosen.youngs_modulus_scale * (1 + 1e-9)
    broken = [
        row for row in trade.get("settings", ()) if row["breaks"] and row["speed_factor"] == 1
    ]
    softer = [row for row in broken if row["youngs_modulus_scale"] <= limit]
    if not softer:
        return []
    level = max(row["youngs_modulus_scale"] for row in softer)
    share = min(r["timestep_fraction"] for r in softer if r["youngs_modulus_scale"] == level)
    verdict = "below" if chosen.timestep_fraction < share else "NOT BELOW"
    text = (
        f"{100 * chosen.timestep_fraction:.3g} % is {verdict} {100 * share:.3g} %, where the drag "
        f"was wrong or a run failed with E x {level:g} ({trade['study']}, {trade['measured']})"
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
    scale, share, factor = (
        row[name] for name in ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
    )
    stiffer = here["stiffness_number"] / there["stiffness_number"]
    slower = there["inertial_number"] / here["inertial_number"]
    fidelity = Fidelity(
        youngs_modulus_scale=max(carried_scale(scale, stiffer), softest_scale(study)),
        timestep_fraction=min(share, largest_share("process", here["lowest_restitution"])),
        fill_timestep_fraction=_fill_share(here),
        speed_factor=carried_speed(factor, slower),
    )
    steps = math.sqrt(fidelity.youngs_modulus_scale / scale)
    steps *= share / fidelity.timestep_fraction * factor / fidelity.speed_factor
    error = Error(*(float(entry[name]) for name in Error.__dataclass_fields__))
    return Option(fidelity, error, row["relative_cost"] * steps)


def _fill_share(here: Mapping[str, float]) -> float:
    """Step of the fill over the Rayleigh time: the usual one, less where damping is strong."""
    usual = float(Fidelity().fill_timestep_fraction)
    return min(usual, largest_share("fill", here["lowest_restitution"]))


def process_reference(case: Case, trade: Trade) -> Option:
    """The settings that errors are measured against."""
    fill = _fill_share(describe(case))
    return Option(Fidelity(**trade["reference"], fill_timestep_fraction=fill), None, 1.0)


def _is_reference(option: Option, trade: Trade) -> bool:
    return option.same_settings(Fidelity(**trade["reference"]))


def drop_options(case: Case, trade: Trade) -> Iterator[Option]:
    """Every measured step of the drop test that is within the stability limit."""
    limit = _drop_limit(case)
    for row in trade["drop"]:
        if row["timestep_fraction"] <= limit * (1 + 1e-9):
            yield _drop_option(case, row, row["timestep_fraction"])


def finest_drop(case: Case, trade: Trade) -> Option:
    """The drop test with the smallest measured step, or a smaller one where damping is strong."""
    finest = min(trade["drop"], key=lambda row: float(row["timestep_fraction"]))
    return _drop_option(case, finest, min(finest["timestep_fraction"], _drop_limit(case)))


def _drop_limit(case: Case) -> float:
    return largest_share("drop", describe(case)["lowest_restitution"])


def _drop_option(case: Case, row: Mapping[str, float], share: float) -> Option:
    """A step of the drop test. The error has no chance in it: it is its own bound."""
    error = float(row["restitution_error"])
    known = Error(error, 0.0, error, error, abs(error), 0.0)
    process = {**BUILT_IN_FIDELITIES, **case.study.fidelities}[PROCESS_OF_DROP]
    return Option(process, known, row["relative_cost"], share)


def outside_of(
    here: Mapping[str, float], trade: Trade, fields: Sequence[str] | None = None
) -> Iterator[Outside]:
    """The numbers of a scene that are outside of the measured range.

    The range spans the measured scene and those in which a prediction was
    checked and met, and `WIDENING` beyond. The stiffness number must not be
    below, nor the inertial number above, what any setting was measured at.
    """
    scenes = [trade["scene"]]
    scenes += [check["scene"] for check in trade["checks"] if check.get("met") is True]
    for name in RANGE_LABELS if fields is None else fields:
        values = [scene[name] for scene in scenes]
        low, high = (1 - WIDENING) * min(values), (1 + WIDENING) * max(values)
        if not low <= here[name] <= high:
            yield Outside(RANGE_LABELS[name], here[name], low, high)
    if fields is None:
        yield from _outside_numbers(here, trade)


def _outside_numbers(here: Mapping[str, float], trade: Trade) -> Iterator[Outside]:
    """Where neither full modulus nor the study's own speed reaches the measured numbers."""
    there = trade["scene"]
    scales = [row["youngs_modulus_scale"] for row in trade["settings"]]
    factors = [row["speed_factor"] for row in trade["settings"]]
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
    asked: Tolerance, held_to: float, options: Sequence[Option], reference: Option, trade: Trade
) -> str:
    """Why the reference: nothing cheaper holds the tolerance; and what is known of it."""
    best = min((option.error.limit for option in options if option.error), default=None)
    smallest = "" if best is None else f"; the smallest bound is {percent(best)}"
    text = (
        f"no measured setting is known to err by less than {percent(held_to)}{smallest}: "
        f"the reference settings are taken ({reference})"
    )
    quantity = trade["quantities"].get(asked.quantity)
    if asked.quantity == "restitution" or not quantity["reference"]:
        return text
    known = percent(quantity["standard_error"])
    return f"{text}; the reference itself is known only to a standard error of {known}"


def _spread(study: Study, asked: Tolerance, trade: Trade) -> Spread | None:
    """Chance in one run's value, from the spread of measured runs; falls with the root of path."""
    quantity = trade["quantities"][asked.quantity]
    if quantity.get("run_sd") is None:
        return None
    counted = path_length(study.motion) - study.motion.run_in_m
    if counted <= 0:
        return None
    alone = NORMAL_95 * quantity["run_sd"]
    half_width = alone * math.sqrt(quantity["arc_m"] / counted)
    return Spread(half_width, counted, quantity["arc_m"] * (alone / asked.tolerance) ** 2)


def percent(share: float) -> str:
    """A share without its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * abs(share):.2g}'):g} %"


def signed(share: float) -> str:
    """A share with its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * share:.2g}'):+g} %"

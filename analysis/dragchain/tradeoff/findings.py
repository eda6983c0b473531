"""What a trade says: choices, the effect of softness, gains, path lengths, drops and costs.

Numbers only; `tradeoff_words`, `tradeoff_choices` and `tradeoff_rows` put them into words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import JsonValue
from scipy import stats

from dragchain.arrays import Floats
from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.run.case import changed_inputs, load_case
from dragchain.run.completeness import RunRecord
from dragchain.tables.by_step import read_table
from dragchain.tradeoff.compare import (
    CONFIDENCE,
    OTHER,
    Comparison,
    Error,
    Run,
    Setting,
    StepCosts,
    Tradeoff,
    candidates,
    compare_quantity,
    largest_bound,
    recommend,
)
from dragchain.tradeoff.measures import FORCE_BINS, QUANTITIES, Quantity

RUINED = 0.1
"""A resolved error above this ruins a quantity; a bound below it keeps it."""

MAIN = (
    *("drag_mean", "drag_std", "workpiece_contacts", "contact_force_mean", "contact_force_p90"),
    *("coordination_number", "chain_count", "chain_length"),
)

TOGETHER = ("contact_force_mean", "contact_force_p90")
"""What the distribution of contact forces is judged by."""

PLAIN = ("plain_full", "plain")
"""Names of the cost of the plain deck, that at full stiffness first."""


def differing(setting: Setting, base: Setting) -> list[str]:
    """The factors in which two settings differ."""
    own, other = setting.factors(), base.factors()
    return [name for name in own if own[name] != other[name]]


def hub(tradeoff: Tradeoff) -> Setting:
    """The setting that most others differ from in one parameter only: the base of the plan."""
    settings = [one for one in tradeoff.settings() if not one.other]

    def neighbours(setting: Setting) -> tuple[int, int]:
        near = sum(len(differing(other, setting)) == 1 for other in settings)
        return near, len(tradeoff.of(setting))

    return max(settings, key=neighbours)


@dataclass(frozen=True)
class SpeedUp:
    """Processor time of one setting over another's.

    Attributes
    ----------
    ratio : float
    low, high : float
        Limits of the interval of `CONFIDENCE` from the scatter between runs;
        NaN where either has a single run, or where steps were timed side by side.
    """

    ratio: float
    ci95_low: float
    ci95_high: float


def speed_up(tradeoff: Tradeoff, setting: Setting, base: Setting) -> SpeedUp:
    """How many times cheaper a metre of path is; the medians of the runs, as `Trade.cost`."""
    ratio = tradeoff.cost(base) / tradeoff.cost(setting)
    logs = [np.log([run.cpu_per_m for run in tradeoff.of(one)]) for one in (setting, base)]
    if min(map(len, logs)) < 2 or tradeoff.step_costs is not None:
        return SpeedUp(ratio, math.nan, math.nan)
    error = math.hypot(*(float(stats.sem(values)) for values in logs))
    shift = error * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, sum(map(len, logs)) - 2)
    return SpeedUp(ratio, ratio * math.exp(-shift), ratio * math.exp(shift))


# --- what to choose ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Choice:
    """What to run for some quantities and a tolerance.

    Attributes
    ----------
    tolerance : float
    setting : Setting or None
        The cheapest that is certified.
    nearest : Setting or None
        That of the smallest bound; None if there is no candidate at all.
    bound : float
        Of `setting`, or else of `nearest`.
    errors : list of Error
        Of the same one, a quantity each.
    """

    tolerance: float
    setting: Setting | None
    nearest: Setting | None
    bound: float
    errors: list[Error]


def choose(tradeoff: Tradeoff, names: Sequence[str], tolerance: float) -> Choice:
    """What to run so that each of some quantities is within a tolerance."""
    setting = recommend(tradeoff, names, tolerance)
    able = candidates(tradeoff, names)
    nearest = min(able, key=lambda one: largest_bound(tradeoff, names, one), default=None)
    shown = setting or nearest
    if shown is None:
        return Choice(tolerance, None, None, math.nan, [])
    errors = [tradeoff.comparisons[name].errors[shown] for name in names]
    return Choice(tolerance, setting, nearest, largest_bound(tradeoff, names, shown), errors)


# --- softness ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Softness:
    """What a modulus does to a quantity.

    Attributes
    ----------
    level : float
        The modulus scale.
    error : Error
    mixed : str
        What else changed because the runs cannot tell it apart; "" if nothing.
    """

    level: float
    error: Error
    mixed: str

    @property
    def verdict(self) -> str:
        """``ruined``, ``kept`` or ``open``."""
        if self.error.significant and abs(self.error.value) > RUINED:
            return "ruined"
        return "kept" if self.error.bound <= RUINED else "open"


def modulus_levels(tradeoff: Tradeoff) -> list[float]:
    """Modulus scales other than the reference's, the stiffest first."""
    own = {setting.youngs_modulus_scale for setting in tradeoff.settings()}
    return sorted(own - {tradeoff.reference.youngs_modulus_scale}, reverse=True)


def softness(tradeoff: Tradeoff, comparison: Comparison, level: float) -> Softness | None:
    """The effect of a modulus by itself, or with as little else as was run.

    None if no complete run at that modulus has the quantity.
    """
    stiff = tradeoff.reference.youngs_modulus_scale
    for base in (tradeoff.reference, hub(tradeoff)):
        error = comparison.between(
            replace(base, youngs_modulus_scale=level), replace(base, youngs_modulus_scale=stiff)
        )
        if error is not None:
            return Softness(level, error, "")
    own = [one for one in comparison.errors if one.youngs_modulus_scale == level and not one.other]
    if not own:
        return None
    nearest = min(
        own,
        key=lambda one: (
            len(differing(one, tradeoff.reference)),
            len(differing(one, hub(tradeoff))),
            -len(tradeoff.of(one)),
        ),
    )
    return Softness(level, comparison.errors[nearest], str(nearest))


# --- parameters
# ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Gain:
    """One setting against another that differs from it.

    Attributes
    ----------
    setting, base : Setting
    factors : list of str
        In which they differ.
    speed_up : SpeedUp
    errors : dict of str to Error
        Main quantity to what the change does to it.
    product : float
        Of the gains of the single changes; NaN for a single one, or where one was not run.
    """

    setting: Setting
    base: Setting
    factors: list[str]
    speed_up: SpeedUp
    errors: Mapping[str, Error]
    product: float


def gains(tradeoff: Tradeoff) -> list[Gain]:
    """Every change of the reference and of the hub whose single changes were all run.

    The hub against the reference is among them in any case, and whatever is no parameter
    against the same setting without it.
    """
    centre = hub(tradeoff)
    found: list[Gain] = []
    for base in dict.fromkeys((tradeoff.reference, centre)):
        for setting in tradeoff.settings():
            factors = differing(setting, base)
            singles = [replace(base, **{name: getattr(setting, name)}) for name in factors]
            told = setting == centre or all(map(tradeoff.of, singles))
            if factors and setting != tradeoff.reference and told:
                found.append(_gain(tradeoff, setting, base, factors, singles))
    for setting in tradeoff.settings():
        base = replace(setting, other="")
        if setting.other and base not in (tradeoff.reference, centre) and tradeoff.of(base):
            found.append(_gain(tradeoff, setting, base, [OTHER], [setting]))
    names = list(tradeoff.reference.factors())
    return sorted(found, key=lambda gain: [names.index(name) for name in gain.factors])


def _gain(
    tradeoff: Tradeoff,
    setting: Setting,
    base: Setting,
    factors: list[str],
    singles: Sequence[Setting],
) -> Gain:
    errors = {
        name: error
        for name in MAIN
        if name in tradeoff.comparisons
        and (error := tradeoff.comparisons[name].between(setting, base)) is not None
    }
    product = math.nan
    if len(factors) > 1 and all(map(tradeoff.of, singles)):
        product = math.prod(speed_up(tradeoff, one, base).ratio for one in singles)
    return Gain(setting, base, factors, speed_up(tradeoff, setting, base), errors, product)


# --- distribution of contact forces --------------------------------------------------------------


def exceedance(counts: Sequence[int]) -> tuple[Floats, Floats, float]:
    """Share of contacts with a force above each bin's lower edge.

    Parameters
    ----------
    counts : (70,) array_like
        Contacts between `FORCE_BINS`.

    Returns
    -------
    force : (70,) ndarray
        Lower edges, N.
    share : (70,) ndarray
    mean : float
        Mean force, N, each contact at the geometric middle of its bin.
    """
    number = np.asarray(counts, dtype=np.float64)
    fraction = np.cumsum(number[::-1])[::-1] / number.sum()
    middle = np.sqrt(FORCE_BINS[:-1] * FORCE_BINS[1:])
    return FORCE_BINS[:-1], fraction, float(number @ middle / number.sum())


def force_runs(tradeoff: Tradeoff) -> dict[float, list[Run]]:
    """Runs whose contact forces are shown, for each modulus: all else as alike as was run."""
    found: dict[float, list[Run]] = {}
    levels = [tradeoff.reference.youngs_modulus_scale, *modulus_levels(tradeoff)]
    for level in levels:
        own = [
            setting
            for setting in tradeoff.settings()
            if setting.youngs_modulus_scale == level
            and not setting.other
            and any(map(_has_histogram, tradeoff.of(setting)))
        ]
        if own:
            centre = replace(hub(tradeoff), youngs_modulus_scale=level)
            chosen = min(own, key=lambda one: len(differing(one, centre)))
            found[level] = [run for run in tradeoff.of(chosen) if _has_histogram(run)]
    return found


def _has_histogram(run: Run) -> bool:
    return run.complete and sum(run.measures.get("force_histogram", [])) > 0


# --- path ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reach:
    """How well a run of some path knows a quantity.

    Attributes
    ----------
    quantity : Quantity
    halfwidth : float
        Relative half-width of the 95 % interval of one run over the common path.
    arc_m : float
        That path, m.
    block_m : float
        Length of a block: nothing is known of shorter paths, m.
    """

    quantity: Quantity
    halfwidth: float
    arc_m: float
    block_m: float

    def at(self, path_m: float) -> float:
        """The half-width at another path; it falls with its root."""
        return self.halfwidth * math.sqrt(self.arc_m / path_m)

    def path_m(self, tolerance: float) -> float:
        """The path at which one run knows the quantity within a tolerance, m."""
        return float(self.arc_m * (self.halfwidth / tolerance) ** 2)

    def seeds(self, tolerance: float) -> int:
        """Runs over the common path, each on its own bed, that know it as well together."""
        return max(1, math.ceil((self.halfwidth / tolerance) ** 2))


def reaches(tradeoff: Tradeoff) -> list[Reach]:
    """How well runs know the quantities that have blocks along the path."""
    score = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE))
    along_path = {name for run in tradeoff.runs for name in run.measures.get("blocks", {})}
    block_m = float(np.median([run.measures["block_m"] for run in tradeoff.runs if run.complete]))
    return [
        Reach(
            quantity, score * tradeoff.comparisons[quantity.name].run_std, tradeoff.arc_m, block_m
        )
        for quantity in QUANTITIES
        if quantity.name in tradeoff.comparisons and quantity.name in along_path
    ]


# --- how often intervals hold what they should ----------------------------------------------------

TRIALS = 200


def coverage(tradeoff: Tradeoff, name: str, trials: int = TRIALS) -> float | None:
    """How often an interval of this plan holds the truth, from simulated runs.

    Runs at the same settings and beds get values without any effect, with the
    scatter and the bed's share of a quantity, and are compared just as the
    measured ones: the share is estimated and additivity tested anew each time.

    Parameters
    ----------
    trade : Trade
    name : str
        The quantity.
    trials : int

    Returns
    -------
    float or None
        Over all settings; None if none was compared with the reference.
    """
    own = tradeoff.comparisons.get(name)
    if own is None or set(own.errors) == {tradeoff.reference}:
        return None
    runs = [run for run in tradeoff.runs if name in run.values]
    stretches = [sum(name in one for one in run.stretches) for run in runs]
    beds = list(dict.fromkeys(run.bed for run in runs))
    number = np.repeat([beds.index(run.bed) for run in runs], stretches)
    rng = np.random.default_rng(0)
    held: list[bool] = []
    for _ in range(trials):
        scatter = math.sqrt(own.bed_fraction) * rng.standard_normal(len(beds))[number]
        scatter += math.sqrt(1.0 - own.bed_fraction) * rng.standard_normal(len(number))
        values = iter(np.exp(own.run_std * scatter).tolist())
        again = []
        for run, count in zip(runs, stretches, strict=True):
            first, *further = ({name: next(values)} for _ in range(count))
            again.append(replace(run, values=first, further=further))
        errors = compare_quantity(
            replace(own.quantity, signed=False), again, tradeoff.reference
        ).errors
        held += [
            not error.significant for one, error in errors.items() if one != tradeoff.reference
        ]
    return float(np.mean(held))


# --- drop ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drop:
    """A drop test against the one with the finest step.

    Attributes
    ----------
    timestep_fraction : float
    other : str
        What else it changes; "" if nothing.
    restitution : float
        Mean of its impacts.
    error : float
        Relative, of the mean.
    bound : float
        The largest of any impact, relative; each impact against the same one of the reference.
    relative_cost : float
        Its processor time over the reference's.
    """

    timestep_fraction: float
    other: str
    restitution: float
    error: float
    bound: float
    relative_cost: float


def read_drops(folders: Sequence[Path]) -> list[Drop]:
    """Drop tests, the finest step first.

    Parameters
    ----------
    folders : sequence of Path
        Complete runs of the drop with their tables.

    Raises
    ------
    TableError
        If a folder holds another scene, or a run is not complete or has no table.
    """
    rows = sorted((_read_drop(folder) for folder in folders), key=lambda row: row["fraction"])
    if not rows:
        return []
    first = rows[0]
    return [
        Drop(
            timestep_fraction=row["fraction"],
            other=_difference(row["inputs"], first["inputs"]),
            restitution=float(row["ratios"].mean()),
            error=float(row["ratios"].mean() / first["ratios"].mean() - 1.0),
            bound=_worst_impact(row["ratios"], first["ratios"]),
            relative_cost=row["cost"] / first["cost"],
        )
        for row in rows
    ]


def _read_drop(folder: Path) -> dict[str, Any]:
    case = load_case(folder)
    if case.scene != "drop_test":
        raise TableError(f"{folder}: this is a {case.scene}, not a drop")
    impacts = read_table(folder / "tables" / "impacts.parquet", ["restitution"])
    record = RunRecord.read(folder / "run.json")
    if not record.complete:
        raise TableError(f"{folder}: its state is {record.state!r}, not 'complete'")
    fraction = case.timestep_s / case.rayleigh_time_s
    return {
        "fraction": float(f"{fraction:.4g}"),
        "inputs": {
            name: value
            for name, value in case.inputs.items()
            if name not in ("seed", "drop_test.timestep_fraction")
        },
        "ratios": impacts["restitution"].to_numpy(),
        "cost": record.processor_time_s,
    }


def _difference(own: Mapping[str, JsonValue], standard: Mapping[str, JsonValue]) -> str:
    return ", ".join(f"{name} {value}" for name, value in changed_inputs(own, standard).items())


def _worst_impact(ratios: Floats, reference: Floats) -> float:
    common = min(len(ratios), len(reference))
    return float(np.abs(ratios[:common] / reference[:common] - 1.0).max())


def choose_drop(drops: Sequence[Drop], tolerance: float) -> Drop | None:
    """The cheapest drop that changes only its step and is within a tolerance at every impact."""
    able = [
        drop
        for drop in drops[1:]
        if not drop.other and drop.bound <= tolerance and drop.relative_cost < 1.0
    ]
    return min(able, key=lambda drop: drop.relative_cost, default=None)


# --- costs ---------------------------------------------------------------------------------------


class CostEntry(Part):
    """Processor time with one thing changed over that without, as timed side by side.

    ``ratio`` counts what ``unit`` says. ``parameter`` and ``level`` are those of a variant
    that changes one setting of the fidelity alone.
    """

    name: str
    scene: str
    what: str
    against: str | None = None
    unit: Literal["per_step", "per_second"] = "per_second"
    parameter: str | None = None
    level: float | None = None
    ratio: float
    ci95_low: float | None
    ci95_high: float | None
    per_step: float | None = None
    per_second: float | None = None
    wall_ratio: float | None = None
    rounds: int | None = None
    steps: int | None = None
    timestep_s: float | None = None


class StandardFidelity(Part):
    """Settings of the deck that the process entries were compared with."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float = 1.0


class CostsFile(Document):
    """What is read of ``costs.json``."""

    made_by = "dragdeck step costs"

    fidelity: StandardFidelity | None = None
    costs: tuple[CostEntry, ...]


@dataclass(frozen=True)
class Costs:
    """What things that a deck leaves out would cost.

    Attributes
    ----------
    entries : sequence of CostEntry
    standard : Setting or None
        Setting of the deck that the process entries were compared with, if the file says so.
    """

    entries: Sequence[CostEntry] = ()
    standard: Setting | None = None

    @property
    def plain_entry(self) -> CostEntry | None:
        """The cost of the plain deck, at full stiffness if that was timed."""
        by_name = {entry.name: entry for entry in self.entries}
        return next((by_name[name] for name in PLAIN if name in by_name), None)

    def plain(self, tradeoff: Tradeoff, setting: Setting) -> float:
        """How many times a setting is cheaper than the plain deck; NaN if that is not known.

        The plain deck was compared with the standard deck, and that with the
        setting. A file that does not name the standard's setting is taken to
        mean the `hub`.
        """
        entry = self.plain_entry
        standard = self.standard or hub(tradeoff)
        if entry is None or not tradeoff.of(standard):
            return math.nan
        return entry.ratio * tradeoff.cost(standard) / tradeoff.cost(setting)


def step_costs(costs: Costs) -> StepCosts | None:
    """What a step costs at other moduli, steps and speeds; None if that was not timed."""
    if costs.standard is None:
        return None
    levels: dict[str, dict[float, float]] = {}
    for entry in costs.entries:
        if entry.parameter and entry.level is not None and entry.per_step is not None:
            base = {float(getattr(costs.standard, entry.parameter)): 1.0}
            levels.setdefault(entry.parameter, base)[entry.level] = entry.per_step
    return StepCosts(levels) if levels else None


def read_costs(file: Path | None) -> Costs:
    """Read ``costs.json``; nothing without a file.

    Raises
    ------
    DocumentError
        It is not that document, or an entry lacks a key.
    """
    if file is None:
        return Costs()
    content = CostsFile.read(file)
    standard = content.fidelity and Setting(**content.fidelity.model_dump())
    return Costs(content.costs, standard)

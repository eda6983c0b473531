"""What a change of a fidelity parameter does: softness by itself, and gains in cost."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy import stats

from dragchain.statistics.estimate import Estimate, finite, student_quantile
from dragchain.tradeoff.compare import OTHER, Error, QuantityComparison, Setting
from dragchain.tradeoff.measures import MAIN
from dragchain.tradeoff.outcome import StepCosts, Tradeoff
from dragdeck.records.tradeoff import CostEntry, CostsFile

RUINED = 0.1
"""A significant error above this ruins a quantity; a bound below it keeps it."""


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


def speed_up(tradeoff: Tradeoff, setting: Setting, base: Setting) -> Estimate:
    """How many times cheaper a metre of path is; the medians of the runs, as `Tradeoff.cost`.

    The interval comes from the scatter between runs; it is NaN where either has a single run, or
    where steps were timed side by side.
    """
    ratio = tradeoff.cost(base) / tradeoff.cost(setting)
    logs = [
        np.log([run.measures.cost.cpu_per_m for run in tradeoff.of(one)]) for one in (setting, base)
    ]
    if min(map(len, logs)) < 2 or tradeoff.step_costs is not None:
        return Estimate(ratio, math.nan, math.nan)
    error = math.hypot(*(float(stats.sem(values)) for values in logs))
    shift = error * student_quantile(sum(map(len, logs)) - 2)
    return Estimate(ratio, ratio * math.exp(-shift), ratio * math.exp(shift))


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
    def effect(self) -> Literal["ruined", "kept", "open"]:
        """``ruined``, ``kept`` or ``open``."""
        if self.error.significant and abs(self.error.value) > RUINED:
            return "ruined"
        return "kept" if self.error.bound <= RUINED else "open"


def modulus_levels(tradeoff: Tradeoff) -> list[float]:
    """Modulus scales other than the reference's, the stiffest first."""
    own = {setting.youngs_modulus_scale for setting in tradeoff.settings()}
    return sorted(own - {tradeoff.reference.youngs_modulus_scale}, reverse=True)


def softness(tradeoff: Tradeoff, comparison: QuantityComparison, level: float) -> Softness | None:
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


def softness_by_level(tradeoff: Tradeoff) -> dict[float, dict[str, Softness | None]]:
    """The `softness` of each quantity, by its name, for each modulus."""
    return {
        level: {name: softness(tradeoff, own, level) for name, own in tradeoff.comparisons.items()}
        for level in modulus_levels(tradeoff)
    }


@dataclass(frozen=True)
class Gain:
    """One setting against another that differs from it.

    Attributes
    ----------
    setting, base : Setting
    factors : list of str
        In which they differ.
    speed_up : Estimate
    errors : dict of str to Error
        Main quantity to what the change does to it.
    product : float
        Of the gains of the single changes; NaN for a single one, or where one was not run.
    """

    setting: Setting
    base: Setting
    factors: list[str]
    speed_up: Estimate
    errors: Mapping[str, Error]
    product: float

    @property
    def single(self) -> bool:
        """Whether they differ in one factor alone."""
        return len(self.factors) == 1

    @property
    def over_product(self) -> float:
        """The speed-up over the product of those of the single changes."""
        return self.speed_up.value / self.product

    @property
    def levels(self) -> tuple[object, object]:
        """Of its first factor, in the base and in the setting."""
        name = self.factors[0]
        return getattr(self.base, name), getattr(self.setting, name)


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
        product = math.prod(speed_up(tradeoff, one, base).value for one in singles)
    return Gain(setting, base, factors, speed_up(tradeoff, setting, base), errors, product)


# --- what is left out ----------------------------------------------------------------------------


_PLAIN = ("plain_full", "plain")
"""Names of the cost of the plain deck, that at full stiffness first."""


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
        return next((by_name[name] for name in _PLAIN if name in by_name), None)

    def standard_in(self, tradeoff: Tradeoff) -> Setting:
        """The `standard`; a file that does not name it is taken to mean the `hub`."""
        return self.standard or hub(tradeoff)

    def plain(self, tradeoff: Tradeoff, setting: Setting) -> float | None:
        """How many times a setting is cheaper than the plain deck; None if that is not known.

        The plain deck was compared with the standard deck, and that with the setting.
        """
        entry, standard = self.plain_entry, self.standard_in(tradeoff)
        if entry is None or not tradeoff.of(standard):
            return None
        return finite(entry.ratio * tradeoff.cost(standard) / tradeoff.cost(setting))


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
    standard = Setting.of(content.fidelity) if content.fidelity else None
    return Costs(content.costs, standard)

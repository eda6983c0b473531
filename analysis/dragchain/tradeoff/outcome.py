"""The outcome of a plan: what settings cost, which may be used, and which to choose."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dragchain.errors import SeriesError
from dragchain.tradeoff.compare import Error, PlanRun, QuantityComparison, Setting, compare_quantity
from dragchain.tradeoff.measures import QUANTITIES

BROKEN = 0.1
"""A step is broken if it changes the mean drag by more than this, beyond doubt."""

TOLERANCES = (0.02, 0.05, 0.1, 0.2)


@dataclass(frozen=True)
class StepCosts:
    """Processor time of a step, as it was timed side by side, parameter by parameter.

    Attributes
    ----------
    levels : mapping of str to mapping of float to float
        Parameter, level and the time of a step over that at the base. Between
        levels the logarithm is interpolated over that of the level, beyond
        them the nearest counts; parameters multiply.
    """

    levels: Mapping[str, Mapping[float, float]]

    def of(self, setting: Setting) -> float:
        """Time of a step over that at the base."""
        logs = []
        for parameter, known in self.levels.items():
            points = sorted(known.items())
            at, ratios = np.log([level for level, _ in points]), np.log([r for _, r in points])
            logs.append(np.interp(math.log(getattr(setting, parameter)), at, ratios))
        return math.exp(sum(logs))


@dataclass(frozen=True)
class Tradeoff:
    """The outcome of a plan.

    Attributes
    ----------
    runs : list of PlanRun
        Complete and failed ones.
    reference : Setting
    arc_m : float
        The path that is compared, m.
    comparisons : dict of str to QuantityComparison
        Quantity to what the settings do to it.
    skipped : dict of str to str
        Quantities that could not be compared, and why.
    step_costs : StepCosts or None
        If steps were timed side by side; else costs are those of the runs.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.
    """

    runs: list[PlanRun]
    reference: Setting
    arc_m: float
    comparisons: Mapping[str, QuantityComparison]
    skipped: Mapping[str, str] = field(default_factory=dict)
    step_costs: StepCosts | None = None
    largest_step: float = math.inf

    def settings(self) -> list[Setting]:
        """Every setting once, that with the most steps first."""
        found = dict.fromkeys(run.setting for run in self.runs)
        return sorted(found, key=lambda setting: -self.median(setting, "steps_per_m"))

    def of(self, setting: Setting) -> list[PlanRun]:
        """The runs of a setting."""
        return [run for run in self.runs if run.setting == setting]

    def cost(self, setting: Setting) -> float:
        """Processor time for a metre of path over the reference's.

        The number of steps times what a step costs: as it was timed side by
        side, where it was and the setting changes nothing but the fidelity;
        else in the median of the runs, a failed one until it failed.
        """
        if self.step_costs is None or setting.other:
            return self.median(setting, "cpu_per_m") / self.median(self.reference, "cpu_per_m")
        steps = self.median(setting, "steps_per_m") / self.median(self.reference, "steps_per_m")
        return steps * self.step_costs.of(setting) / self.step_costs.of(self.reference)

    def median(self, setting: Setting, name: str) -> float:
        """The median of a cost over the runs of a setting that have it, NaN if none has."""
        values = np.array([getattr(run.measures.cost, name) for run in self.of(setting)])
        known = values[np.isfinite(values)]
        return float(np.median(known)) if known.size else math.nan


def compare_settings(
    runs: Sequence[PlanRun],
    reference: Setting,
    arc_m: float,
    step_costs: StepCosts | None = None,
    largest_step: float = math.inf,
) -> Tradeoff:
    """Every setting against the reference, in every quantity.

    A quantity that cannot be compared, because too few runs have it, is left
    out with the reason.
    """
    found: dict[str, QuantityComparison] = {}
    skipped: dict[str, str] = {}
    for quantity in QUANTITIES:
        try:
            found[quantity.name] = compare_quantity(quantity, runs, reference)
        except SeriesError as error:
            skipped[quantity.name] = str(error)
    return Tradeoff(list(runs), reference, arc_m, found, skipped, step_costs, largest_step)


def breaks(tradeoff: Tradeoff, setting: Setting) -> bool:
    """Whether a setting's time step is too long: it failed, or the drag is wrong because of it.

    The mean drag differs from that at the best known shorter step, all else
    alike, by more than `BROKEN`, and the difference is significant.
    """
    if not all(run.complete for run in tradeoff.of(setting)):
        return True
    comparison = tradeoff.comparisons.get("drag_mean")
    shorter = [
        one
        for one in tradeoff.settings()
        if one.timestep_fraction < setting.timestep_fraction
        and replace(one, timestep_fraction=setting.timestep_fraction) == setting
    ]
    if comparison is None or not shorter:
        return False
    best = max(shorter, key=lambda one: len(tradeoff.of(one)))
    change = comparison.between(setting, best)
    return change is not None and change.significant and abs(change.value) > BROKEN


def _candidates(tradeoff: Tradeoff, quantities: Sequence[str]) -> list[Setting]:
    """The settings that could be recommended instead of the reference.

    They change nothing but the fidelity, are cheaper, have a step that is known
    to be safe and does not break, more than one run, and an error in each of the
    quantities.
    """
    comparisons = [tradeoff.comparisons.get(name) for name in quantities]
    return [
        setting
        for setting in tradeoff.settings()
        if setting != tradeoff.reference
        and not setting.other
        and tradeoff.cost(setting) < 1.0
        and len(tradeoff.of(setting)) > 1
        and setting.timestep_fraction <= tradeoff.largest_step * (1 + 1e-9)
        and not breaks(tradeoff, setting)
        and all(own is not None and setting in own.errors for own in comparisons)
    ]


def largest_bound(tradeoff: Tradeoff, quantities: Sequence[str], setting: Setting) -> float:
    """The largest bound of a setting's errors, or error of one of its parameters."""
    comparisons = [tradeoff.comparisons[name] for name in quantities]
    return max(
        max(own.errors[setting].bound, own.alone(setting, tradeoff.reference))
        for own in comparisons
    )


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

    @property
    def within(self) -> bool:
        """Whether the errors, if not their bounds, are within the tolerance."""
        return all(abs(error.value) <= self.tolerance for error in self.errors)


def choose(tradeoff: Tradeoff, names: Sequence[str], tolerance: float) -> Choice:
    """The cheapest setting at which each of some quantities is within a tolerance.

    It is one of the `_candidates`, and its error is below the tolerance with confidence.
    """
    bounds = {one: largest_bound(tradeoff, names, one) for one in _candidates(tradeoff, names)}
    able = [one for one, bound in bounds.items() if bound <= tolerance]
    setting = min(able, key=tradeoff.cost, default=None)
    nearest = min(bounds, key=bounds.__getitem__, default=None)
    shown = setting or nearest
    if shown is None:
        return Choice(tolerance, None, None, math.nan, [])
    errors = [tradeoff.comparisons[name].errors[shown] for name in names]
    return Choice(tolerance, setting, nearest, bounds[shown], errors)

"""The outcome of a plan: what settings cost, which may be used, and which to choose."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.errors import SeriesError, TableError
from dragchain.quantities.registry import MEASURED
from dragchain.run.case import changed_inputs
from dragchain.tables.run_folder import Run
from dragchain.tradeoff.compare import PlanRun, QuantityComparison, Setting, compare_quantity
from dragdeck.records.case import DropTestCase
from dragdeck.records.run import RunRecord
from dragdeck.records.tradeoff import CostsFile
from dragdeck.study.base import flat, without_fields

BROKEN = 0.1
"""A step is broken if it changes the mean drag by more than this, beyond doubt."""

TOLERANCES = (0.02, 0.05, 0.1, 0.2)

# --- costs ---------------------------------------------------------------------------------------

StepCosts = Mapping[str, Mapping[float, float]]
"""Fidelity parameter, level and the time of a step over that at the base, timed side by side."""


def step_costs(costs: CostsFile | None) -> StepCosts:
    """What a step costs at other moduli, steps and speeds; empty if that was not timed."""
    levels: dict[str, dict[float, float]] = {}
    fidelity = costs.fidelity if costs else None
    for entry in costs.costs if costs and fidelity else ():
        if entry.parameter and entry.level is not None and entry.per_step is not None:
            base = {float(getattr(fidelity, entry.parameter)): 1.0}
            levels.setdefault(entry.parameter, base)[entry.level] = entry.per_step
    return levels


def step_time(costs: StepCosts, setting: Setting) -> float:
    """Time of a step at a setting over that at the base.

    Between levels the logarithm is interpolated over that of the level, beyond them the nearest
    counts; parameters multiply.
    """
    logs = []
    for parameter, known in costs.items():
        points = sorted(known.items())
        at, ratios = np.log([level for level, _ in points]), np.log([r for _, r in points])
        logs.append(np.interp(math.log(getattr(setting, parameter)), at, ratios))
    return math.exp(sum(logs))


# --- settings ------------------------------------------------------------------------------------


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
    step_costs : StepCosts
        Empty unless steps were timed side by side; then costs are those of the runs.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.
    """

    runs: list[PlanRun]
    reference: Setting
    arc_m: float
    comparisons: Mapping[str, QuantityComparison]
    skipped: Mapping[str, str]
    step_costs: StepCosts
    largest_step: float

    def settings(self) -> list[Setting]:
        """Every setting once, that with the most steps first."""
        settings = dict.fromkeys(run.setting for run in self.runs)
        return sorted(settings, key=lambda setting: -self.median(setting, "steps_per_m"))

    def of(self, setting: Setting) -> list[PlanRun]:
        """The runs of a setting."""
        return [run for run in self.runs if run.setting == setting]

    def cost(self, setting: Setting) -> float:
        """Processor time for a metre of path over the reference's.

        The number of steps times what a step costs: as it was timed side by
        side, where it was and the setting changes nothing but the fidelity;
        else in the median of the runs, a failed one until it failed.
        """
        if not self.step_costs or setting.other:
            return self.median(setting, "cpu_per_m") / self.median(self.reference, "cpu_per_m")
        steps = self.median(setting, "steps_per_m") / self.median(self.reference, "steps_per_m")
        at_reference = step_time(self.step_costs, self.reference)
        return steps * step_time(self.step_costs, setting) / at_reference

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
    known: dict[str, QuantityComparison] = {}
    skipped: dict[str, str] = {}
    for quantity in MEASURED:
        try:
            known[quantity.name] = compare_quantity(quantity, runs, reference)
        except SeriesError as error:
            skipped[quantity.name] = str(error)
    return Tradeoff(list(runs), reference, arc_m, known, skipped, step_costs or {}, largest_step)


def breaks(tradeoff: Tradeoff, setting: Setting) -> bool:
    """Whether a setting's time step is too long: it failed, or the drag is wrong because of it.

    The mean drag differs from that at the best known shorter step, all else
    alike, by more than `BROKEN`, and the difference is significant.
    """
    if not all(run.complete for run in tradeoff.of(setting)):
        return True
    comparison = tradeoff.comparisons.get("drag_mean")
    shorter = [
        other
        for other in tradeoff.settings()
        if other.timestep_fraction < setting.timestep_fraction
        and replace(other, timestep_fraction=setting.timestep_fraction) == setting
    ]
    if comparison is None or not shorter:
        return False
    best = max(shorter, key=lambda other: len(tradeoff.of(other)))
    change = comparison.between(setting, best)
    return change is not None and change.significant and abs(change.value) > BROKEN


def by_modulus(tradeoff: Tradeoff) -> list[Setting]:
    """For each modulus the setting that is most like the reference else, the stiffest first."""
    reference, nearest = tradeoff.reference.factors(), dict[float, Setting]()

    def unlike(setting: Setting) -> tuple[int, int]:
        factors = setting.factors()
        return sum(factors[name] != reference[name] for name in factors), -len(tradeoff.of(setting))

    for setting in sorted(tradeoff.settings(), key=unlike):
        if not setting.other and any(run.complete for run in tradeoff.of(setting)):
            nearest.setdefault(setting.youngs_modulus_scale, setting)
    nearest.pop(tradeoff.reference.youngs_modulus_scale, None)
    return [nearest[level] for level in sorted(nearest, reverse=True)]


def _candidates(tradeoff: Tradeoff, comparison: QuantityComparison) -> list[Setting]:
    """The settings that could be recommended instead of the reference.

    They change nothing but the fidelity, are cheaper, have a step that is known
    to be safe and does not break, more than one run, and an error of the quantity.
    """
    return [
        setting
        for setting in tradeoff.settings()
        if setting != tradeoff.reference
        and not setting.other
        and tradeoff.cost(setting) < 1.0
        and len(tradeoff.of(setting)) > 1
        and setting.timestep_fraction <= tradeoff.largest_step * (1 + 1e-9)
        and not breaks(tradeoff, setting)
        and setting in comparison.errors
    ]


@dataclass(frozen=True)
class Choice:
    """What to run for a quantity and a tolerance.

    Attributes
    ----------
    tolerance : float
    setting : Setting or None
        The cheapest that is certified.
    nearest : Setting or None
        That of the smallest bound; None if there is no candidate at all.
    bound : float
        Of `setting`, or else of `nearest`.
    """

    tolerance: float
    setting: Setting | None
    nearest: Setting | None
    bound: float


def choose(tradeoff: Tradeoff, quantity: str, tolerance: float) -> Choice:
    """The cheapest setting at which a quantity is within a tolerance, with confidence."""
    comparison = tradeoff.comparisons[quantity]
    candidates = _candidates(tradeoff, comparison)
    bounds = {setting: comparison.errors[setting].bound for setting in candidates}
    able = [setting for setting, bound in bounds.items() if bound <= tolerance]
    setting = min(able, key=tradeoff.cost, default=None)
    nearest = min(bounds, key=bounds.__getitem__, default=None)
    shown = setting or nearest
    return Choice(tolerance, setting, nearest, bounds[shown] if shown else math.nan)


# --- drop tests ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class ComparedDrop:
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


def compare_drops(folders: Sequence[Path]) -> list[ComparedDrop]:
    """Drop tests, the finest step first.

    Parameters
    ----------
    folders : sequence of Path
        Complete runs of the drop test with their tables.

    Raises
    ------
    TableError
        If a folder holds another scene, or a run is not complete or has no table.
    """
    runs = sorted(map(_read_drop, folders), key=lambda run: run[0])
    drops = []
    for fraction, inputs, ratios, cost_s in runs:
        _, standard, finest, finest_s = runs[0]
        changed = changed_inputs(inputs, standard).items()
        common = min(len(ratios), len(finest))
        drops.append(
            ComparedDrop(
                timestep_fraction=fraction,
                other=", ".join(f"{name} {value}" for name, value in changed),
                restitution=float(ratios.mean()),
                error=float(ratios.mean() / finest.mean() - 1.0),
                bound=float(np.abs(ratios[:common] / finest[:common] - 1.0).max()),
                relative_cost=cost_s / finest_s,
            )
        )
    return drops


def _read_drop(folder: Path) -> tuple[float, Mapping[str, JsonValue], Floats, float]:
    """Step over the Rayleigh time, inputs, ratios of the impacts and cost of a drop test."""
    run = Run.open(folder)
    case = run.case
    if not isinstance(case, DropTestCase):
        raise TableError(f"{folder}: the scene is {case.scene}, not drop_test")
    ratios = run.table("impacts", ["restitution"])["restitution"]
    record = RunRecord.read(folder / "run.json")
    if not record.complete:
        raise TableError(f"{folder}: its state is {record.state!r}, not 'complete'")
    inputs = flat(without_fields(case.inputs, "drop_test.timestep_fraction"))
    fraction = float(f"{case.timestep_s / case.rayleigh_time_s:.4g}")
    return fraction, inputs, ratios.to_numpy(), record.processor_time_s

"""The trade of speed against accuracy: every setting's error and cost against the reference.

The runs of a plan, each measured by `dragchain.measures`, are compared over the
stretch of path that all of them have. For each quantity the effects of modulus,
time step, speed and everything else are estimated together (`dragchain.effects`):
added up where the runs do not contradict that, and for every combination by
itself where they do.
"""

from __future__ import annotations

import json
import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from dragchain.errors import SeriesError, TableError
from dragchain.statistics.bed_effects import Combination, Factors, Fit, fit_effects, lack_of_fit
from dragchain.statistics.correlated import autocovariance
from dragchain.tradeoff.measures import FILE, QUANTITIES, SCHEMA, Quantity

Levels = Mapping[str, Hashable]

PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
OTHER = "other"
"""The factor that holds all else a point changes."""

CONFIDENCE = 0.95
ADDITIVE_LEVEL = 0.05
"""Effects are added up unless chance would disagree as much less often than this."""

BROKEN = 0.1
"""A step is broken if it changes the mean drag by more than this, beyond doubt."""

TOLERANCES = (0.02, 0.05, 0.1, 0.2)

SILENT = (
    "seed",
    "motion.path.revolutions",
    "motion.path.length_m",
    "outputs.workpiece_contacts_hz",
    "outputs.network_hz",
)
"""Inputs that differ between runs without being a setting: what is written changes nothing."""


@dataclass(frozen=True)
class Setting:
    """What a point asks for, apart from seed and path."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    other: str = ""

    def factors(self) -> dict[str, Hashable]:
        """Factor to level, as `Factors` wants them."""
        return {name: getattr(self, name) for name in (*PARAMETERS, OTHER)}

    def __str__(self) -> str:
        parts = [
            f"E x {self.youngs_modulus_scale:g}",
            f"{100 * self.timestep_fraction:g} % of Rayleigh",
        ]
        if self.speed_factor != 1.0:
            parts.append(f"speed x {self.speed_factor:g}")
        return ", ".join([*parts, self.other] if self.other else parts)


@dataclass(frozen=True)
class Run:
    """A run of the trade.

    Attributes
    ----------
    setting : Setting
    bed : str
        Id of the fill.
    values : dict of str to float
        Quantity to the run's value over the common path; empty if it failed.
    measures : mapping
        Content of its ``measures.json``.
    further : sequence of dict of str to float
        The same over each further stretch of its path that is as long as the common one.
    """

    setting: Setting
    bed: str
    values: Mapping[str, float]
    measures: Mapping[str, Any]
    further: Sequence[Mapping[str, float]] = ()

    @property
    def stretches(self) -> list[Mapping[str, float]]:
        """The values over every stretch of its path."""
        return [self.values, *self.further]

    @property
    def complete(self) -> bool:
        """Whether it ended well."""
        return bool(self.measures["complete"])

    @property
    def steps_per_m(self) -> float:
        """Steps for a metre of path."""
        return float(self.measures["cost"]["steps_per_m"])

    @property
    def cpu_per_m(self) -> float:
        """Processor time for a metre of path, s/m; NaN for a run that failed at once."""
        cost = self.measures["cost"]
        if not cost["steps"]:
            return math.nan
        return float(cost["cpu_time_s"] / cost["steps"] * cost["steps_per_m"])


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
class Error:
    """Difference to the reference, relative to it.

    Attributes
    ----------
    value, se : float
    ci95_low, ci95_high : float
        Interval of `CONFIDENCE`.
    bound : float
        The true error is smaller than this, in either direction, with that confidence.
    significant : bool
        Zero lies outside of the interval.
    """

    value: float
    se: float
    ci95_low: float
    ci95_high: float
    bound: float
    significant: bool

    def columns(self) -> dict[str, float]:
        """The numbers as columns of a table."""
        names = {"value": "error", "significant": "resolved"}
        return {names.get(name, name): number for name, number in vars(self).items()}


@dataclass(frozen=True)
class Comparison:
    """All settings against the reference in one quantity.

    Attributes
    ----------
    quantity : Quantity
    reference : float
        Its value at the reference, estimated from all runs.
    se : float
        Of that, relative.
    run_std : float
        Relative standard deviation of one run's value over the common path.
    bed_fraction : float
        The part of its square that runs from one bed have in common.
    additivity : float
        Probability of so much disagreement with additive effects by chance.
    additive : bool
        Whether effects were added up.
    apart : list of Setting
        Those that have effects of their own all the same.
    errors : dict of Setting to Error
    fit : Fit
    factors : Factors
        What `between` draws on.
    """

    quantity: Quantity
    reference: float
    se: float
    run_std: float
    bed_fraction: float
    additivity: float
    additive: bool
    apart: list[Setting]
    errors: Mapping[Setting, Error]
    fit: Fit = field(repr=False)
    factors: Factors = field(repr=False)

    def alone(self, setting: Setting, reference: Setting) -> float:
        """The largest error that one of a setting's parameters makes when it is turned alone.

        A setting may be right because the errors of two parameters cancel. That need
        not hold in another scene. 0 where the runs do not tell.
        """
        own, levels = setting.factors(), reference.factors()
        errors = [
            _error(self.fit, self.factors, one, levels, self.quantity.signed)
            for one in ({**levels, name: own[name]} for name in levels)
            if self.factors.tells(one)
        ]
        return max(abs(error.value) for error in errors)

    def between(self, setting: Setting, base: Setting) -> Error | None:
        """Difference of one setting to another; None if the runs cannot tell it."""
        if not all(self.factors.tells(one.factors()) for one in (setting, base)):
            return None
        signed = self.quantity.signed
        return _error(self.fit, self.factors, setting.factors(), base.factors(), signed)


@dataclass(frozen=True)
class Tradeoff:
    """The outcome of a plan.

    Attributes
    ----------
    runs : list of Run
        Complete and failed ones.
    reference : Setting
    arc_m : float
        The path that is compared, m.
    comparisons : dict of str to Comparison
        Quantity to what the settings do to it.
    skipped : dict of str to str
        Quantities that could not be compared, and why.
    step_costs : StepCosts or None
        If steps were timed side by side; else costs are those of the runs.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.
    """

    runs: list[Run]
    reference: Setting
    arc_m: float
    comparisons: Mapping[str, Comparison]
    skipped: Mapping[str, str] = field(default_factory=dict)
    step_costs: StepCosts | None = None
    largest_step: float = math.inf

    def settings(self) -> list[Setting]:
        """Every setting once, that with the most steps first."""
        found = dict.fromkeys(run.setting for run in self.runs)
        return sorted(found, key=lambda setting: -self._median(setting, "steps_per_m"))

    def of(self, setting: Setting) -> list[Run]:
        """The runs of a setting."""
        return [run for run in self.runs if run.setting == setting]

    def cost(self, setting: Setting) -> float:
        """Processor time for a metre of path over the reference's.

        The number of steps times what a step costs: as it was timed side by
        side, where it was and the setting changes nothing but the fidelity;
        else in the median of the runs, a failed one until it failed.
        """
        if self.step_costs is None or setting.other:
            return self._median(setting, "cpu_per_m") / self._median(self.reference, "cpu_per_m")
        steps = self._median(setting, "steps_per_m") / self._median(self.reference, "steps_per_m")
        return steps * self.step_costs.of(setting) / self.step_costs.of(self.reference)

    def _median(self, setting: Setting, name: str) -> float:
        values = np.array([getattr(run, name) for run in self.of(setting)])
        known = values[np.isfinite(values)]
        return float(np.median(known)) if known.size else math.nan


def read_runs(files: Sequence[Path], reference_run: Path) -> tuple[list[Run], Setting, float]:
    """Read the runs of a trade.

    Of runs that differ in the length of their path alone the longest counts; one that is
    several times as long as the common path counts as several runs from its bed.

    Parameters
    ----------
    files : sequence of Path
        Their ``measures.json``.
    reference_run : Path
        Folder of a run at the reference.

    Returns
    -------
    runs : list of Run
    reference : Setting
    arc_m : float
        The longest path that all complete runs have, m.

    Raises
    ------
    TableError
        If a file was written by another version, or no run is complete.
    """
    content = {file: read_measures(file) for file in files}
    if reference_run / FILE not in content:
        raise TableError(f"{reference_run}: the reference is not among the runs of the trade")
    standard = content[reference_run / FILE]
    longest: dict[tuple[Setting, str], Mapping[str, Any]] = {}
    for measures in content.values():
        key = (_setting(measures, standard), measures["bed"])
        if key not in longest or measures.get("arc_m", 0.0) > longest[key].get("arc_m", 0.0):
            longest[key] = measures
    complete = [measures for measures in longest.values() if measures["complete"]]
    if not complete:
        raise TableError("no run of the trade is complete, so there is nothing to compare")
    arc = min(measures["arc_m"] for measures in complete)
    runs = [_run(setting, bed, own, arc) for (setting, bed), own in longest.items()]
    return runs, _setting(standard, standard), arc


def read_measures(file: Path) -> dict[str, Any]:
    """The content of a ``measures.json``.

    Raises
    ------
    TableError
        If another version wrote it.
    """
    measures: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if measures.get("schema") != SCHEMA:
        raise TableError(f"{file}: schema {measures.get('schema')}, this dragchain reads {SCHEMA}")
    return measures


def _inputs(measures: Mapping[str, Any]) -> dict[str, Any]:
    fidelity = {f"fidelity.{name}": value for name, value in measures["fidelity"].items()}
    inputs = {**measures["inputs"], **fidelity}
    silent = {*SILENT, "fidelity.name", *(f"fidelity.{name}" for name in PARAMETERS)}
    return {name: value for name, value in inputs.items() if name not in silent}


def changed_inputs(measures: Mapping[str, Any], standard: Mapping[str, Any]) -> dict[str, Hashable]:
    """Inputs of a run, by dotted name, that differ from those of another.

    No parameter is among them.

    Parameters
    ----------
    measures, standard : mapping
        Content of their ``measures.json``.
    """
    own, other = _inputs(measures), _inputs(standard)
    names = sorted({*own, *other})
    return {name: own.get(name) for name in names if own.get(name) != other.get(name)}


def _setting(measures: Mapping[str, Any], standard: Mapping[str, Any]) -> Setting:
    changed = changed_inputs(measures, standard)
    other = [f"{name} {_shown(value)}" for name, value in changed.items()]
    modulus, step, speed = (float(measures["fidelity"][name]) for name in PARAMETERS)
    return Setting(modulus, step, speed, ", ".join(other))


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _run(setting: Setting, bed: str, measures: Mapping[str, Any], arc_m: float) -> Run:
    first, *further = (
        values_within(measures, arc_m, stretch)
        for stretch in range(max(1, int(measures.get("arc_m", 0.0) / arc_m + 1e-9)))
    )
    return Run(setting, bed, first, measures, further)


def values_within(measures: Mapping[str, Any], arc_m: float, stretch: int = 0) -> dict[str, float]:
    """A run's values over a stretch of its path, the first if no other; blocks stay whole.

    What has one value a bed belongs to the first stretch.
    """
    if not measures["complete"]:
        return {}
    count = max(1, round(arc_m / measures["block_m"]))
    found = {} if stretch else dict(measures["single"])
    own = slice(stretch * count, (stretch + 1) * count)
    for quantity in QUANTITIES:
        blocks = np.array(measures["blocks"].get(quantity.name, []), dtype=np.float64)[own]
        if blocks.size and np.isfinite(blocks).all():
            found[quantity.name] = quantity.of_blocks(blocks)
    return found


def compare(
    runs: Sequence[Run],
    reference: Setting,
    arc_m: float,
    step_costs: StepCosts | None = None,
    largest_step: float = math.inf,
) -> Tradeoff:
    """Every setting against the reference, in every quantity.

    A quantity that cannot be compared, because too few runs have it, is left
    out with the reason.
    """
    found: dict[str, Comparison] = {}
    skipped: dict[str, str] = {}
    for quantity in QUANTITIES:
        try:
            found[quantity.name] = compare_quantity(quantity, runs, reference)
        except SeriesError as error:
            skipped[quantity.name] = str(error)
    return Tradeoff(list(runs), reference, arc_m, found, skipped, step_costs, largest_step)


def compare_quantity(quantity: Quantity, runs: Sequence[Run], reference: Setting) -> Comparison:
    """Every setting against the reference in one quantity.

    Logarithms are compared, so that errors are relative; a quantity that may
    change its sign is compared as it is, in units of the mean drag.

    Raises
    ------
    SeriesError
        If too few runs have the quantity, or none at the reference does.
    """
    rows = [(run, own) for run in runs for own in run.stretches if quantity.name in own]
    settings = [run.setting for run, _ in rows]
    if reference not in settings:
        raise SeriesError("no run at the reference has it")
    values = np.array([own[quantity.name] for _, own in rows])
    if quantity.signed:
        drags = [own["drag_mean"] for run, own in rows if run.setting == reference]
        scale = abs(float(np.mean(drags)))
        values = values / scale
    elif (values == 0.0).any() or len(set(np.sign(values))) > 1:
        raise SeriesError("it is zero or changes its sign, so that no relative error exists")
    else:
        scale = float(np.sign(values[0]))
        values = np.log(np.abs(values))
    factors, fit, additivity = _choose(settings, values, [run.bed for run, _ in rows], reference)
    level, uncertainty = fit.contrast(factors.row(reference.factors()))
    return Comparison(
        quantity=quantity,
        reference=scale * (level if quantity.signed else math.exp(level)),
        se=uncertainty,
        run_std=fit.residual_std,
        bed_fraction=fit.bed_fraction,
        additivity=additivity,
        additive=factors.additive,
        apart=[
            setting
            for setting in dict.fromkeys(settings)
            if factors.combination(setting.factors()) in factors.apart
        ],
        errors={
            setting: _error(fit, factors, setting.factors(), reference.factors(), quantity.signed)
            for setting in dict.fromkeys(settings)
        },
        fit=fit,
        factors=factors,
    )


def _choose(
    settings: Sequence[Setting], values: np.ndarray[Any, Any], beds: list[str], reference: Setting
) -> tuple[Factors, Fit, float]:
    """Additive effects, as far as the runs do not contradict additivity.

    While they do, the combination that contradicts it most gets an effect of
    its own: a step that breaks with soft particles alone does not spoil what is
    known of the others. If most of the combinations would need one, or the
    runs cannot tell the parameters apart, every combination has its own.
    """
    levels = [setting.factors() for setting in settings]
    full_factors = Factors(levels, reference.factors(), additive=False)
    factors = Factors(levels, reference.factors(), additive=True)
    try:
        full = fit_effects(full_factors.design(), values, beds)
    except SeriesError:  # no replicates: additivity is taken on trust
        return factors, fit_effects(factors.design(), values, beds), math.nan
    try:
        additive = fit_effects(factors.design(), values, beds, full.bed_fraction)
    except SeriesError:
        return full_factors, full, math.nan
    first = probability = lack_of_fit(additive, full)
    while probability < ADDITIVE_LEVEL:
        factors = replace(factors, apart=factors.apart | {_misfit(factors, additive, levels)})
        if 2 * len(factors.apart) > len(full_factors.columns):
            return full_factors, full, first
        try:
            additive = fit_effects(factors.design(), values, beds, full.bed_fraction)
        except SeriesError:
            return full_factors, full, first
        probability = lack_of_fit(additive, full)
    return factors, fit_effects(factors.design(), values, beds), first


def _misfit(factors: Factors, fit: Fit, levels: Sequence[Mapping[str, Hashable]]) -> Combination:
    """The combination of levels that fits worst: the largest sum of residuals over its root."""
    sums: dict[Combination, list[float]] = {}
    for level, residual in zip(levels, fit.residuals, strict=True):
        combination = factors.combination(level)
        if len(combination) > 1 and combination not in factors.apart:
            sums.setdefault(combination, []).append(float(residual))
    return max(sums, key=lambda one: abs(sum(sums[one])) / math.sqrt(len(sums[one])))


def _error(fit: Fit, factors: Factors, setting: Levels, reference: Levels, signed: bool) -> Error:
    weights = factors.row(setting) - factors.row(reference)
    return relative_error(*fit.contrast(weights), fit.degrees, signed)


def relative_error(
    difference: float, uncertainty: float, degrees: int, signed: bool = False
) -> Error:
    """The relative error that a difference of logarithms is.

    Parameters
    ----------
    difference, uncertainty : float
        Difference to the reference and its standard error: of logarithms, or
        of values in mean drags if `signed`.
    degrees : int
        Degrees of freedom behind the standard error.
    signed : bool
    """
    shift = uncertainty * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, degrees)
    one_sided = uncertainty * stats.t.ppf(CONFIDENCE, degrees)

    def relative(value: float) -> float:
        return value if signed else math.expm1(value)

    low, high = relative(difference - shift), relative(difference + shift)
    ends = (relative(difference - one_sided), relative(difference + one_sided))
    return Error(
        value=relative(difference),
        se=uncertainty * (1.0 if signed else math.exp(difference)),
        ci95_low=low,
        ci95_high=high,
        bound=max(abs(end) for end in ends),
        significant=bool(low > 0.0 or high < 0.0),
    )


def breaks(tradeoff: Tradeoff, setting: Setting) -> bool:
    """Whether a setting's time step is too long: it failed, or the drag is wrong because of it.

    The mean drag differs from that at the best known shorter step, all else
    alike, by more than `BROKEN`, and the difference is resolved.
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


def candidates(tradeoff: Tradeoff, quantities: Sequence[str]) -> list[Setting]:
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


def recommend(
    tradeoff: Tradeoff, quantity: str | Sequence[str], tolerance: float
) -> Setting | None:
    """The cheapest setting whose error is below a tolerance with confidence.

    Parameters
    ----------
    trade : Trade
    quantity : str or sequence of str
        If several, each of them has to be within the tolerance.
    tolerance : float
        Relative.

    Returns
    -------
    Setting or None
        One of the `candidates`; None if there is none but the reference.
    """
    names = [quantity] if isinstance(quantity, str) else list(quantity)
    able = [
        setting
        for setting in candidates(tradeoff, names)
        if largest_bound(tradeoff, names, setting) <= tolerance
    ]
    return min(able, key=tradeoff.cost, default=None)


@dataclass(frozen=True)
class Along:
    """How a quantity behaves along the path of the longest runs.

    Attributes
    ----------
    blocks : int
        In each of them.
    runs : int
    correlation : list of float
        Between blocks 1, 2 and 3 apart.
    drift : float
        Second half less first half of the path, relative to the whole; of a
        quantity that may change its sign, in mean drags.
    drift_halfwidth : float
        Of its interval of `CONFIDENCE`; NaN for a single run.
    """

    blocks: int
    runs: int
    correlation: list[float]
    drift: float
    drift_halfwidth: float


def along(tradeoff: Tradeoff, quantity: Quantity) -> Along | None:
    """How a quantity changes along the path; None if runs are too short for that."""
    complete = [run.measures for run in tradeoff.runs if run.complete]
    longest = max(measures["arc_m"] for measures in complete)
    longest_runs = [own for own in complete if own["arc_m"] > 0.99 * longest]
    pairs = [(_blocks(own, quantity.name), _blocks(own, "drag_mean")) for own in longest_runs]
    pairs = [(own, drag) for own, drag in pairs if len(own) >= 8 and np.isfinite(own).all()]
    if not pairs:
        return None
    series = [own for own, _ in pairs]
    covariance = sum(autocovariance(blocks)[:4] for blocks in series)
    assert isinstance(covariance, np.ndarray)
    drifts = np.array([_drift(quantity, own, drag) for own, drag in pairs])
    error = stats.sem(drifts) if len(drifts) > 1 else math.nan
    quantile = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, max(len(drifts) - 1, 1))
    return Along(
        blocks=len(series[0]),
        runs=len(series),
        correlation=[float(value) for value in covariance[1:] / covariance[0]],
        drift=float(drifts.mean()),
        drift_halfwidth=float(quantile * error),
    )


def _blocks(measures: Mapping[str, Any], name: str) -> np.ndarray[Any, Any]:
    return np.array(measures["blocks"].get(name, []), dtype=np.float64)


def _drift(quantity: Quantity, blocks: np.ndarray[Any, Any], drag: np.ndarray[Any, Any]) -> float:
    half = len(blocks) // 2
    scale = drag.mean() if quantity.signed else quantity.of_blocks(blocks)
    change = quantity.of_blocks(blocks[-half:]) - quantity.of_blocks(blocks[:half])
    return float(change / abs(scale))


def run_table(tradeoff: Tradeoff) -> pd.DataFrame:
    """One row a run: settings, bed, cost, outcome and the value of every quantity."""
    rows = [
        {
            "run": run.measures["run"],
            **{name: value for name, value in vars(run.setting).items()},
            "bed": run.bed,
            "complete": run.complete,
            "failure": _failure(run),
            "counted_path_m": run.measures.get("arc_m", math.nan),
            **run.measures["cost"],
            **{quantity.name: run.values.get(quantity.name, math.nan) for quantity in QUANTITIES},
        }
        for run in tradeoff.runs
    ]
    return pd.DataFrame(rows)


def _failure(run: Run) -> str:
    return "; ".join(
        f"{check['name']}: {check['seen']}" for check in run.measures.get("failure", [])
    )


def error_table(tradeoff: Tradeoff) -> pd.DataFrame:
    """One row a setting and quantity: cost, error, interval and bound."""
    rows = [
        {
            "quantity": name,
            **vars(setting),
            "runs": sum(run.complete for run in tradeoff.of(setting)),
            "relative_cost": tradeoff.cost(setting),
            **error.columns(),
        }
        for name, comparison in tradeoff.comparisons.items()
        for setting, error in comparison.errors.items()
    ]
    return pd.DataFrame(rows)

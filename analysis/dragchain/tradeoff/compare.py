"""Every setting against the reference, quantity by quantity.

The runs of a plan, each measured by `dragchain.tradeoff.measure_run`, are compared over the
stretch of path that all of them have. For each quantity the effects of modulus,
time step, speed and everything else are estimated together
(`dragchain.statistics.bed_effects`): added up where the runs do not contradict that, and for
every combination by itself where they do.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import stats

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.bed_effects import Combination, Factors, Fit, fit_effects, lack_of_fit
from dragchain.statistics.estimate import CONFIDENCE, student_quantile
from dragchain.tradeoff.quantities import Quantity
from dragchain.tradeoff.runs import Run, Setting

Levels = Mapping[str, Hashable]

ADDITIVE_LEVEL = 0.05
"""Effects are added up unless chance would disagree as much less often than this."""


@dataclass(frozen=True)
class Error:
    """Difference to the reference, relative to it.

    Attributes
    ----------
    value, se : float
    ci95_low, ci95_high : float
        Interval of `CONFIDENCE`.
    bound : float
        One-sided 95 % upper bound of the absolute error.
    significant : bool
        Whether the interval excludes zero.
    """

    value: float
    se: float
    ci95_low: float
    ci95_high: float
    bound: float
    significant: bool

    def columns(self) -> dict[str, float]:
        """The numbers as columns of a table."""
        names = {"value": "error"}
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

    @property
    def reference_halfwidth(self) -> float:
        """Relative half-width of the reference's interval."""
        return student_quantile(self.fit.degrees) * self.se

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
        raise SeriesError("no run at the reference settings has this quantity")
    values = np.array([own[quantity.name] for _, own in rows])
    if quantity.signed:
        drags = [own["drag_mean"] for run, own in rows if run.setting == reference]
        scale = abs(float(np.mean(drags)))
        values = values / scale
    elif (values == 0.0).any() or len(set(np.sign(values))) > 1:
        raise SeriesError("it is zero or changes its sign, so no relative error exists")
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
    settings: Sequence[Setting], values: Floats, beds: list[str | None], reference: Setting
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
    shift = uncertainty * student_quantile(degrees)
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

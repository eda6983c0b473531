"""Every setting against the reference, quantity by quantity.

The runs of a plan, each measured by `dragchain.tradeoff.measure_run`, are compared over the
stretch of path that all of them have. For each quantity the effects of modulus,
time step, speed and everything else are estimated together
(`dragchain.statistics.bed_effects`), for every combination by itself: no test decides from the
same runs which of them may be added up.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.bed_effects import Factors, Fit, fit_effects
from dragchain.statistics.estimate import CONFIDENCE, student_quantile
from dragchain.tradeoff.quantities import Quantity
from dragchain.tradeoff.runs import Run, Setting

Levels = Mapping[str, Hashable]


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
class Model:
    """Effects of settings: how they become columns of a design, and the fit of these."""

    factors: Factors
    fit: Fit

    def error(self, setting: Levels, reference: Levels, signed: bool) -> Error:
        """The difference of one setting to another."""
        weights = self.factors.row(setting) - self.factors.row(reference)
        return relative_error(*self.fit.contrast(weights), self.fit.degrees, signed)


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
    errors : dict of Setting to Error
    model : Model
        What `errors` and `between` draw on.
    added : Model
        Of single parameters, whose effects add up: what `alone` draws on.
    """

    quantity: Quantity
    reference: float
    se: float
    run_std: float
    bed_fraction: float
    errors: Mapping[Setting, Error]
    model: Model = field(repr=False)
    added: Model = field(repr=False)

    @property
    def reference_halfwidth(self) -> float:
        """Relative half-width of the reference's interval."""
        return self.model.fit.quantile * self.se

    def alone(self, setting: Setting, reference: Setting) -> float:
        """The largest error that one of a setting's parameters makes when it is turned alone.

        A setting may be right because the errors of two parameters cancel. That need
        not hold in another scene. 0 where the runs do not tell.
        """
        own, levels = setting.factors(), reference.factors()
        errors = [
            self.added.error(one, levels, self.quantity.signed)
            for one in ({**levels, name: own[name]} for name in levels)
            if self.added.factors.tells(one)
        ]
        return max(abs(error.value) for error in errors)

    def between(self, setting: Setting, base: Setting) -> Error | None:
        """Difference of one setting to another; None if the runs cannot tell it."""
        if not all(self.model.factors.tells(one.factors()) for one in (setting, base)):
            return None
        return self.model.error(setting.factors(), base.factors(), self.quantity.signed)


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
    levels = reference.factors()
    model, added = _models(settings, values, [run.bed for run, _ in rows], levels)
    level, uncertainty = model.fit.contrast(model.factors.row(levels))
    return Comparison(
        quantity=quantity,
        reference=scale * (level if quantity.signed else math.exp(level)),
        se=uncertainty,
        run_std=model.fit.residual_std,
        bed_fraction=model.fit.bed_fraction,
        errors={
            setting: model.error(setting.factors(), levels, quantity.signed)
            for setting in dict.fromkeys(settings)
        },
        model=model,
        added=added,
    )


def _models(
    settings: Sequence[Setting], values: Floats, beds: Sequence[str | None], reference: Levels
) -> tuple[Model, Model]:
    """A model with an effect of every combination, and one whose effects add up.

    One stands for both if the runs do not allow the other: without repetitions effects are
    added up on trust, and what does not fit is scatter.
    """
    levels = [setting.factors() for setting in settings]
    found: list[Model] = []
    for additive in (False, True):
        factors = Factors(levels, reference, additive)
        try:
            found.append(Model(factors, fit_effects(factors.design(), values, beds)))
        except SeriesError:
            if additive and not found:
                raise
    return found[0], found[-1]


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

"""A value with its confidence interval."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AllowInfNan, BeforeValidator

CONFIDENCE = 0.95
"""Level of every interval."""

Verdict = Literal["confirmed", "not confirmed", "contradicted"]
"""What an interval says of a claim, prediction or expectation; each has a rule of its own."""

NORMAL_QUANTILE = 1.959964
"""Half-width of a normal interval of `CONFIDENCE`, in standard errors."""


def finite(number: float) -> float | None:
    """The number, or None where JSON has no way to write it."""
    return float(number) if np.isfinite(number) else None


def _nan_for_none(number: object) -> object:
    return math.nan if number is None else number


Real = Annotated[float, AllowInfNan(True), BeforeValidator(_nan_for_none)]
"""A number of a document that is NaN in Python and null in JSON where it is not known."""


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % confidence interval, NaN where it is not known.

    It may be a field of a document, whose JSON then has null for NaN. It is not reliable if
    the series behind it is too short, so that the interval is probably too narrow.
    """

    value: Real
    ci95_low: Real
    ci95_high: Real
    reliable: bool = field(default=True, kw_only=True)

    @classmethod
    def around(cls, value: float, half_width: float) -> "Estimate":
        """The value with an interval that is symmetric about it."""
        return cls(value, value - half_width, value + half_width)

    @property
    def known(self) -> bool:
        """Whether the value and its interval are finite."""
        return all(math.isfinite(number) for number in self._numbers)

    @property
    def _numbers(self) -> tuple[float, float, float]:
        return self.value, self.ci95_low, self.ci95_high

    @property
    def half_width(self) -> float:
        """Half of the width of the interval."""
        return (self.ci95_high - self.ci95_low) / 2

    @property
    def relative_half_width(self) -> float:
        """Half-width of the interval over the magnitude of the value, infinite if that is zero."""
        return abs(self.half_width / self.value) if self.value else math.inf

    def contains(self, value: float) -> bool:
        """Whether a value is within the interval."""
        return self.ci95_low <= value <= self.ci95_high

    def agrees_with(self, expected: float) -> Verdict:
        """Whether it is what was expected: contradicted if its interval excludes that."""
        return "confirmed" if self.contains(expected) else "contradicted"

    def exceeds(self, null: float) -> Verdict:
        """Whether it is above the value of no effect: so, or below, with its whole interval."""
        if not self.known:
            return "not confirmed"
        if self.ci95_low > null:
            return "confirmed"
        return "contradicted" if self.ci95_high < null else "not confirmed"

    def over(self, size: float) -> "Estimate":
        """The estimate divided by a number, which may be negative."""
        low, high = sorted((self.ci95_low / size, self.ci95_high / size))
        return Estimate(self.value / size, low, high, reliable=self.reliable)

    def exp(self, factor: float = 1.0, minus: float = 0.0) -> "Estimate":
        """The estimate of ``exp(factor * x) - minus``, for a positive factor."""
        return self.mapped(lambda number: np.exp(factor * number) - minus)

    @property
    def within_one(self) -> "Estimate":
        """That of a fraction: the interval is symmetric in the logit, so that it ends in 0 to 1."""
        spread = self.value * (1.0 - self.value)
        if not self.known or spread <= 0.0:
            return self
        from scipy.special import expit, logit

        reach = self.half_width / spread * np.array([-1.0, 1.0])
        return Estimate(self.value, *expit(logit(self.value) + reach), reliable=self.reliable)

    def mapped(self, function: Callable[[float], float]) -> "Estimate":
        """The estimate of a rising function of the number."""
        value, low, high = (float(function(number)) for number in self._numbers)
        return Estimate(value, low, high, reliable=self.reliable)


NOT_KNOWN = Estimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class EstimateColumns:
    """Estimates of a document as columns, NaN in Python and null in JSON where not known."""

    value: tuple[Real, ...]
    ci95_low: tuple[Real, ...]
    ci95_high: tuple[Real, ...]
    reliable: tuple[bool, ...] = ()

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> "EstimateColumns":
        """The columns of estimates."""
        return cls(
            *(
                tuple(getattr(estimate, field.name) for estimate in estimates)
                for field in fields(cls)
            )
        )

    def at(self, place: int) -> Estimate:
        """One of them."""
        return Estimate(self.value[place], self.ci95_low[place], self.ci95_high[place])


def flattened(row: Mapping[str, object]) -> dict[str, object]:
    """A row of a table: an estimate as ``<name>``, ``<name>_ci95_low`` and ``<name>_ci95_high``."""
    flat: dict[str, object] = {}
    for name, value in row.items():
        flat[name] = value
        if isinstance(value, Estimate):
            ends = {f"{name}_ci95_low": value.ci95_low, f"{name}_ci95_high": value.ci95_high}
            flat |= {name: value.value, **ends}
    return flat


def birge_factor(chi2: float, degrees: int) -> float:
    """Factor on standard errors where residuals exceed them: sqrt(chi2 / degrees), 1 at least.

    Birge 1932, Physical Review 40, 207.
    """
    return math.sqrt(max(1.0, chi2 / degrees)) if degrees else 1.0


def student_quantile(degrees: float, confidence: float = CONFIDENCE) -> float:
    """Half-width of a two-sided interval of Student's t, in standard errors."""
    from scipy.special import stdtrit

    return float(stdtrit(degrees, 0.5 + 0.5 * confidence))


def t_interval(value: float, se: float, degrees: float) -> Estimate:
    """The value with its interval, from its standard error and the degrees of freedom."""
    return Estimate.around(value, student_quantile(degrees) * se)


def mean_of(values: ArrayLike) -> Estimate:
    """The mean of the finite ones of independent values with Student's t interval.

    The interval is NaN for fewer than two, as the mean is for none.
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    mean = float(known.mean()) if known.size else math.nan
    if known.size < 2:
        return Estimate(mean, math.nan, math.nan)
    return t_interval(mean, float(known.std(ddof=1)) / math.sqrt(known.size), known.size - 1)

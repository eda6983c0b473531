"""Numbers as text, for pages and pictures."""

import math
from collections.abc import Mapping

from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate

DASH, MINUS, TIMES = "\N{EN DASH}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"
_GROUPS = "\N{NARROW NO-BREAK SPACE}"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: object, digits: int = 3) -> str:
    """A number with that many significant digits, a dash for none, text as it is."""
    if value is None:
        return DASH
    if isinstance(value, bool | str) or not isinstance(value, int | float):
        return str(value)
    if not math.isfinite(value):
        return DASH
    text = str(value) if isinstance(value, int) else f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{value:.0f}"
    return _typeset(text)


def _typeset(text: str) -> str:
    """A number in Python's notation with a minus sign, groups of digits and a power of ten."""
    mantissa, _, power = text.partition("e")
    whole, point, part = mantissa.partition(".")
    if len(whole.lstrip("+-")) > 4:
        whole = f"{int(whole):,}".replace(",", _GROUPS)
    shown = f"{whole}{point}{part}".replace("-", MINUS)
    return f"{shown} {TIMES} 10{str(int(power)).translate(_RAISED)}" if power else shown


def measured(value: object, digits: int = 3) -> str:
    """A number as `number` does, with its zeros at the end."""
    if not isinstance(value, float) or value == 0.0 or not 1e-4 <= abs(value) < 10**digits:
        return number(value, digits)
    return _typeset(f"{value:#.{digits}g}".rstrip("."))


def fixed(value: float | None, decimals: int, sign: bool = False) -> str:
    """A number with that many decimals, a dash for none."""
    if value is None:
        return DASH
    return _typeset(f"{value:{'+' if sign else ''}.{decimals}f}")


def percent(value: float | None) -> str:
    """A signed percentage with one decimal, a dash for none."""
    return DASH if value is None else f"{fixed(value, 1, sign=True)} %"


def fraction(value: float | None) -> str:
    """A fraction of 1 as a signed percentage, a dash for none."""
    return percent(None if value is None else 100 * value)


def in_percent(value: float | None, digits: int = 3) -> str:
    """A fraction of 1 as a number of hundredths without its sign of percent, a dash for none."""
    return DASH if value is None else number(100 * value, digits)


def with_interval(estimate: Estimate, unit: str = "") -> str:
    """A value with its 95 % interval, all three to the second digit of the half-width."""
    after = f" {unit}" if unit else ""
    if not estimate.known or estimate.ci95_high == estimate.ci95_low:
        return f"{measured(estimate.value)}{after}"
    (value, low, high), times = _alike(estimate)
    if times:
        return f"{value} ({low} to {high}){times}{after}"
    return f"{value}{after} ({low} to {high})"


def ends(estimate: Estimate) -> str:
    """The ends of a 95 % interval, to the second digit of its half-width."""
    if not estimate.known or estimate.ci95_high == estimate.ci95_low:
        return f"{measured(estimate.ci95_low)} to {measured(estimate.ci95_high)}"
    (_, low, high), times = _alike(estimate)
    return f"{low} to {high}{times}"


def mean_interval(mean: MeanEstimate) -> str:
    """The mean of a series with its 95 % interval, see `with_interval`."""
    return with_interval(Estimate(mean.mean, mean.ci95_low, mean.ci95_high))


def _alike(estimate: Estimate) -> tuple[list[str], str]:
    """Value and ends with the same decimals, four digits at most, and their power of ten."""
    numbers = (estimate.value, estimate.ci95_low, estimate.ci95_high)
    half = 0.5 * (estimate.ci95_high - estimate.ci95_low)
    power = math.floor(math.log10(max(map(abs, numbers))))
    shift = power if power < -3 else 0
    decimals = max(0, min(1 - math.floor(math.log10(half)), 3 - power) + shift)
    times = f" {TIMES} 10{str(shift).translate(_RAISED)}" if shift else ""
    return [fixed(one / 10.0**shift, decimals) for one in numbers], times


def interval(estimate: Mapping[str, float | None], digits: int = 3) -> str:
    """An estimate with its interval."""
    value, low, high = (
        measured(estimate[name], digits) for name in ("value", "ci95_low", "ci95_high")
    )
    return f"{value} ({low} to {high})"

"""Numbers of a trade-off as text."""

import math
from collections.abc import Callable, Mapping

from dragchain.report.notation import DASH, MINUS, number
from dragchain.statistics.estimate import Estimate
from dragchain.tradeoff.compare import Error

_FOLD = 2.0
"""Relative errors from this on are told as multiples."""


def in_percent(value: float, sign: bool = True) -> str:
    """A share in per cent with as many digits as matter."""
    size = abs(100.0 * value)
    digits = 0 if size >= 9.95 else 1 if size >= 0.095 else 2 if size >= 0.0095 else 3
    text = f"{100.0 * value:{'+' if sign else ''}.{digits}f}"
    text = text if float(text) else "0"
    return text.replace("-", MINUS)


def plainly(fraction: float) -> str:
    """A round share, such as a tolerance, in per cent."""
    return f"{100.0 * fraction:g}"


def error_size(error: Error) -> str:
    """An error in per cent; a large one as a multiple."""
    if error.value >= _FOLD:
        return f"{number(1.0 + error.value, 2)}-fold"
    return f"{in_percent(error.value)} %"


def error_interval(error: Error) -> str:
    """The interval of an error, in per cent; that of a large one in multiples."""
    if error.value >= _FOLD:
        return f"{number(1.0 + error.ci95_low, 2)} to {number(1.0 + error.ci95_high, 2)}"
    return f"{in_percent(error.ci95_low)} to {in_percent(error.ci95_high)} %"


def times(ratio: float) -> str:
    """A ratio of costs with two digits."""
    return DASH if not math.isfinite(ratio) else number(float(f"{ratio:.2g}"), 2)


def cheaper(ratio: float) -> str:
    """A ratio of costs in words."""
    if ratio >= 1.0:
        return f"{times(ratio)} times cheaper"
    return f"{times(1.0 / ratio)} times more expensive"


def span(gain: Estimate) -> str:
    """The interval of a ratio of costs; "one run" where there is none."""
    if math.isnan(gain.ci95_low):
        return "one run"
    return f"{times(gain.ci95_low)} to {times(gain.ci95_high)}"


FILTERS: Mapping[str, Callable[..., str]] = {
    function.__name__: function
    for function in (in_percent, plainly, error_size, error_interval, times, cheaper, span)
}
"""Filters of the page."""

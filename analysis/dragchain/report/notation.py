"""Numbers as text, for pages and pictures."""

import math
from collections.abc import Mapping

DASH, MINUS, TIMES = "\N{EN DASH}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"


def number(value: object, digits: int = 3) -> str:
    """A number with that many significant digits, a dash for none, text as it is."""
    if value is None:
        return DASH
    if isinstance(value, bool | str) or not isinstance(value, int | float):
        return str(value)
    if not math.isfinite(value):
        return DASH
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ") if abs(value) >= 10_000 else str(value)
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{value:.0f}"
    return text.replace("-", MINUS) if "e" not in text else text


def measured(value: object, digits: int = 3) -> str:
    """A number as `number` does, with its zeros at the end."""
    if not isinstance(value, float) or value == 0.0 or not 1e-4 <= abs(value) < 10**digits:
        return number(value, digits)
    return f"{value:#.{digits}g}".rstrip(".").replace("-", MINUS)


def fixed(value: float | None, decimals: int, sign: bool = False) -> str:
    """A number with that many decimals, a dash for none."""
    if value is None:
        return DASH
    return f"{value:{'+' if sign else ''}.{decimals}f}".replace("-", MINUS)


def percent(value: float | None) -> str:
    """A signed percentage with one decimal, a dash for none."""
    return DASH if value is None else f"{fixed(value, 1, sign=True)} %"


def fraction(value: float | None) -> str:
    """A fraction of 1 as a signed percentage, a dash for none."""
    return percent(None if value is None else 100 * value)


def interval(estimate: Mapping[str, float | None], digits: int = 3) -> str:
    """An estimate with its interval."""
    value, low, high = (
        measured(estimate[name], digits) for name in ("value", "ci95_low", "ci95_high")
    )
    return f"{value} ({low} to {high})"

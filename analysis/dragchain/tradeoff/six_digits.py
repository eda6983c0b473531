"""Numbers as ``tradeoff.json`` has them."""

import math
from typing import Annotated

from pydantic import BeforeValidator, PlainSerializer


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.6g}")


SixDigits = Annotated[float, PlainSerializer(_rounded, when_used="json")]
"""A number that is written with six digits."""

Number = Annotated[SixDigits | None, BeforeValidator(_finite)]
"""The same, None where it is not finite."""

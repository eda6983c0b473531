"""Numbers and names of a trade in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dragchain.report.notation import DASH, MINUS, number
from dragchain.tradeoff.compare import OTHER, Error
from dragchain.tradeoff.findings import RUINED, SpeedUp
from dragchain.tradeoff.measures import Quantity

NOT_RESOLVED = "not resolved"
FOLD = 2.0
"""Relative errors from this on are told as multiples."""

PARAMETER_NAMES = {
    "youngs_modulus_scale": "modulus",
    "timestep_fraction": "time step",
    "speed_factor": "speed of the workpiece",
    OTHER: "other",
}


def percent(value: float, sign: bool = True) -> str:
    """A share in per cent with as many digits as matter."""
    size = abs(100.0 * value)
    digits = 0 if size >= 9.95 else 1 if size >= 0.095 else 2 if size >= 0.0095 else 3
    text = f"{100.0 * value:{'+' if sign else ''}.{digits}f}"
    text = text if float(text) else "0"
    return text.replace("-", MINUS)


def plainly(fraction: float) -> str:
    """A round share, such as a tolerance, in per cent."""
    return f"{100.0 * fraction:g}"


def interval(error: Error) -> str:
    """The interval of an error, in per cent; that of a large one in multiples."""
    if error.value >= FOLD:
        return f"{number(1.0 + error.ci95_low, 2)} to {number(1.0 + error.ci95_high, 2)}"
    return f"{percent(error.ci95_low)} to {percent(error.ci95_high)} %"


def times(ratio: float) -> str:
    """A ratio of costs with two digits."""
    return DASH if not math.isfinite(ratio) else number(float(f"{ratio:.2g}"), 2)


def cheaper(ratio: float) -> str:
    """A ratio of costs in words."""
    if ratio >= 1.0:
        return f"{times(ratio)} times cheaper"
    return f"{times(1.0 / ratio)} times dearer"


def span(gain: SpeedUp) -> str:
    """The interval of a ratio of costs; "one run" where there is none."""
    if math.isnan(gain.ci95_low):
        return "one run"
    return f"{times(gain.ci95_low)} to {times(gain.ci95_high)}"


def cell(error: Error | None) -> dict[str, str]:
    """An error as a cell of a table: text, interval and class."""
    if error is None:
        return {"text": DASH, "detail": "", "kind": ""}
    if not error.significant:
        return {"text": NOT_RESOLVED, "detail": interval(error), "kind": "open"}
    size = abs(error.value)
    kind = "bad" if size > RUINED else "middling" if size > RUINED / 2.0 else "good"
    large = error.value >= FOLD
    text = f"{number(1.0 + error.value, 2)}-fold" if large else f"{percent(error.value)} %"
    return {"text": text, "detail": interval(error), "kind": kind}


def joined(names: Sequence[str]) -> str:
    """A list in words."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def long_label(quantity: Quantity) -> str:
    """A label that can stand alone; some in `QUANTITIES` lean on the one before."""
    return {
        "drag_std_long": "drag variations over two particle diameters",
        "drag_std_middle": "drag variations in between",
        "drag_std_short": "drag variations under a quarter of a diameter",
        "contact_force_p50": "median force of a contact on the workpiece",
        "contact_force_p90": "90th percentile of the contact forces on the workpiece",
        "contact_force_p99": "99th percentile of the contact forces on the workpiece",
    }.get(quantity.name, quantity.label)


SHORT = {
    "drag_mean": "mean drag",
    "drag_std": "sd of drag",
    "workpiece_contacts": "contacts on workpiece",
    "contact_force_mean": "mean contact force",
    "contact_force_p90": "90th per\N{SOFT HYPHEN}centile of it",
    "coordination_number": "coordi\N{SOFT HYPHEN}nation number",
    "chain_count": "Peters chains",
    "chain_length": "particles in a chain",
}
"""Heads of columns, for the main quantities."""

"""The stability map: what each run showed, its class, and the largest safe steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.run.completeness import AcceptanceCheck, CheckCode

STABLE, INACCURATE, ENERGY = "stable", "inaccurate", "energy gained"
LOST, OVERLAP, REFUSED = "particles lost", "overlap too large", "engine refused"
CLASSES = (STABLE, INACCURATE, OVERLAP, ENERGY, LOST, REFUSED)
"""Classes of a point, the harmless ones first."""

UNSTABLE = (ENERGY, LOST)

REGIMES = ("impact", "settle", "column", "drag")

OVERLAP_LIMIT = 0.1
"""Largest overlap over the smaller particle's radius. Hertz takes the radius a of the contact to be
small beside R (Johnson 1985, section 4.2); the overlap is a^2/R, so 0.1 is a/R = 0.32. An
assumption: no sharp limit is known."""

ENERGY_LIMITS: Mapping[str, float] = {"impact": 1.01, "settle": 1.2, "column": 10.0, "drag": 10.0}
"""Largest ratio of energies of a run that gains none: after an impact over before, or over
what the reference has after it where the contact law itself gains; the settling
bed's largest over the reference's; the resting bed's at the end over the reference's (or over
`REST_FLOOR`); the dragged bed's median over what it has if all particles move as
the workpiece and one as in a fall through its diameter. Assumptions, above the scatter that
runs with small steps show."""

REST_FLOOR = 1e-7
"""Kinetic energy over N m g d below which a loaded bed is at rest whatever it did before."""

TOLERANCE = 0.05
"""Largest error against the fine step: of the restitution and the tangential speed over the speed
of the impact (absolute), of peak force, bed height and mean drag (relative)."""

SAFETY_FACTOR = 0.8
"""On the largest step that was seen to be safe: about one step of the map's grid."""

ORDINARY_RESTITUTION = 0.5
"""Below this the damping of the contacts makes the safe step much smaller."""

RULE = 0.2
"""The common rule: a fifth of the Rayleigh time."""

CONFIDENCE_SCORES = 1.96
"""Half a 95 % interval in standard errors."""


@dataclass(frozen=True)
class Error:
    """A deviation from the fine-step reference, with the interval that it is known to.

    Attributes
    ----------
    value, low, high : float
        Signed; `low` and `high` are equal to `value` where nothing scatters.
    """

    value: float
    low: float
    high: float

    @property
    def surely(self) -> float:
        """The smallest size in the interval: what the deviation has at the least."""
        return 0.0 if self.low <= 0.0 <= self.high else min(abs(self.low), abs(self.high))


@dataclass(frozen=True)
class Seen:
    """What is known of a point.

    Attributes
    ----------
    regime, state : str
        ``complete``, ``failed`` or ``refused``.
    steps : int
        Steps that the engine made.
    failed : sequence of AcceptanceCheck
        The acceptance checks that did not pass.
    refused : str, optional
        Why no deck could be written.
    energy_ratio, overlap_ratio : float, optional
        See `ENERGY_LIMITS` and `OVERLAP_LIMIT`.
    errors : mapping of str to Error
    """

    regime: str
    state: str
    steps: int = 0
    failed: Sequence[AcceptanceCheck] = ()
    refused: str | None = None
    energy_ratio: float | None = None
    overlap_ratio: float | None = None
    errors: Mapping[str, Error] = field(default_factory=dict)

    def failed_check(self, code: CheckCode) -> AcceptanceCheck | None:
        """The check of this code, if it did not pass."""
        return next((check for check in self.failed if check.code == code), None)


def classify(seen: Seen) -> tuple[str, str]:
    """Class of a point, and why.

    A run that ended is no proof of a stable step: its energy counts too.

    Returns
    -------
    str, str
        One of `CLASSES`, and the reason.
    """
    for judge in (_refused, _lost, _gained, _overlapping, _inaccurate):
        why = judge(seen)
        if why is not None:
            return _OF_JUDGE[judge.__name__], why
    return STABLE, "no criterion of the others met"


_OF_JUDGE = {
    "_refused": REFUSED,
    "_lost": LOST,
    "_gained": ENERGY,
    "_overlapping": OVERLAP,
    "_inaccurate": INACCURATE,
}


def _refused(seen: Seen) -> str | None:
    if seen.refused is not None:
        return seen.refused.replace("\n", " ")
    error = seen.failed_check("no_engine_error")
    refused = error is not None and seen.steps == 0 and error.reason != "lost_particles"
    return error.seen if error is not None and refused else None


def _lost(seen: Seen) -> str | None:
    error, limit = seen.failed_check("no_engine_error"), seen.failed_check("within_limits")
    if error is not None and error.reason == "lost_particles":
        return error.seen
    if limit is not None and limit.reason == "particles":
        return f"stopped early: {limit.seen}"
    kept = seen.failed_check("particles_kept")
    return None if kept is None else kept.seen


def _gained(seen: Seen) -> str | None:
    if (past := seen.failed_check("within_limits")) is not None:
        return f"stopped early: {past.seen}"
    if seen.failed_check("finite_numbers") is not None:
        return "numbers that are not finite"
    if (restless := seen.failed_check("at_rest")) is not None:
        return f"the bed does not come to rest: {restless.seen}"
    limit = ENERGY_LIMITS[seen.regime]
    if seen.energy_ratio is None or seen.energy_ratio <= limit:
        return None
    return f"energy {seen.energy_ratio:.3g} times what it should be at most (limit {limit:g})"


def _overlapping(seen: Seen) -> str | None:
    if seen.overlap_ratio is None or seen.overlap_ratio <= OVERLAP_LIMIT:
        return None
    return f"overlap {seen.overlap_ratio:.3g} of the radius (limit {OVERLAP_LIMIT:g})"


def _inaccurate(seen: Seen) -> str | None:
    if seen.failed:
        return "; ".join(f"{check.name}: {check.seen}" for check in seen.failed)
    for name, error in seen.errors.items():
        if error.surely > TOLERANCE:
            return f"error of the {name} {error.value:+.3g} (tolerance {TOLERANCE:g})"
    return None


def safe_fraction(points: pd.DataFrame, bad: Sequence[str]) -> float | None:
    """Largest step below which no point of a condition is of a bad class.

    Parameters
    ----------
    points : DataFrame
        ``fraction`` and ``class`` of one condition.
    bad : sequence of str
        Classes.

    Returns
    -------
    float or None
        One of the fractions that were run; None if even the smallest is bad.
    """
    found = None
    for fraction, kind in points.sort_values("fraction")[["fraction", "class"]].to_numpy():
        if kind in bad:
            return found
        found = float(fraction)
    return found


NOT_SAFE = (INACCURATE, *UNSTABLE, REFUSED)
"""A large overlap comes from load and stiffness, not from the step: it limits no step."""


def conditions(points: pd.DataFrame) -> pd.DataFrame:
    """One row a condition: its largest safe and its largest stable step.

    Returns
    -------
    DataFrame
        ``regime condition axis label usable`` (whether its reference is stable, so that a safe
        step can be asked for), ``safe_fraction`` (no class of `NOT_SAFE` up to it),
        ``stable_fraction`` (no energy gained and no particles lost up to it), both over the
        Rayleigh time, the same over the critical step (``..._critical``), ``grid_end`` (whether
        the largest step of the grid is the safe one, so the limit lies above), ``restitution``.
    """
    rows = []
    for keys, group in points.groupby(["regime", "condition"], sort=False):
        reference = group[group["reference"]].iloc[0]
        usable = reference["class"] == STABLE
        safe = safe_fraction(group, NOT_SAFE) if usable else None
        stable = safe_fraction(group, (*UNSTABLE, REFUSED))
        per_rayleigh = reference["rayleigh_time_s"] / reference["critical_step_s"]
        rows.append(
            {
                "regime": keys[0],
                "condition": keys[1],
                "axis": reference["axis"],
                "label": reference["label"],
                "usable": usable,
                "reference_class": reference["class"],
                "reference_why": reference["why"],
                "safe_fraction": _float(safe),
                "stable_fraction": _float(stable),
                "safe_critical": _float(safe) * per_rayleigh,
                "stable_critical": _float(stable) * per_rayleigh,
                "damped_fraction": reference["damped_fraction"],
                "critical_over_rayleigh": 1.0 / per_rayleigh,
                "grid_end": safe == group["fraction"].max(),
                "restitution": reference["setting_restitution"],
            }
        )
    return pd.DataFrame(rows)


def _float(value: float | None) -> float:
    return math.nan if value is None else value


def regimes(found: pd.DataFrame) -> list[dict[str, Any]]:
    """The largest safe step of each regime: the smallest of its usable conditions.

    Parameters
    ----------
    found : DataFrame
        As `conditions` makes it.

    Returns
    -------
    list of dict
        ``regime``, ``conditions``, ``usable``, ``base_fraction``, ``safe_fraction``,
        ``recommended_fraction`` (times `SAFETY_FACTOR`), ``over_rule`` (the safe step over the
        20 % rule), ``stable_fraction``, ``safe_critical``, ``stable_critical``, ``limited_by``,
        ``ordinary_fraction`` and ``ordinary_critical`` (the safe step without the strongly damped
        conditions, those below `ORDINARY_RESTITUTION`).
    """
    rows = []
    for regime in REGIMES:
        own = found[found["regime"] == regime]
        own = own[own["usable"]]
        if own.empty or own["safe_fraction"].isna().all():
            continue
        worst = own.iloc[int(np.nanargmin(own["safe_fraction"].to_numpy()))]
        base = own[own["axis"] == "base"]
        ordinary = own[own["restitution"] >= ORDINARY_RESTITUTION]
        rows.append(
            {
                "regime": regime,
                "conditions": int((found["regime"] == regime).sum()),
                "usable": len(own),
                "base_fraction": _first(base, "safe_fraction"),
                "base_critical": _first(base, "safe_critical"),
                "safe_fraction": float(worst["safe_fraction"]),
                "recommended_fraction": SAFETY_FACTOR * float(worst["safe_fraction"]),
                "over_rule": float(worst["safe_fraction"]) / RULE,
                "stable_fraction": float(own["stable_fraction"].min()),
                "safe_critical": float(own["safe_critical"].min()),
                "recommended_critical": SAFETY_FACTOR * float(own["safe_critical"].min()),
                "stable_critical": float(own["stable_critical"].min()),
                "limited_by": str(worst["label"]),
                "ordinary_fraction": _least(ordinary, "safe_fraction"),
                "ordinary_critical": _least(ordinary, "safe_critical"),
            }
        )
    return rows


def _least(rows: pd.DataFrame, name: str) -> float | None:
    return None if rows.empty else float(rows[name].min())


def _first(rows: pd.DataFrame, name: str) -> float | None:
    if rows.empty or math.isnan(rows[name].iloc[0]):
        return None
    return float(rows[name].iloc[0])


ERROR_BINS_PER_DECADE = 6
"""Resolution of the table of errors against steps per contact."""


def error_table(points: pd.DataFrame) -> dict[str, list[float]]:
    """Restitution error against steps per contact, over all head-on impacts.

    Parameters
    ----------
    points : DataFrame
        All points; those of impacts along the normal whose reference is stable are used, runs
        that gain energy included.

    Returns
    -------
    dict of str to list of float
        ``steps_per_contact`` (geometric mean of a bin), ``median`` of the largest error among a
        run's impacts, ``worst`` of the bin and of all with more steps, ``ordinary_worst`` (the same
        where the restitution is at least `ORDINARY_RESTITUTION`), ``peak_force_worst``, ``runs``.
    """
    references = points[points["reference"] & (points["class"] == STABLE)]
    chosen = points[
        (points["regime"] == "impact")
        & ~points["reference"]
        & (points["state"] == "complete")
        & points["condition"].isin(references["condition"])
        & (points["setting_angle_deg"] == 0.0)
    ]
    steps = chosen["steps_per_contact"].to_numpy()
    bins = np.floor(np.log10(steps) * ERROR_BINS_PER_DECADE).astype(int)
    ordinary = (chosen["setting_restitution"] >= ORDINARY_RESTITUTION).to_numpy()
    groups = [bins == number for number in np.unique(bins)]
    errors = chosen["restitution_error"].abs().to_numpy()
    forces = chosen["peak_force_error"].abs().to_numpy()
    return {
        "steps_per_contact": [_round(np.exp(np.log(steps[own]).mean())) for own in groups],
        "median": [_round(np.median(errors[own])) for own in groups],
        "ordinary_worst": _envelope(errors, [own & ordinary for own in groups]),
        "worst": _envelope(errors, groups),
        "peak_force_worst": _envelope(forces, groups),
        "runs": [int(own.sum()) for own in groups],
    }


def _envelope(values: NDArray[np.float64], groups: Sequence[NDArray[np.bool_]]) -> list[float]:
    """Largest value of each group and of all after it: more steps never make it larger."""
    largest = [values[own].max(initial=0.0) for own in groups]
    return [_round(value) for value in np.maximum.accumulate(largest[::-1])[::-1]]


def _round(value: float) -> float:
    return float(f"{value:.3g}")

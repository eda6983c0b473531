"""The largest safe steps of a map: of each condition, of each regime; and the errors of impacts."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from evidence.stability.classes import INACCURATE, REFUSED, STABLE, UNSTABLE
from evidence.stability.document import RestitutionErrors, SafeSteps
from evidence.stability.map import REGIMES

SAFETY_FACTOR = 0.8
"""On the largest step that was seen to be safe: about one step of the map's grid."""

_ORDINARY_RESTITUTION = 0.5
"""Below this the damping of the contacts makes the safe step much smaller."""

RULE = 0.2
"""The common rule: a fifth of the Rayleigh time."""

_ERROR_BINS_PER_DECADE = 6
"""Resolution of the table of errors against steps per contact."""

_NOT_SAFE = (INACCURATE, *UNSTABLE, REFUSED)
"""A large overlap comes from load and stiffness, not from the step: it limits no step."""


def safe_fraction(points: pd.DataFrame, bad: Sequence[str]) -> float:
    """Largest step below which no point of a condition is of a bad class.

    Parameters
    ----------
    points : DataFrame
        ``fraction`` and ``class`` of one condition.
    bad : sequence of str
        Classes.

    Returns
    -------
    float
        One of the fractions that were run; NaN if even the smallest is bad.
    """
    rising = points.sort_values("fraction")
    past = np.logical_or.accumulate(rising["class"].isin(bad).to_numpy())
    return float(rising.loc[~past, "fraction"].max())


def conditions(points: pd.DataFrame) -> pd.DataFrame:
    """One row per condition: its largest safe and its largest stable step.

    Returns
    -------
    DataFrame
        ``regime condition axis label usable`` (whether its reference is stable, so that a safe
        step can be asked for), ``safe_fraction`` (no class of ``NOT_SAFE`` up to it),
        ``stable_fraction`` (no energy gained and no particles lost up to it), both over the
        Rayleigh time, the same over the critical step (``..._critical``), ``grid_end`` (whether
        the largest step of the grid is the safe one, so the limit lies above), ``restitution``.
    """
    groups = points.groupby(["regime", "condition"], sort=False)
    return pd.DataFrame([_condition(group) for _, group in groups])


def _condition(points: pd.DataFrame) -> dict[str, object]:
    reference = points[points["reference"]].iloc[0]
    usable = reference["class"] == STABLE
    safe = safe_fraction(points, _NOT_SAFE) if usable else math.nan
    stable = safe_fraction(points, (*UNSTABLE, REFUSED))
    per_rayleigh = reference["rayleigh_time_s"] / reference["critical_step_s"]
    return {
        **{name: reference[name] for name in ("regime", "condition", "axis", "label")},
        "usable": usable,
        "reference_class": reference["class"],
        "reference_why": reference["why"],
        "safe_fraction": safe,
        "stable_fraction": stable,
        "safe_critical": safe * per_rayleigh,
        "stable_critical": stable * per_rayleigh,
        "damped_fraction": reference["damped_fraction"],
        "critical_over_rayleigh": 1.0 / per_rayleigh,
        "grid_end": safe == points["fraction"].max(),
        "restitution": reference["setting_restitution"],
    }


def regimes(found: pd.DataFrame) -> dict[str, SafeSteps]:
    """The largest safe step of each regime that has one.

    Parameters
    ----------
    found : DataFrame
        As `conditions` makes it.
    """
    groups = {name: found[found["regime"] == name] for name in REGIMES}
    return {
        name: _regime(group)
        for name, group in groups.items()
        if group.loc[group["usable"], "safe_fraction"].notna().any()
    }


def _regime(found: pd.DataFrame) -> SafeSteps:
    usable = found[found["usable"]]
    base = usable[usable["axis"] == "base"]
    ordinary = usable[usable["restitution"] >= _ORDINARY_RESTITUTION]
    worst = usable.sort_values("safe_fraction", kind="stable").iloc[0]
    safe, safe_critical = float(worst["safe_fraction"]), float(usable["safe_critical"].min())
    return SafeSteps(
        conditions=len(found),
        usable=len(usable),
        base_fraction=_least(base["safe_fraction"]),
        base_critical=_least(base["safe_critical"]),
        safe_fraction=safe,
        recommended_fraction=SAFETY_FACTOR * safe,
        over_rule=safe / RULE,
        stable_fraction=_least(usable["stable_fraction"]),
        safe_critical=safe_critical,
        recommended_critical=SAFETY_FACTOR * safe_critical,
        stable_critical=_least(usable["stable_critical"]),
        limited_by=str(worst["label"]),
        ordinary_fraction=_least(ordinary["safe_fraction"]),
        ordinary_critical=_least(ordinary["safe_critical"]),
    )


def _least(values: "pd.Series[float]") -> float:
    """The smallest value; NaN for none."""
    return float(values.min())


def head_on_impacts(points: pd.DataFrame) -> pd.DataFrame:
    """Impacts along the normal of conditions whose reference is stable, without references."""
    usable = points.loc[points["reference"] & (points["class"] == STABLE), "condition"]
    return points[
        (points["regime"] == "impact")
        & ~points["reference"]
        & points["condition"].isin(usable)
        & (points["setting_angle_deg"] == 0.0)
    ]


def error_table(points: pd.DataFrame) -> RestitutionErrors:
    """Restitution error against steps per contact, over all head-on impacts that ended."""
    impacts = head_on_impacts(points)
    impacts = impacts[impacts["state"] == "complete"]
    steps = impacts["steps_per_contact"].to_numpy()
    bins = np.floor(np.log10(steps) * _ERROR_BINS_PER_DECADE).astype(int)
    ordinary = (impacts["setting_restitution"] >= _ORDINARY_RESTITUTION).to_numpy()
    groups = [bins == number for number in np.unique(bins)]
    errors = impacts["restitution_error"].abs().to_numpy()
    forces = impacts["peak_force_error"].abs().to_numpy()
    return RestitutionErrors(
        steps_per_contact=tuple(float(np.exp(np.log(steps[own]).mean())) for own in groups),
        median=tuple(float(np.median(errors[own])) for own in groups),
        ordinary_worst=_envelope(errors, [own & ordinary for own in groups]),
        worst=_envelope(errors, groups),
        peak_force_worst=_envelope(forces, groups),
        runs=tuple(int(own.sum()) for own in groups),
    )


def _envelope(
    values: NDArray[np.float64], groups: Sequence[NDArray[np.bool_]]
) -> tuple[float, ...]:
    """Largest value of each group and of all after it: more steps never make it larger."""
    largest = [values[own].max(initial=0.0) for own in groups]
    return tuple(np.maximum.accumulate(largest[::-1])[::-1].tolist())

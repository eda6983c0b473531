"""The largest safe steps of conditions and regimes, and the document of a map."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
import pandas as pd

from dragdeck.records.stability import Criteria, RestitutionErrors, SafeSteps, StabilityFile
from evidence.stability.judge import (
    ENERGY_LIMITS,
    INACCURATE,
    OVERLAP_LIMIT,
    REFUSED,
    STABLE,
    TOLERANCE,
    UNSTABLE,
)
from evidence.stability.measures import REST_FLOOR, PointRun
from evidence.stability.points import REGIMES

# --- the largest safe steps --------------------------------------------------------------------

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


def largest_safe(points: pd.DataFrame, bad: Sequence[str]) -> float:
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
        step can be asked for), ``safe_fraction`` (none of `_NOT_SAFE` up to it),
        ``stable_fraction`` (no energy gained and no particles lost up to it), both over the
        Rayleigh time, the same over the critical step (``..._critical``), ``grid_end`` (whether
        the largest step of the grid is the safe one, so the limit lies above), ``restitution``.
    """
    groups = points.groupby(["regime", "condition"], sort=False)
    return pd.DataFrame([_safe_steps(group) for _, group in groups])


def _safe_steps(points: pd.DataFrame) -> dict[str, object]:
    reference = points[points["reference"]].iloc[0]
    usable = reference["class"] == STABLE
    safe = largest_safe(points, _NOT_SAFE) if usable else math.nan
    stable = largest_safe(points, (*UNSTABLE, REFUSED))
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


def regimes(conditions: pd.DataFrame) -> dict[str, SafeSteps]:
    """The largest safe step of each regime that has one.

    Parameters
    ----------
    conditions : DataFrame
        As `conditions` makes it.
    """
    groups = {name: conditions[conditions["regime"] == name] for name in REGIMES}
    return {
        name: _regime(group)
        for name, group in groups.items()
        if group.loc[group["usable"], "safe_fraction"].notna().any()
    }


def _regime(conditions: pd.DataFrame) -> SafeSteps:
    usable = conditions[conditions["usable"]]
    base = usable[usable["axis"] == "base"]
    ordinary = usable[usable["restitution"] >= _ORDINARY_RESTITUTION]
    worst = usable.sort_values("safe_fraction", kind="stable").iloc[0]
    least = {
        f"{name}_{unit}": float(rows[f"{kind}_{unit}"].min())
        for unit in ("fraction", "critical")
        for name, rows, kind in (
            ("base", base, "safe"),
            ("safe", usable, "safe"),
            ("stable", usable, "stable"),
            ("ordinary", ordinary, "safe"),
        )
    }
    return SafeSteps.model_validate(
        {
            **least,
            "conditions": len(conditions),
            "usable": len(usable),
            "limited_by": str(worst["label"]),
            "over_rule": least["safe_fraction"] / RULE,
            "recommended_fraction": SAFETY_FACTOR * least["safe_fraction"],
            "recommended_critical": SAFETY_FACTOR * least["safe_critical"],
        }
    )


def head_on_impacts(points: pd.DataFrame) -> pd.DataFrame:
    """Impacts along the normal of conditions whose reference is stable, without references."""
    usable = points.loc[points["reference"] & (points["class"] == STABLE), "condition"]
    return points[
        (points["regime"] == "impact")
        & ~points["reference"]
        & points["condition"].isin(usable)
        & (points["setting_angle_deg"] == 0.0)
    ]


def restitution_errors(points: pd.DataFrame) -> RestitutionErrors:
    """Restitution error against steps per contact, over all head-on impacts that ended."""
    impacts = head_on_impacts(points)
    impacts = impacts[impacts["state"] == "complete"]
    decades = np.log(impacts["steps_per_contact"])
    bins = np.floor(np.log10(impacts["steps_per_contact"]) * _ERROR_BINS_PER_DECADE)
    errors, forces = impacts["restitution_error"].abs(), impacts["peak_force_error"].abs()
    ordinary = errors.where(impacts["setting_restitution"] >= _ORDINARY_RESTITUTION)
    return RestitutionErrors(
        steps_per_contact=tuple(np.exp(decades.groupby(bins).mean())),
        median=tuple(errors.groupby(bins).median()),
        ordinary_worst=_envelope(ordinary.groupby(bins).max()),
        worst=_envelope(errors.groupby(bins).max()),
        peak_force_worst=_envelope(forces.groupby(bins).max()),
        runs=tuple(errors.groupby(bins).size()),
    )


def _envelope(largest: pd.Series) -> tuple[float, ...]:
    """Largest value of each group and of all after it: more steps never make it larger."""
    return tuple(largest.fillna(0.0)[::-1].cummax()[::-1])


def summarise_map(
    points: pd.DataFrame, conditions: pd.DataFrame, runs: Sequence[PointRun]
) -> StabilityFile:
    """What ``./run dragdeck check`` uses: safe steps, errors of impacts, and where they come from.

    Parameters
    ----------
    points, conditions : DataFrame
        As `judge` and `conditions` make them.
    runs : sequence of PointRun
    """
    records = [run.record for run in runs if run.record]
    cases = [run.case for run in runs if run.record and run.case]
    started = max((record.started for record in records), default=datetime.now(UTC).isoformat())
    return StabilityFile(
        commands=("./run stability",),
        engine_versions=tuple(sorted({record.engine_version for record in records})),
        dragdeck_versions=tuple(sorted({case.versions["dragdeck"] for case in cases})),
        measured=started[:10],
        points=len(points),
        engine_wall_time_s=round(sum(record.wall_time_s for record in records), 1),
        safety_factor=SAFETY_FACTOR,
        criteria=Criteria(
            tolerance=TOLERANCE,
            overlap_limit=OVERLAP_LIMIT,
            energy_limits=ENERGY_LIMITS,
            rest_floor=REST_FLOOR,
        ),
        regimes=regimes(conditions),
        restitution_error=restitution_errors(points),
    )

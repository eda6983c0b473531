"""The table of a map's points: numbers and class of each."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from dragchain.statistics.estimate import flattened
from dragdeck.decks.case_file import CaseOfStudy
from evidence.stability.classes import Seen, Verdict, classify
from evidence.stability.critical_timestep import critical_step, damped_fraction
from evidence.stability.drag import measure_drag
from evidence.stability.map import Settings
from evidence.stability.measured import (
    COLUMNS,
    Bed,
    Measured,
    measure_impacts,
    measure_resting,
    measure_settled,
)
from evidence.stability.points import PointRun

_SMALL_STEP = 0.4
"""Steps over the Rayleigh time up to which the heights of settled beds differ by chance."""

_ERRORS = (
    *("restitution_error", "peak_force_error", "tangential_speed_error", "height_error"),
    *("mean_drag_error", "mean_drag_error_ci95_low", "mean_drag_error_ci95_high"),
)


@dataclass(frozen=True)
class ClassifiedPoint:
    """A point with what is known of it.

    Attributes
    ----------
    run : PointRun
    label : str
        What sets its condition apart.
    measured : Measured or None
        None of a run that did not end.
    seen : Seen
    verdict : Verdict
    critical_step_s : float
        Of its condition's reference; NaN without contacts.
    rayleigh_time_s : float
    """

    run: PointRun
    label: str
    measured: Measured | None
    seen: Seen
    verdict: Verdict
    critical_step_s: float
    rayleigh_time_s: float


_MEASURES: Mapping[str, Callable[[PointRun, CaseOfStudy], Measured]] = {
    "impact": measure_impacts,
    "settle": measure_settled,
    "column": measure_resting,
    "drag": measure_drag,
}
"""By regime, what measures a run that came to its end."""


def classify_points(runs: Sequence[PointRun]) -> list[ClassifiedPoint]:
    """Measure and classify all points, condition by condition."""
    conditions: dict[str, list[PointRun]] = {}
    for run in runs:
        conditions.setdefault(run.point.condition, []).append(run)
    bases = {run.point.regime: run.point.settings for run in runs if run.point.axis == "base"}
    return [
        point
        for group in conditions.values()
        for point in _condition(group, bases.get(group[0].point.regime, {}))
    ]


def _condition(group: Sequence[PointRun], base: Settings) -> list[ClassifiedPoint]:
    """The points of one condition; its reference comes first."""
    runs = sorted(group, key=lambda run: not run.point.reference)
    measured = [_measure(run) for run in runs]
    fine = measured[0]
    if isinstance(fine, Bed) and runs[0].point.regime == "settle":
        fine = replace(fine, height_scatter=_height_scatter(runs, measured))
    step = critical_step(fine.frequency_rad_s) if fine else math.inf
    reference = runs[0].case
    points = []
    for run, own in zip(runs, measured, strict=True):
        seen = _seen(run, own, fine)
        points.append(
            ClassifiedPoint(
                run=run,
                label=run.point.label(base),
                measured=own,
                seen=seen,
                verdict=classify(seen),
                critical_step_s=step if math.isfinite(step) and reference else math.nan,
                rayleigh_time_s=reference.rayleigh_time_s if reference else math.nan,
            )
        )
    return points


def _measure(run: PointRun) -> Measured | None:
    if run.case is None or not run.measurable:
        return None
    return _MEASURES[run.point.regime](run, run.case)


def _height_scatter(runs: Sequence[PointRun], measured: Sequence[Measured | None]) -> float:
    """Relative standard deviation of bed heights that differ by chance, from the small steps."""
    heights = [
        own.height_m
        for run, own in zip(runs, measured, strict=True)
        if isinstance(own, Bed) and run.point.fraction <= _SMALL_STEP
    ]
    return float(np.std(heights, ddof=1) / np.mean(heights)) if len(heights) > 2 else math.inf


def _seen(run: PointRun, own: Measured | None, reference: Measured | None) -> Seen:
    """What classifies a point."""
    record = run.record
    return Seen(
        regime=run.point.regime,
        state=record.state if record else "refused",
        steps=record.last_step if record else 0,
        failed=record.failed_checks if record else (),
        refused=run.point.refused,
        energy_ratio=own.energy_ratio(reference) if own else None,
        overlap_ratio=own.overlap_ratio if own else None,
        errors=own.errors(reference) if own and reference else {},
    )


def point_table(points: Sequence[ClassifiedPoint]) -> pd.DataFrame:
    """One row per point."""
    return pd.DataFrame([_row(point) for point in points])


def _row(point: ClassifiedPoint) -> dict[str, object]:
    own, seen, run = point.run.point, point.seen, point.run
    step = run.case.timestep_s if run.case else math.nan
    contact = run.impact.contact_time_s if run.impact else math.nan
    return {
        "regime": own.regime,
        "condition": own.condition,
        "axis": own.axis,
        "label": point.label,
        "fraction": own.fraction,
        "reference": own.reference,
        "state": seen.state,
        "class": point.verdict.kind,
        "why": point.verdict.why,
        "timestep_s": step,
        "rayleigh_time_s": point.rayleigh_time_s,
        "critical_step_s": point.critical_step_s,
        "fraction_of_critical": step / point.critical_step_s,
        "damped_fraction": damped_fraction(own.number("restitution")),
        "steps_per_contact": contact / step,
        "steps": seen.steps,
        "energy_ratio": math.nan if seen.energy_ratio is None else seen.energy_ratio,
        "overlap_ratio": math.nan if seen.overlap_ratio is None else seen.overlap_ratio,
        **_error_columns(seen),
        **dict.fromkeys(COLUMNS, math.nan),
        **(point.measured.columns() if point.measured else {}),
        **{f"setting_{name}": value for name, value in own.settings.items()},
        "folder": own.folder,
    }


def _error_columns(seen: Seen) -> dict[str, object]:
    found = {f"{name.replace(' ', '_')}_error": error for name, error in seen.errors.items()}
    columns = flattened(found)
    return {name: columns.get(name, math.nan) for name in _ERRORS}

"""The judgement of a map: class of every point, safe step of every condition and regime."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pandas as pd

from dragchain.statistics.estimate import Estimate, flattened
from dragdeck.records.run import AcceptanceCheck, CheckCode, CheckReason
from evidence.stability.measures import COLUMNS, MEASURES, PointRow, PointRun
from evidence.stability.network import critical_step, damped_fraction
from evidence.stability.points import PointSettings

# --- classes of points -------------------------------------------------------------------------

STABLE, INACCURATE, ENERGY = "stable", "inaccurate", "energy gained"
LOST, OVERLAP, REFUSED = "particles lost", "overlap too large", "engine refused"
CLASSES = (STABLE, INACCURATE, OVERLAP, ENERGY, LOST, REFUSED)
"""Classes of a point, the harmless ones first."""

UNSTABLE = (ENERGY, LOST)

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

TOLERANCE = 0.05
"""Largest error against the fine step: of the restitution and the tangential speed over the speed
of the impact (absolute), of peak force, bed height and mean drag (relative)."""


@dataclass(frozen=True)
class Seen:
    """What is known of a point.

    Attributes
    ----------
    regime, state : str
        State: ``complete``, ``failed`` or ``refused``.
    steps : int
        Steps that the engine made.
    failed : sequence of AcceptanceCheck
        The acceptance checks that did not pass.
    refused : str, optional
        Why no deck could be written.
    energy_ratio, overlap_ratio : float
        See `ENERGY_LIMITS` and `OVERLAP_LIMIT`; NaN if not known.
    errors : mapping of str to Estimate
        Deviations from the fine-step reference, signed; the ends of the interval are equal where
        nothing scatters.
    """

    regime: str
    state: str
    steps: int = 0
    failed: Sequence[AcceptanceCheck] = ()
    refused: str | None = None
    energy_ratio: float = math.nan
    overlap_ratio: float = math.nan
    errors: Mapping[str, Estimate] = field(default_factory=dict)

    def failed_check(
        self, code: CheckCode, reason: CheckReason | None = None
    ) -> AcceptanceCheck | None:
        """The check of this code, if it did not pass for this reason; any reason if None."""
        matching = (check for check in self.failed if check.code == code)
        return next((check for check in matching if reason in (None, check.reason)), None)


class PointVerdict(NamedTuple):
    """Class of a point and why."""

    kind: str
    why: str


STOPPED = "stopped early"
"""Begin of the words for a run that exceeded a limit of its scene."""

_CHECKS: tuple[tuple[str, CheckCode, CheckReason | None, str], ...] = (
    (LOST, "no_engine_error", "lost_particles", "{}"),
    (LOST, "within_limits", "particles", f"{STOPPED}: {{}}"),
    (LOST, "particles_kept", None, "{}"),
    (ENERGY, "within_limits", None, f"{STOPPED}: {{}}"),
    (ENERGY, "finite_numbers", None, "numbers that are not finite"),
    (ENERGY, "at_rest", None, "the bed does not come to rest: {}"),
)
"""The class of a run whose check of a code did not pass for a reason (None: any), and the words
for it, in the order in which they count."""


def classify(seen: Seen) -> PointVerdict:
    """Class of a point, and why.

    A run that ended is no proof of a stable step: its energy counts too.
    """
    return next(_verdicts(seen))


def _verdicts(seen: Seen) -> Iterator[PointVerdict]:
    """All classes that a point falls into, the one that counts first."""
    if seen.refused is not None:
        yield PointVerdict(REFUSED, seen.refused.replace("\n", " "))
    error = seen.failed_check("no_engine_error", "other")
    if error is not None and not seen.steps:
        yield PointVerdict(REFUSED, error.seen)
    for kind, code, reason, why in _CHECKS:
        if check := seen.failed_check(code, reason):
            yield PointVerdict(kind, why.format(check.seen))
    limit = ENERGY_LIMITS[seen.regime]
    if seen.energy_ratio > limit:
        why = f"energy {seen.energy_ratio:.3g} times what it should be at most (limit {limit:g})"
        yield PointVerdict(ENERGY, why)
    if seen.overlap_ratio > OVERLAP_LIMIT:
        why = f"overlap {seen.overlap_ratio:.3g} of the radius (limit {OVERLAP_LIMIT:g})"
        yield PointVerdict(OVERLAP, why)
    if seen.failed:
        why = "; ".join(f"{check.name}: {check.seen}" for check in seen.failed)
        yield PointVerdict(INACCURATE, why)
    for name, deviation in seen.errors.items():
        if _at_least(deviation) > TOLERANCE:
            why = f"error of the {name} {deviation.value:+.3g} (tolerance {TOLERANCE:g})"
            yield PointVerdict(INACCURATE, why)
    yield PointVerdict(STABLE, "no criterion of the others met")


def _at_least(error: Estimate) -> float:
    """The smallest size within the interval: what the deviation has at the least."""
    return 0.0 if error.contains(0.0) else min(abs(error.ci95_low), abs(error.ci95_high))


# --- the table of points -----------------------------------------------------------------------

_SMALL_STEP = 0.4
"""Steps over the Rayleigh time up to which the heights of settled beds differ by chance."""

_ERRORS = (
    *("restitution_error", "peak_force_error", "tangential_speed_error", "height_error"),
    *("mean_drag_error", "mean_drag_error_ci95_low", "mean_drag_error_ci95_high"),
)


def judge_points(runs: Sequence[PointRun]) -> pd.DataFrame:
    """Measure and classify all points, condition by condition: one row per point."""
    conditions: dict[str, list[PointRun]] = {}
    for run in runs:
        conditions.setdefault(run.point.condition, []).append(run)
    bases = {run.point.regime: run.point.settings for run in runs if run.point.axis == "base"}
    return pd.DataFrame(
        row
        for group in conditions.values()
        for row in _condition(group, bases.get(group[0].point.regime, {}))
    )


def _condition(group: Sequence[PointRun], base: PointSettings) -> Iterator[dict[str, object]]:
    """The points of one condition; its reference comes first."""
    runs = sorted(group, key=lambda run: not run.point.reference)
    regime, case, measure = runs[0].point.regime, runs[0].case, MEASURES[runs[0].point.regime]
    measured = [measure.row(ended, run.point) if (ended := run.ended) else None for run in runs]
    fine = measured[0]
    if fine and regime == "settle":
        fine = {**fine, "height_scatter": _height_scatter(runs, measured)}
    step = critical_step(fine["frequency_rad_s"]) if fine else math.inf
    critical_s = step if math.isfinite(step) and case else math.nan
    for run, row in zip(runs, measured, strict=True):
        point, record = run.point, run.record
        seen = Seen(
            regime=regime,
            state=record.state if record else "refused",
            steps=record.last_step if record else 0,
            failed=record.failed_checks if record else (),
            refused=run.refused,
            energy_ratio=measure.energy_ratio(row, fine) if row else math.nan,
            overlap_ratio=row["overlap_ratio"] if row else math.nan,
            errors=measure.errors(row, fine) if row and fine else {},
        )
        verdict, step_s = classify(seen), run.case.timestep_s if run.case else math.nan
        errors = {f"{name.replace(' ', '_')}_error": error for name, error in seen.errors.items()}
        yield {
            "regime": regime,
            "condition": point.condition,
            "axis": point.axis,
            "label": point.label(base),
            "fraction": point.fraction,
            "reference": point.reference,
            "state": seen.state,
            "class": verdict.kind,
            "why": verdict.why,
            "timestep_s": step_s,
            "rayleigh_time_s": case.rayleigh_time_s if case else math.nan,
            "critical_step_s": critical_s,
            "fraction_of_critical": step_s / critical_s,
            "damped_fraction": damped_fraction(point.number("restitution")),
            "steps_per_contact": run.contact_time_s / step_s,
            "steps": seen.steps,
            "energy_ratio": seen.energy_ratio,
            "overlap_ratio": seen.overlap_ratio,
            **dict.fromkeys((*_ERRORS, *COLUMNS), math.nan),
            **{name: part for name, part in flattened(errors).items() if name in _ERRORS},
            **{name: part for name, part in (row or {}).items() if name in COLUMNS},
            **{f"setting_{name}": setting for name, setting in point.settings.items()},
            "folder": point.folder,
        }


def _height_scatter(runs: Sequence[PointRun], measured: Sequence[PointRow | None]) -> float:
    """Relative standard deviation of bed heights that differ by chance, from the small steps."""
    heights = [
        row["height_m"]
        for run, row in zip(runs, measured, strict=True)
        if row and run.point.fraction <= _SMALL_STEP
    ]
    return float(np.std(heights, ddof=1) / np.mean(heights)) if len(heights) > 2 else math.inf

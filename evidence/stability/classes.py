"""Classes of a point: what each run showed, and what that makes of its step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from dragchain.run.completeness import AcceptanceCheck, CheckCode, CheckReason
from dragchain.statistics.estimate import Estimate

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
    energy_ratio, overlap_ratio : float, optional
        See `ENERGY_LIMITS` and `OVERLAP_LIMIT`.
    errors : mapping of str to Estimate
        Deviations from the fine-step reference, signed; the ends of the interval are equal where
        nothing scatters.
    """

    regime: str
    state: str
    steps: int = 0
    failed: Sequence[AcceptanceCheck] = ()
    refused: str | None = None
    energy_ratio: float | None = None
    overlap_ratio: float | None = None
    errors: Mapping[str, Estimate] = field(default_factory=dict)

    def failed_check(
        self, code: CheckCode, reason: CheckReason | None = None
    ) -> AcceptanceCheck | None:
        """The check of this code, if it did not pass for this reason; any reason if None."""
        found = (check for check in self.failed if check.code == code)
        return next((check for check in found if reason in (None, check.reason)), None)


class Verdict(NamedTuple):
    """Class of a point and why; the acceptance check that decided it, if one did."""

    kind: str
    why: str
    check: CheckCode | None = None


class _Rule(NamedTuple):
    """The class of a run whose check of this code did not pass, and the words for it."""

    kind: str
    code: CheckCode
    reason: CheckReason | None = None
    why: str = "{}"


_RULES = (
    _Rule(LOST, "no_engine_error", "lost_particles"),
    _Rule(LOST, "within_limits", "particles", "stopped early: {}"),
    _Rule(LOST, "particles_kept"),
    _Rule(ENERGY, "within_limits", why="stopped early: {}"),
    _Rule(ENERGY, "finite_numbers", why="numbers that are not finite"),
    _Rule(ENERGY, "at_rest", why="the bed does not come to rest: {}"),
)
"""In the order in which they count."""


def classify(seen: Seen) -> Verdict:
    """Class of a point, and why.

    A run that ended is no proof of a stable step: its energy counts too.
    """
    judges: tuple[Callable[[Seen], Verdict | None], ...] = (
        _refused,
        _failed_check,
        _energy_gained,
        _overlap_too_large,
        _inaccurate,
    )
    verdicts = (judge(seen) for judge in judges)
    stable = Verdict(STABLE, "no criterion of the others met")
    return next((verdict for verdict in verdicts if verdict is not None), stable)


def _refused(seen: Seen) -> Verdict | None:
    if seen.refused is not None:
        return Verdict(REFUSED, seen.refused.replace("\n", " "))
    error = seen.failed_check("no_engine_error", "other")
    return None if error is None or seen.steps else Verdict(REFUSED, error.seen, error.code)


def _failed_check(seen: Seen) -> Verdict | None:
    for kind, code, reason, why in _RULES:
        check = seen.failed_check(code, reason)
        if check is not None:
            return Verdict(kind, why.format(check.seen), code)
    return None


def _energy_gained(seen: Seen) -> Verdict | None:
    limit = ENERGY_LIMITS[seen.regime]
    if seen.energy_ratio is None or seen.energy_ratio <= limit:
        return None
    why = f"energy {seen.energy_ratio:.3g} times what it should be at most (limit {limit:g})"
    return Verdict(ENERGY, why)


def _overlap_too_large(seen: Seen) -> Verdict | None:
    if seen.overlap_ratio is None or seen.overlap_ratio <= OVERLAP_LIMIT:
        return None
    why = f"overlap {seen.overlap_ratio:.3g} of the radius (limit {OVERLAP_LIMIT:g})"
    return Verdict(OVERLAP, why)


def _inaccurate(seen: Seen) -> Verdict | None:
    if seen.failed:
        why = "; ".join(f"{check.name}: {check.seen}" for check in seen.failed)
        return Verdict(INACCURATE, why, seen.failed[0].code)
    for name, error in seen.errors.items():
        if _at_least(error) > TOLERANCE:
            why = f"error of the {name} {error.value:+.3g} (tolerance {TOLERANCE:g})"
            return Verdict(INACCURATE, why)
    return None


def _at_least(error: Estimate) -> float:
    """The smallest size within the interval: what the deviation has at the least."""
    return 0.0 if error.contains(0.0) else min(abs(error.ci95_low), abs(error.ci95_high))

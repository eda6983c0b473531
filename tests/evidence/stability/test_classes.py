"""Classes of points, by the codes and reasons of acceptance checks and by numbers."""

import math
from typing import Any

import pytest

from dragchain.run.completeness import AcceptanceCheck, CheckCode, CheckReason
from dragchain.statistics.estimate import Estimate
from evidence.stability.classes import (
    ENERGY,
    ENERGY_LIMITS,
    INACCURATE,
    LOST,
    OVERLAP,
    OVERLAP_LIMIT,
    REFUSED,
    STABLE,
    Seen,
    classify,
)


def seen(**changes: Any) -> Seen:
    return Seen(**{"regime": "impact", "state": "complete", "steps": 1000, **changes})


def check(code: CheckCode, saw: str = "", reason: CheckReason | None = None) -> AcceptanceCheck:
    return AcceptanceCheck(code=code, reason=reason, name=code, passed=False, seen=saw, limit="")


def failed(*checks: AcceptanceCheck, **changes: Any) -> Seen:
    return seen(state="failed", failed=checks, **changes)


@pytest.mark.parametrize(
    ("point", "kind"),
    [
        (seen(), STABLE),
        (seen(energy_ratio=ENERGY_LIMITS["impact"]), STABLE),
        (seen(energy_ratio=ENERGY_LIMITS["impact"] * 1.001), ENERGY),
        (seen(regime="column", energy_ratio=9.0), STABLE),
        (seen(overlap_ratio=OVERLAP_LIMIT * 1.01), OVERLAP),
        (seen(errors={"restitution": Estimate(0.06, 0.06, 0.06)}), INACCURATE),
        (seen(errors={"restitution": Estimate(-0.06, -0.06, -0.06)}), INACCURATE),
        (seen(errors={"mean drag": Estimate(0.3, -0.1, 0.7)}), STABLE),
        (seen(errors={"mean drag": Estimate(0.3, 0.04, 0.56)}), STABLE),
        (seen(errors={"mean drag": Estimate(0.3, 0.06, 0.54)}), INACCURATE),
        (seen(errors={"mean drag": Estimate(0.3, -math.inf, math.inf)}), STABLE),
        (seen(state="refused", steps=0, refused="too soft"), REFUSED),
        (failed(check("no_engine_error", reason="lost_particles")), LOST),
        (failed(check("no_engine_error", reason="lost_particles"), steps=0), LOST),
        (failed(check("particles_kept", "12")), LOST),
        (failed(check("within_limits", reason="particles")), LOST),
        (failed(check("within_limits", reason="energy")), ENERGY),
        (failed(check("at_rest")), ENERGY),
        (failed(check("neighbour_builds")), INACCURATE),
    ],
)
def test_classes(point: Seen, kind: str) -> None:
    assert classify(point)[0] == kind


def test_an_error_before_the_first_step_is_a_refusal_with_its_text() -> None:
    text = "ERROR: 0.05 < coefficientRestitution <= 1 required"
    point = failed(check("no_engine_error", text, "other"), check("particles_kept", "0"), steps=0)
    assert classify(point) == (REFUSED, text, "no_engine_error")


def test_the_worse_of_two_classes_counts() -> None:
    point = seen(energy_ratio=2.0, overlap_ratio=1.0, errors={"restitution": Estimate(1, 1, 1)})
    assert classify(point)[0] == ENERGY
    kind, why, _ = classify(seen(overlap_ratio=0.2, errors={"restitution": Estimate(1, 1, 1)}))
    assert kind == OVERLAP and "0.2" in why

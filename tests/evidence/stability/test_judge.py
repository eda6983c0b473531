"""The judgement of a map: classes of points, and the largest safe steps."""

import math
from typing import Any

import pandas as pd
import pytest

from dragchain.statistics.estimate import Estimate
from dragdeck.records.run import AcceptanceCheck, CheckCode, CheckReason
from evidence.stability.judge import (
    ENERGY,
    ENERGY_LIMITS,
    INACCURATE,
    LOST,
    OVERLAP,
    OVERLAP_LIMIT,
    REFUSED,
    STABLE,
    UNSTABLE,
    Seen,
    classify,
)
from evidence.stability.safe_steps import conditions, largest_safe, regimes


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
    ],
)
def test_classes(point: Seen, kind: str) -> None:
    assert classify(point)[0] == kind


def test_an_error_before_the_first_step_is_a_refusal_with_its_text() -> None:
    text = "ERROR: 0.05 < coefficientRestitution <= 1 required"
    point = failed(check("no_engine_error", text, "other"), check("particles_kept", "0"), steps=0)
    assert classify(point) == (REFUSED, text)


def test_the_worse_of_two_classes_counts() -> None:
    point = seen(energy_ratio=2.0, overlap_ratio=1.0, errors={"restitution": Estimate(1, 1, 1)})
    assert classify(point)[0] == ENERGY
    kind, why = classify(seen(overlap_ratio=0.2, errors={"restitution": Estimate(1, 1, 1)}))
    assert kind == OVERLAP and "0.2" in why


def table(*classes: str) -> pd.DataFrame:
    return pd.DataFrame({"fraction": [0.1, 0.2, 0.4, 0.8][: len(classes)], "class": classes})


@pytest.mark.parametrize(
    ("classes", "safe"),
    [
        ((STABLE, STABLE, INACCURATE, LOST), 0.4),
        ((STABLE, ENERGY, STABLE, STABLE), 0.1),
        ((STABLE, STABLE, STABLE, STABLE), 0.8),
        ((LOST, STABLE, STABLE, STABLE), math.nan),
    ],
)
def test_a_safe_step_has_no_unsafe_step_below(classes: tuple[str, ...], safe: float) -> None:
    shuffled = table(*classes).sample(frac=1, random_state=1)
    assert largest_safe(shuffled, UNSTABLE) == pytest.approx(safe, nan_ok=True)


def points(condition: str, classes: list[str], restitution: float = 0.9) -> pd.DataFrame:
    return table(*classes).assign(
        regime="settle", condition=condition, label=condition, why="",
        axis="base" if condition == "a" else "restitution",
        reference=[n == 0 for n in range(len(classes))], rayleigh_time_s=2e-5,
        critical_step_s=1e-5, damped_fraction=1.0, setting_restitution=restitution,
    )  # fmt: skip


def test_a_regime_is_as_safe_as_its_worst_condition() -> None:
    all_points = (
        points("a", [STABLE, STABLE, STABLE, LOST]),
        points("b", [STABLE, STABLE, ENERGY, LOST], restitution=0.1),
        points("c", [OVERLAP, STABLE, STABLE, STABLE]),
    )
    row = regimes(conditions(pd.concat(all_points)))["settle"]
    assert row.conditions == 3 and row.usable == 2
    assert row.base_fraction == 0.4 and row.ordinary_fraction == 0.4
    assert row.safe_fraction == 0.2 and row.limited_by == "b"
    assert row.safe_critical == pytest.approx(0.4)  # the critical step is half the Rayleigh time
    assert row.over_rule == pytest.approx(1.0)
    assert row.recommended_fraction == pytest.approx(0.16)


def test_a_regime_without_a_usable_condition_has_no_safe_step() -> None:
    assert regimes(conditions(points("a", [OVERLAP, STABLE, STABLE]))) == {}
    row = regimes(conditions(points("b", [STABLE, STABLE, LOST], restitution=0.1)))["settle"]
    assert row.ordinary_fraction is None and row.base_fraction is None
    assert row.safe_fraction == 0.2

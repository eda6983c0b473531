"""The largest safe steps of conditions and regimes."""

import math

import pandas as pd
import pytest

from evidence.stability.classes import ENERGY, INACCURATE, LOST, OVERLAP, STABLE, UNSTABLE
from evidence.stability.safe_steps import conditions, regimes, safe_fraction


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
    assert safe_fraction(shuffled, UNSTABLE) == pytest.approx(safe, nan_ok=True)


def points(condition: str, classes: list[str], restitution: float = 0.9) -> pd.DataFrame:
    fractions = [0.1, 0.2, 0.4, 0.8][: len(classes)]
    return pd.DataFrame(
        {
            "regime": "settle",
            "condition": condition,
            "axis": "base" if condition == "a" else "restitution",
            "label": condition,
            "fraction": fractions,
            "reference": [n == 0 for n in range(len(classes))],
            "class": classes,
            "why": "",
            "rayleigh_time_s": 2e-5,
            "critical_step_s": 1e-5,
            "damped_fraction": 1.0,
            "setting_restitution": restitution,
        }
    )


def test_a_regime_is_as_safe_as_its_worst_condition() -> None:
    found = conditions(
        pd.concat(
            [
                points("a", [STABLE, STABLE, STABLE, LOST]),
                points("b", [STABLE, STABLE, ENERGY, LOST], restitution=0.1),
                points("c", [OVERLAP, STABLE, STABLE, STABLE]),
            ]
        )
    )
    rows = regimes(found)
    assert list(rows) == ["settle"]
    row = rows["settle"]
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

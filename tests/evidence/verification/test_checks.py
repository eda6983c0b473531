"""Comparisons with the references, and what is taken from recordings for them."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from recordings import recording

from dragdeck.errors import RejectedRunError
from evidence.verification import checks
from evidence.verification.checks import QUANTITIES, abscissa, fitted_order, published_curve
from evidence.verification.motion_checks import flight_energy, incline_reference, momentum_changes
from evidence.verification.quantity_check import COULOMB, EXACT, QuantityCheck, check_rows
from evidence.verification.report import verdict, worst_rows


def test_a_verdict_depends_on_the_error_and_on_the_reference() -> None:
    run, rows = recording([[1.0]]), [(0.0, 2.0, 2.02), (1.0, 1.0, 1.1)]
    same = check_rows(run, QuantityCheck("force_n", EXACT, rows, 0.02))
    assert same["verdict"].tolist() == ["pass", "fail"]
    assert same["error"].tolist() == pytest.approx([0.01, 0.05])
    other = check_rows(run, QuantityCheck("force_n", COULOMB, rows, 0.02))
    assert other["verdict"].tolist() == ["agrees", "differs"]


def test_not_a_number_is_never_a_pass() -> None:
    check = check_rows(recording([[1.0]]), QuantityCheck("f", EXACT, [(0.0, 1.0, math.nan)], 1.0))
    assert check["verdict"].tolist() == ["fail"]


def test_momentum_of_a_pair_counts_orbit_and_spin() -> None:
    pair = {"particle": 1, "partner": 2, "value": 0.0}
    run = recording([[0.0, 3.0], [0.0, 3.0]], contacts=[pair])
    run.velocity_m_s[:, 0, 0] = 1.0
    run.spin_rad_s[1, 1, 1] = 2.0
    linear, angular = momentum_changes(run.contact)
    assert np.abs(linear).max() == 0.0
    mass = run.particle(1).mass_kg
    size = 2 * 1.5 * mass  # the orbit, once by itself and once in the sum
    assert angular[1] == pytest.approx([0.0, 2 * 0.4 * mass / size, 0.0])


@pytest.mark.parametrize(("friction", "rolls"), [(0.2, True), (0.1, False)])
def test_a_particle_rolls_or_slips_down_an_incline(friction: float, rolls: bool) -> None:
    angle = math.atan(0.5)
    run = recording(
        [[1.0]],
        angle_deg=math.degrees(angle),
        gravity_m_s2=[10 * math.sin(angle), 0.0, -10 * math.cos(angle)],
        pairs=[{"types": [1, 2], "restitution": 0.5, "friction": friction}],
    )
    speed, spin = incline_reference(run.contact)
    if rolls:
        assert speed == pytest.approx(5 / 7 * 10 * math.sin(angle))
        assert speed + spin == pytest.approx(0.0)
    else:
        assert speed == pytest.approx(10 * (math.sin(angle) - friction * math.cos(angle)))
        assert speed + spin > 0.0


def test_the_energy_of_flight_counts_the_impacts_before() -> None:
    run = recording([[3.0], [2.0], [0.9], [2.0], [3.0]])
    run.velocity_m_s[:, 0, 2] = (-2.0, -2.0, 0.0, 1.0, 1.0)
    run.force_n[2, 0, 2] = 5.0
    impacts, energy = flight_energy(run)
    assert impacts.tolist() == [0, 0, 1, 1]
    assert energy == pytest.approx([1.0, 1.0, 0.25, 0.25])


@pytest.mark.parametrize(
    ("test", "quantity", "expected"),
    [
        ("oblique_angle", "spin_rad_s", 40.0),
        ("oblique_tangential", "scaled_spin", -2.0 / (0.2 * 0.2)),
        ("spin_plane", "patch_restitution", 3.5 * 0.2 * 1.5 * 0.2 / -2.0),
        ("spin_plane", "recoil_tangent", -2.0 / 0.2),
        ("spin_pair", "tangential_m_s", -2.0),
    ],
)
def test_a_quantity_is_a_function_of_what_the_paper_has(
    test: str, quantity: str, expected: float
) -> None:
    """A particle of radius 1 m that comes down at 0.2 m/s and spins at -2 rad/s."""
    fall = {"particle": 1, "partner": "plane", "value": 40.0}
    run = recording([[1.1], [0.9], [1.1]], test=test, contacts=[fall])
    run.spin_rad_s[0, 0, 1] = 2.0
    assert abscissa(run.contact, quantity) == pytest.approx(expected)


def test_a_fitted_order_is_the_exponent() -> None:
    assert fitted_order([(10, 1e-2), (100, 1e-4), (1000, 1e-6)]) == pytest.approx(2.0)


def test_published_curves_are_in_order_and_only_where_they_belong() -> None:
    x, y = published_curve("oblique_angle", "aluminium_oxide on rigid", "spin_rad_s")
    assert (np.diff(x) > 0).all()
    assert np.interp(29.96, x, y) == pytest.approx(-616.5)
    assert published_curve("oblique_angle", "no such", "spin_rad_s").shape == (2, 0)


def test_every_published_point_is_a_number_of_a_test() -> None:
    table = pd.read_csv(Path(checks.__file__).with_name("published.csv"), comment="#")
    assert np.isfinite(table[["x", "y"]].to_numpy()).all()
    assert set(table["test"]) <= {*QUANTITIES, "elastic_pair", "elastic_plane"}


def test_the_summary_keeps_the_worst_point_and_a_failure_is_named(tmp_path: Path) -> None:
    rows = [(0.0, 2.0, 2.0), (7.0, 2.0, 2.2)]
    summary = worst_rows(
        check_rows(recording([[1.0]]), QuantityCheck("force_n", EXACT, rows, 0.02))
    )
    assert summary[["x", "points", "verdict"]].values.tolist() == [[7.0, 2, "fail"]]
    with pytest.raises(RejectedRunError, match=r"elastic_plane, s on s, force_n: error 0\.1"):
        verdict(summary, tmp_path)
    assert verdict(summary.assign(verdict="pass"), tmp_path).startswith("1 pass, 0 fail")

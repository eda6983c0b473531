"""Comparisons with the references, and what is taken from recordings for them."""

import math

import numpy as np
import pytest
from recordings import recording

from evidence.verification import checks
from evidence.verification.quantities import fitted_order, incline_reference, momentum_changes


def test_a_verdict_depends_on_the_error_and_on_the_reference() -> None:
    run = recording([[1.0]])
    rows = [(0.0, 2.0, 2.02), (1.0, 1.0, 1.1)]
    same = checks.compare(run, "force_n", checks.EXACT, rows, 0.02)
    assert same["verdict"].tolist() == ["pass", "fail"]
    assert same["error"].tolist() == pytest.approx([0.01, 0.05])
    other = checks.compare(run, "force_n", checks.COULOMB, rows, 0.02)
    assert other["verdict"].tolist() == ["agrees", "differs"]


def test_not_a_number_is_never_a_pass() -> None:
    check = checks.compare(recording([[1.0]]), "f", checks.EXACT, [(0.0, 1.0, math.nan)], 1.0)
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


def test_a_fitted_order_is_the_exponent() -> None:
    rows = [(10, 1e-2), (100, 1e-4), (1000, 1e-6)]
    assert fitted_order(rows) == pytest.approx(2.0)

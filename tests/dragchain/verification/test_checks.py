"""Reading and judging runs of the verification suite, on motions made by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dragchain.contact_law.impact import Motion
from dragchain.errors import RejectedRunError, TableError
from dragchain.verification import checks
from dragchain.verification.published import published
from dragchain.verification.recording import Recording
from dragchain.verification.report import quantity, summarise, verdict

STEEL = {"youngs_modulus_pa": 2e11, "poissons_ratio": 0.3, "density_kg_m3": 7800.0, "name": "s"}


def recording(heights: list[list[float]], **facts: Any) -> Recording:
    """Particles of radius 1 m above z = 0, at these heights over time, one frame a second."""
    z = np.array(heights, dtype=np.float64)
    place = np.zeros((*z.shape, 3))
    place[:, :, 2] = z
    still = np.zeros_like(place)
    case = {
        "run": "made", "test": "elastic_plane", "number": 2, "series": "s on s",
        "vary": "tangential_m_s", "steps_per_contact": 100, "limit_force": True,
        "gravity_m_s2": [0.0, 0.0, 0.0], "types": [STEEL, STEEL],
        "pairs": [{"types": [1, 2], "restitution": 0.5, "friction": 0.2},
                  {"types": [1, 1], "restitution": 0.9, "friction": 0.1}],
        "bodies": [{"type": 1, "radius_m": 1.0} for _ in heights[0]],
        "walls": [{"name": "plane", "type": 2}],
        **facts,
    }  # fmt: skip
    velocity = np.gradient(place, axis=0) if len(z) > 1 else np.zeros_like(place)
    return Recording(
        case, np.arange(len(z), dtype=float), place, velocity, still, still, {"plane": still}
    )


ON_PLANE = {"particle": 1, "partner": "plane", "value": 0.0}
ON_PARTICLE = {"particle": 2, "partner": 1, "value": 0.0}


def test_overlap_is_measured_to_a_plane_and_to_a_particle() -> None:
    run = recording([[0.9, 2.7]])
    assert run.overlap_m(ON_PLANE) == pytest.approx([0.1])
    assert run.overlap_m(ON_PARTICLE) == pytest.approx([0.2])


def test_each_contact_has_the_constants_of_its_pair() -> None:
    run = recording([[0.9, 2.7]])
    assert (run.contact(ON_PLANE).restitution, run.contact(ON_PARTICLE).restitution) == (0.5, 0.9)
    assert run.contact(ON_PARTICLE).modulus_pa == pytest.approx(2e11 / 0.91 / 2)
    assert run.contact(ON_PARTICLE).shear_pa == pytest.approx(2e11 / (4 * 1.7 * 1.3))
    assert run.contact(ON_PLANE).partner is None


def test_a_duration_is_read_between_frames() -> None:
    run = recording([[1.1], [0.9], [0.9], [1.3]])
    assert run.duration_s(ON_PLANE) == pytest.approx(1.75)  # from 0.5 s to 2.25 s


@pytest.mark.parametrize("heights", [[1.1, 0.9], [0.9, 1.1], [1.1, 1.2]])
def test_an_impact_that_is_not_whole_is_refused(heights: list[float]) -> None:
    with pytest.raises(TableError, match="not whole"):
        recording([[height] for height in heights]).impact(ON_PLANE)


def test_the_underside_of_a_particle_that_turns_about_y_moves_backwards() -> None:
    run = recording([[1.1], [0.9], [1.1]])
    run.spin_rad_s[0, 0, 1] = 2.0
    before, _ = run.impact(ON_PLANE)
    assert before == Motion(pytest.approx(0.2), 0.0, -2.0)
    assert before.patch_m_s(run.contact(ON_PLANE)) == pytest.approx(-2.0)


def test_a_verdict_depends_on_the_error_and_on_the_reference() -> None:
    run = recording([[1.0]])
    rows = [(0.0, 2.0, 2.02), (1.0, 1.0, 1.1)]
    same = checks.compare(run, "force_n", checks.EXACT, rows, 0.02)
    assert [check.verdict for check in same] == ["pass", "fail"]
    assert [check.error for check in same] == pytest.approx([0.01, 0.05])
    other = checks.compare(run, "force_n", checks.COULOMB, rows, 0.02)
    assert [check.verdict for check in other] == ["agrees", "differs"]


def test_not_a_number_is_never_a_pass() -> None:
    (check,) = checks.compare(recording([[1.0]]), "f", checks.EXACT, [(0.0, 1.0, math.nan)], 1.0)
    assert check.verdict == "fail"


def test_the_summary_keeps_the_worst_point_and_a_failure_is_named(tmp_path: Path) -> None:
    rows = [(0.0, 2.0, 2.0), (7.0, 2.0, 2.2)]
    summary = summarise(checks.compare(recording([[1.0]]), "force_n", checks.EXACT, rows, 0.02))
    assert summary[["x", "points", "verdict"]].values.tolist() == [[7.0, 2, "fail"]]
    summary.to_parquet(tmp_path / "verification.parquet")
    with pytest.raises(RejectedRunError, match=r"elastic_plane, s on s, force_n: error 0\.1"):
        verdict(tmp_path)
    summary.assign(verdict="pass").to_parquet(tmp_path / "verification.parquet")
    assert verdict(tmp_path).startswith("1 pass, 0 fail")


def test_momentum_of_a_pair_counts_orbit_and_spin() -> None:
    run = recording([[0.0, 3.0], [0.0, 3.0]])
    run.velocity_m_s[:, 0, 0] = 1.0
    run.spin_rad_s[1, 1, 1] = 2.0
    linear, angular = checks.momenta(run, {"particle": 1, "partner": 2})
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
    speed, spin = checks.incline_reference(run, ON_PLANE)
    if rolls:
        assert speed == pytest.approx(5 / 7 * 10 * math.sin(angle))
        assert speed + spin == pytest.approx(0.0)
    else:
        assert speed == pytest.approx(10 * (math.sin(angle) - friction * math.cos(angle)))
        assert speed + spin > 0.0


def test_a_fitted_order_is_the_exponent() -> None:
    rows = [(10, 1e-2), (100, 1e-4), (1000, 1e-6)]
    assert checks.fitted_order(rows) == pytest.approx(2.0)


def test_published_curves_are_in_order_and_only_where_they_belong() -> None:
    curve = published("oblique_angle", "aluminium_oxide on rigid", "spin_rad_s")
    assert curve.spans(30.0)
    assert not curve.spans(89.0)
    assert curve.at(29.96) == pytest.approx(-616.5)
    assert len(published("oblique_angle", "no such", "spin_rad_s").x) == 0


def test_units_are_read_from_the_end_of_a_name() -> None:
    assert quantity("floor_force_n") == "floor force (N)"
    assert quantity("spin_up_rad_s2") == "spin up (rad/s²)"
    assert quantity("rebound_over_approach") == "rebound over approach"


def test_every_published_point_is_a_number() -> None:
    file = Path(checks.__file__).with_name("published.csv")
    table = pd.read_csv(file, comment="#")
    assert np.isfinite(table[["x", "y"]].to_numpy()).all()
    assert set(table["test"]) <= {*checks.QUANTITIES, "elastic_pair", "elastic_plane"}

"""Tables of the verification suite."""

import math
from pathlib import Path

import pytest
from recordings import recording

from dragdeck.errors import RejectedRunError
from evidence.verification import checks
from evidence.verification.report import published_spins, quantity, summarise, verdict


def test_the_summary_keeps_the_worst_point_and_a_failure_is_named(tmp_path: Path) -> None:
    rows = [(0.0, 2.0, 2.0), (7.0, 2.0, 2.2)]
    found = checks.compare(recording([[1.0]]), "force_n", checks.EXACT, rows, 0.02)
    summary = summarise(found)
    assert summary[["x", "points", "verdict"]].values.tolist() == [[7.0, 2, "fail"]]
    summary.to_parquet(tmp_path / "verification.parquet")
    with pytest.raises(RejectedRunError, match=r"elastic_plane, s on s, force_n: error 0\.1"):
        verdict(tmp_path)
    summary.assign(verdict="pass").to_parquet(tmp_path / "verification.parquet")
    assert verdict(tmp_path).startswith("1 pass, 0 fail")


def test_units_are_read_from_the_end_of_a_name() -> None:
    assert quantity("floor_force_n") == "floor force (N)"
    assert quantity("spin_up_rad_s2") == "spin up (rad/s²)"
    assert quantity("rebound_over_approach") == "rebound over approach"


def test_the_spins_of_two_published_tests_are_scaled_alike() -> None:
    """By hand: tan(angle) = 4 x 0.2 is 38.66 degrees, where the spin is about -555 rad/s."""
    fall = recording([[1.1], [0.9], [1.1]], series="aluminium_oxide on rigid", number=4)
    fall.velocity_m_s[0, 0] = (3.0, 0.0, -4.0)
    spins = published_spins([fall], [recording([[1.0]], series="steel_fem on rigid")])
    assert spins is not None
    assert spins.tangential == pytest.approx(-4.838, abs=1e-3)
    normal = 5.0 * math.cos(math.radians(38.66))
    assert spins.angle == pytest.approx(-554.5 / (0.2 * normal), rel=1e-3)
    assert published_spins(None, [fall]) is None

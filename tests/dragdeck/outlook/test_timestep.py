"""What is said of a time step before a run."""

import math
from typing import Any

import pytest
from made_study import Made

from dragdeck.cases.bed import particle_material, smallest_radius
from dragdeck.cases.case import Case
from dragdeck.cli import main
from dragdeck.outlook.measured import RestitutionErrors, stability_map
from dragdeck.outlook.timestep import expected_error, outlook, safe_fraction
from dragdeck.physics.contact_mechanics import effective_modulus, rayleigh_time
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.workpiece import workpiece_radius

TABLE = RestitutionErrors(
    steps_per_contact=[5.0, 50.0], worst=[3e-1, 3e-3], ordinary_worst=[1e-1, 1e-3]
)


@pytest.mark.parametrize(
    ("steps", "error", "inside"),
    [(5.0, 1e-1, True), (50.0, 1e-3, True), (math.sqrt(250.0), 1e-2, True), (2.0, 1e-1, False),
     (500.0, 1e-3, False)],
)  # fmt: skip
def test_errors_are_interpolated_on_logarithmic_scales(
    steps: float, error: float, inside: bool
) -> None:
    found = expected_error(steps, 0.9, TABLE)
    assert found.value == pytest.approx(error, rel=1e-9)
    assert found.measured is inside
    assert expected_error(steps, 0.2, TABLE).value == pytest.approx(3 * error, rel=1e-9)


def test_the_measured_table_is_of_a_real_map() -> None:
    known = stability_map()
    steps = known.restitution_error.steps_per_contact
    assert list(steps) == sorted(steps) and len(steps) == len(known.restitution_error.worst)
    assert known.engine_versions and known.measured
    for row in known.regimes.values():
        assert row.ordinary_fraction is not None
        assert 0 < row.safe_fraction <= row.ordinary_fraction
    assert 0 < known.safety_factor < 1


def test_unlike_bodies_are_looked_at_too(case: Case) -> None:
    pairs = {pair.bodies: pair for pair in outlook(case, PROCESS, 1e-5)}
    assert set(pairs) == {"particle on particle", "particle on bowl", "particle on workpiece"}
    smallest = rayleigh_time(particle_material(case.study), smallest_radius(case.study), 1e-3)
    assert pairs["particle on workpiece"].limiting == "particle"
    assert pairs["particle on workpiece"].rayleigh_fraction == pytest.approx(
        1e-5 / smallest, rel=1e-12
    )
    # Johnson 1985, eq. 11.24: a plane doubles m and R, and steel is stiffer
    ceramic, steel = (case.study.materials[name] for name in ("ceramic", "steel"))
    stiffer = effective_modulus(ceramic, steel) / effective_modulus(ceramic, ceramic)
    ratio = (
        pairs["particle on bowl"].steps_per_contact
        / pairs["particle on particle"].steps_per_contact
    )
    assert ratio == pytest.approx((2**2 / 2 / stiffer**2) ** 0.2, rel=1e-12)


def test_the_body_with_the_smaller_rayleigh_time_limits(small: dict[str, Any], made: Made) -> None:
    """A stiff, light and thin workpiece is faster than a particle."""
    small["workpiece"] = {
        "material": "light",
        "shape": {"kind": "cylinder", "radius_m": 0.0005, "facet_size_m": 0.0005},
    }
    small["materials"]["light"] = {
        "youngs_modulus_pa": 300e9, "poissons_ratio": 0.2, "density_kg_m3": 1000,
    }  # fmt: skip
    case = made({"pairs.ceramic-light": {"restitution": 0.6, "friction": 0.3}})
    (workpiece,) = [
        pair for pair in outlook(case, PROCESS, 1e-6) if pair.bodies == "particle on workpiece"
    ]
    known = rayleigh_time(case.study.materials["light"], workpiece_radius(case), 1e-3)
    assert workpiece.limiting == "workpiece"
    assert workpiece.rayleigh_fraction == pytest.approx(1e-6 / known, rel=1e-12)


def test_strong_damping_has_its_own_safe_step(made: Made) -> None:
    case = made()
    ordinary, _ = safe_fraction(case, FILLING)
    damped = made({"pairs.ceramic-steel.restitution": 0.1})
    assert safe_fraction(damped, FILLING)[0] < ordinary


@pytest.mark.engine
def test_check_says_what_the_step_means(
    case: Case,
    project: Project,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(project.root)
    assert main(["check", "small", "--verbose"]) == 0
    said = capsys.readouterr().out
    assert "particle on workpiece: " in said and "particle on plate: " in said
    assert "error of restitution up to" in said

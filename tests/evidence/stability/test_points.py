"""The points of the map, what is run for each, and how it ended."""

import json
from pathlib import Path

import pytest
from made_run import run_json
from paths import ROOT

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.scenes.filling import filling_scene
from dragdeck.sweep.cases import load_cases
from evidence.stability.measures import PointRun
from evidence.stability.points import REGIMES, load_points
from evidence.stability.runs import point_case
from evidence.stability.scenes import ImpactSettings, impact_scene

MAP = ROOT / "studies" / "stability" / "map.yaml"


def test_points_are_named_once_and_each_condition_has_its_reference() -> None:
    for regime in REGIMES:
        points = load_points(MAP, regime)
        names = [point.name for point in points]
        assert len(set(names)) == len(names)
        conditions = {point.condition for point in points}
        assert {point.condition for point in points if point.reference} == conditions
        assert sum(point.reference for point in points) == len(conditions)


def test_an_unknown_setting_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "map.yaml"
    file.write_text(
        "settle:\n  base: {restitution: 0.5}\n  vary: {timestep_fraction: [1]}\n"
        "  reference: {with: {timestep_fraction: 0.1}}\n  points: [{one_by_one: {colour: [1]}}]\n"
    )
    with pytest.raises(InputError, match="colour is not among"):
        load_points(file, "settle")
    with pytest.raises(InputError, match="no such design"):
        load_points(file, "drag")
    file.write_text(file.read_text().replace("colour: [1]", "restitution: [high]"))
    with pytest.raises(InputError, match=r"map\.yaml.*restitution"):
        load_points(file, "settle")


@pytest.fixture
def base() -> Case:
    (case,) = load_cases(ROOT / "studies" / "stability" / "study.yaml")
    return case


def test_a_point_sets_its_values(base: Case) -> None:
    settings = {
        "youngs_modulus_pa": 5e6, "restitution": 0.3, "friction": 2.0, "workpiece_speed_m_s": 1.0,
    }  # fmt: skip
    study = point_case(base, settings, 4.0).study
    assert {(pair.restitution, pair.friction) for pair in study.pairs.values()} == {(0.3, 2.0)}
    fidelity = study.chosen_fidelity()
    assert fidelity.youngs_modulus_scale * 77e9 == pytest.approx(5e6)
    assert fidelity.timestep_fraction == fidelity.filling_timestep_fraction == 4.0
    assert study.motion.speed_m_s == 1.0
    assert study.motion.path.revolutions == 2.0  # type: ignore[union-attr]


def test_like_particles_have_half_the_modulus_of_one(base: Case) -> None:
    """E* = E / (2 (1 - nu^2)) and G* = G / (2 (2 - nu)) of two like bodies."""
    particle = filling_scene(base).case.contact_moduli["particle"]
    young, nu = 77e9 * 1e-3, 0.19
    assert particle.modulus_pa == pytest.approx(young / (2 * (1 - nu**2)), rel=1e-12)
    shear = young / (2 * (1 + nu))
    assert particle.shear_pa == pytest.approx(shear / (2 * (2 - nu)), rel=1e-12)


def impact(speed_m_s: float, size_ratio: float) -> ImpactSettings:
    """An impact along the normal."""
    return ImpactSettings(speed_m_s=speed_m_s, angle_deg=0.0, size_ratio=size_ratio)


def test_a_large_particle_is_almost_a_plate() -> None:
    def body(size_ratio: float) -> tuple[float, float]:
        return impact(1.0, size_ratio).effective_body(1.0, 1.0)

    radius, mass = body(100.0)
    assert radius == pytest.approx(100 / 101) and mass == pytest.approx(1.0, rel=1e-5)
    assert body(0.0) == (1.0, 1.0)
    assert body(1.0) == (0.5, 0.5)


def test_impacts_begin_at_different_moments_of_a_step(base: Case) -> None:
    settings = {"youngs_modulus_pa": 77e9, "restitution": 0.86, "friction": 0.34}
    scene = impact_scene(point_case(base, settings, 0.2), "a-run", impact(0.5, 0.0), 0.2)
    rows = scene.files["particles.data"]().split("Atoms\n\n")[1].split("\n\n")[0].splitlines()
    radius = base.study.media.radius_mean_m
    gaps = [float(row.split()[-1]) - radius for row in rows]
    step = 0.5 * scene.deck.timestep_s
    phases = sorted(gap / step - 1 for gap in gaps)
    assert phases == pytest.approx([(n + 0.5) / 16 for n in range(16)], abs=1e-6)


# --- how the runs of points end ------------------------------------------------------------------


def ended(run: PointRun, state: str, *failed: str) -> PointRun:
    """The same point, its run ended."""
    checks = [
        {"code": code, "name": code, "passed": False, "seen": "", "limit": ""} for code in failed
    ]
    run.folder.mkdir(parents=True, exist_ok=True)
    record = run_json(state=state, checks=checks)
    (run.folder / "state.json").write_text(json.dumps(record))
    return PointRun(run.point, run.folder)


def test_a_run_counts_if_it_ended(tmp_path: Path) -> None:
    run = PointRun(load_points(MAP, "settle")[0], tmp_path)
    assert run.record is None and not run.measurable
    assert ended(run, "complete").measurable
    assert ended(run, "failed", "stable_timestep").measurable
    assert not ended(run, "failed", "stable_timestep", "at_rest").measurable

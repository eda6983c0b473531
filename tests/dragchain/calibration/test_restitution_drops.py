"""The drops of a calibration, and the recovery of a known restitution on the real engine."""

from dataclasses import replace
from typing import Any

import pytest
from made_study import Made

from dragchain.calibration.drops import Drop, confirmation, drop_case, full, production, sweep
from dragchain.calibration.fit import calibrate
from dragchain.calibration.measured_impacts import measure_impacts
from dragchain.calibration.report import FittedRecord, write_calibration_report
from dragchain.calibration.results import confirmed, result
from dragchain.calibration.simulated_drops import Drops, run_drops
from dragdeck.cases.case import Case
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import silent
from dragdeck.errors import InputError
from dragdeck.physics.contact_mechanics import fall_time, hertz_contact_time, rayleigh_time
from dragdeck.project import Project
from dragdeck.scenes.drop_test import DROP_TEST, DropFidelity, drop_scene
from dragdeck.study.calibration import measurements
from dragdeck.study.force_record import read_record
from evidence.drop_record import Sensor, synthetic_record


@pytest.fixture
def measured_case(small: dict[str, Any], made: Made) -> Case:
    """The small study with a measured drop test, at a modulus and step of its own."""
    small["calibration"] = {"record": "record.csv"}
    small["fidelities"]["quick"].update(youngs_modulus_scale=0.01, timestep_fraction=0.5)
    return made()


# --- which drops -----------------------------------------------------------------------------


def test_the_default_drop_is_at_full_modulus_and_the_studys_step(case: Case) -> None:
    scene = drop_scene(case)
    assert scene.deck == drop_scene(case, DropFidelity()).deck
    assert scene.case.fidelity.youngs_modulus_scale == 1.0
    ratio = scene.deck.timestep_s / scene.case.rayleigh_time_s
    assert ratio == pytest.approx(case.study.drop_test.timestep_fraction, rel=1e-3)


def test_a_drop_can_run_as_the_process_does(measured_case: Case) -> None:
    chosen = measured_case.study.chosen_fidelity()
    coarse = production(measured_case.study)
    scene = drop_scene(measured_case, coarse)
    assert scene.deck.materials.youngs_moduli_pa[0] == pytest.approx(77e9 * 0.01)
    assert scene.deck.timestep_s == coarse.timestep_s
    # of the mean particle, a little larger than the smallest, which sets the step
    assert scene.deck.timestep_s < chosen.timestep_fraction * scene.case.rayleigh_time_s
    particle = measured_case.study.materials["ceramic"]
    assert scene.case.rayleigh_time_s == pytest.approx(10 * rayleigh_time(particle, 3.27e-3))


def test_softer_particles_touch_for_longer(measured_case: Case) -> None:
    """Hertz: with the modulus to the power of -2/5."""
    hard = drop_scene(measured_case, DropFidelity(1.0, 1e-7)).deck.impact_steps  # type: ignore[attr-defined]
    soft = drop_scene(measured_case, DropFidelity(0.01, 1e-7)).deck.impact_steps  # type: ignore[attr-defined]
    wanted = hertz_contact_time(1, 1, 0.01, 1) / hertz_contact_time(1, 1, 1.0, 1)
    assert soft / hard == pytest.approx(wanted, rel=0.02)


def test_the_sweep_covers_values_and_phases(measured_case: Case) -> None:
    drops = list(sweep(measured_case.study))
    assert len({drop.name for drop in drops}) == len(drops)
    for purpose in ("production", "reference"):
        values = {drop.restitution for drop in drops if drop.purpose == purpose}
        assert (min(values), max(values), len(values)) == (0.4, 1.0, 13)
    heights = {drop.height_m for drop in drops if drop.purpose == "production"}
    path = 0.4429 * (production(measured_case.study).timestep_s or 0.0)
    assert max(heights) - min(heights) == pytest.approx(0.75 * path, rel=1e-3)


def test_a_drop_changes_only_what_it_says(measured_case: Case) -> None:
    drop = Drop("x", "reference", 0.8, 0.011, DropFidelity())
    changed = drop_case(measured_case, drop).study
    assert changed.pair("ceramic", "steel").restitution == 0.8
    assert changed.pair("ceramic", "ceramic") == measured_case.study.pair("ceramic", "ceramic")
    assert changed.drop_test.height_m == 0.011
    assert changed.materials == measured_case.study.materials


def test_a_calibration_does_not_rename_any_run(case: Case, measured_case: Case) -> None:
    assert DROP_TEST.run_id(case) == DROP_TEST.run_id(measured_case)


def test_a_study_without_a_record_is_told_so(case: Case) -> None:
    with pytest.raises(InputError, match="has no measured drop test and no measured angle"):
        measurements(case.study.calibration, case.file)


# --- the real engine -------------------------------------------------------------------------


def short_sweep(case: Case) -> list[Drop]:
    """A sweep of seven values: enough for the fit, seconds to run."""
    coarse, fine = production(case.study), full(case.study, 0.04)
    drops = []
    for value in (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0):
        for phase in (0, 1):
            name, height = f"p-{value}-{phase}", 0.010 + 3e-6 * phase
            drops.append(Drop(name, "production", value, height, coarse))
        drops.append(Drop(f"r-{value}", "reference", value, 0.010 + 1e-8 * value, fine))
    return drops


@pytest.mark.engine
@pytest.mark.slow
def test_a_known_restitution_is_recovered(measured_case: Case, project: Project) -> None:
    """Two drops at another step and height, as noisy records: in the stated intervals.

    And the whole way from a CSV to the page.
    """
    case, folder = measured_case, project.root / "calibration"
    templates = environment(project.templates)

    def run(drops: list[Drop], name: str) -> Drops:
        return run_drops(case, drops, Batch(folder / name, templates), silent)

    swept = run(short_sweep(case), "sweep")
    known = [
        Drop(f"trial-{k}", "reference", value, height, full(case.study, 0.02))
        for k, (value, height) in enumerate([(0.68, 0.01008), (0.86, 0.00995)])
    ]
    production_model, fits = swept.production, []
    for drop, truth in zip(known, run(known, "trials").runs, strict=True):
        file = folder / f"{drop.name}.csv"
        file.write_text(
            synthetic_record(replace(swept, runs=(truth,)), Sensor(500e3, 0.1, 3.0, 0.5, 0.01), 7)
        )
        record = read_record(file)
        got = calibrate(measure_impacts(record, fall_time_s=fall_time(0.010, 9.81)), swept)
        fits.append((record, got))
        full_fit = got.fit_reference
        assert full_fit.ci95_low <= drop.restitution <= full_fit.ci95_high
        low, high = (production_model.rebound(e) for e in (got.fit.ci95_low, got.fit.ci95_high))
        assert low < truth.effective < high
        assert got.fit_reference.height_m == pytest.approx(drop.height_m, abs=2e-5)

    (record, got), _ = fits
    calibration = result(got)
    values = (calibration.fit.restitution, calibration.fit_full.restitution)
    confirming = run(list(confirmation(case.study, *values))[::2], "confirm")
    checked = confirmed(confirming)
    assert checked["effective"] == pytest.approx(calibration.measured.value, abs=4 * checked["std"])
    write_calibration_report(folder, FittedRecord(record, got, confirming), None)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert f"<b>{calibration.put:.4g}</b>" in page
    assert page.count("data:image/") == 1
    assert "http" not in page

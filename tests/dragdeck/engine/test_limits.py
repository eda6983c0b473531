"""Limits that a healthy run never meets, and what is said of a run that did."""

import re
from pathlib import Path

import pytest
from made_study import Made
from run_files import rewrite

from dragdeck.cases.case import Case
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.log import Sample, breach, thermo_samples, within
from dragdeck.engine.run_folder import run
from dragdeck.errors import RejectedRunError
from dragdeck.physics.packing import Bed
from dragdeck.physics.run_limits import ENERGY_FACTOR, SPEED_FACTOR, run_limits
from dragdeck.project import Project
from dragdeck.records.run import RunRecord
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.process import process_scene

COLUMNS = ["step", "time_s", "n_particles"]
COLUMNS += ["kinetic_energy_j", "rotational_energy_j", "fastest_particle_m_s"]
LIMITS = run_limits(particles=10, mass_kg=1e-3, gravity_m_s2=10.0, height_m=0.5, speed_m_s=2.0)


def test_the_energy_limit_is_that_of_a_fall_and_a_push() -> None:
    """m g H + m v^2 / 2 = 5 mJ + 2 mJ."""
    assert LIMITS.mean_kinetic_energy_j == pytest.approx(ENERGY_FACTOR * 7e-3, rel=1e-12)


def test_the_speed_limit_is_that_of_the_same_energy() -> None:
    """Square root of 2 (g H + v^2 / 2) = sqrt(14) m/s."""
    assert LIMITS.speed_m_s == pytest.approx(SPEED_FACTOR * 14**0.5, rel=1e-12)


def samples(*rows: str) -> list[Sample]:
    return thermo_samples(rows, COLUMNS)


def test_a_calm_run_meets_no_limit() -> None:
    assert breach(samples("10 0.1 10 0.2 0.07 1.0"), LIMITS) is None
    assert within(LIMITS).passed


@pytest.mark.parametrize(
    ("row", "reason", "said"),
    [
        (
            "20 0.2 10 0.2 0.09 1.0",
            "energy",
            "a mean kinetic energy of 0.029 J per particle at step 20",
        ),
        ("20 0.2 10 0.2 0.01 15.0", "speed", "a particle at 15 m/s at step 20"),
        ("20 0.2 9 0.1 0.0 1.0", "particles", "9 particles at step 20"),
        ("20 0.2 10 nan 0.0 1.0", "finite_numbers", "a kinetic energy of nan at step 20"),
        ("20 0.2 10 inf 0.0 1.0", "finite_numbers", "a kinetic energy of inf at step 20"),
        ("20 0.2 0 0.0 0.0 1.0", "particles", "0 particles at step 20"),
    ],
)
def test_the_first_row_past_a_limit_is_named(row: str, reason: str, said: str) -> None:
    check = breach(samples("10 0.1 10 0.1 0.0 1.0", row, "30 0.3 1 9.0 9.0 1.0"), LIMITS)
    assert check is not None and not check.passed
    assert (check.code, check.reason, check.seen) == ("within_limits", reason, said)


def test_rows_that_are_not_whole_yet_are_left_alone() -> None:
    assert samples("step time_s n_particles", "10 0.1 10 0.1", "20 0.2 10 0.1 0.0e", "") == []


def test_every_bed_has_limits_above_what_it_starts_with(case: Case) -> None:
    filling = filling_scene(case).case.limits
    process = process_scene(case, Bed(0.04, 0.045)).case.limits
    assert filling.n_particles == process.n_particles == case.study.media.count
    mass = 4 / 3 * 3.14159 * 3.27e-3**3 * 2656
    assert filling.mean_kinetic_energy_j > process.mean_kinetic_energy_j > mass * 9.81 * 0.1


@pytest.fixture
def unstable(project: Project, made: Made) -> Path:
    """A rendered fill with three times the Rayleigh time as its step."""
    case = made()
    folder = project.run_folder(case, FILLING)
    scene = filling_scene(case)
    write_run(scene, folder, environment(project.templates))
    deck = folder / "in.liggghts"
    step = f"timestep {scene.deck.timestep_s!r}\n"
    assert step in deck.read_text()
    unstable = f"timestep {3 * scene.case.rayleigh_time_s!r}\n"
    rewrite(deck, deck.read_text().replace(step, unstable))
    return folder


def state(folder: Path) -> RunRecord:
    return RunRecord.read(folder / "state.json")


def failed_checks(folder: Path) -> dict[str, str | None]:
    """Reasons of the checks that did not pass, by their code."""
    return {check.code: check.reason for check in state(folder).checks if not check.passed}


@pytest.mark.engine
def test_an_unstable_run_is_stopped_early_with_the_reason(unstable: Path) -> None:
    """LIGGGHTS ignores lost particles and has no end: nothing but the watch can end the run."""
    deck = unstable / "in.liggghts"
    assert "thermo_modify lost error" in deck.read_text()
    endless = deck.read_text().replace("lost error", "lost ignore")
    endless, changed = re.subn(r"(?m)^(if .* then )?\"?run .*$", "run 2000000000", endless, count=1)
    assert changed == 1
    rewrite(deck, endless)
    with pytest.raises(
        RejectedRunError, match=r"energy and speed within limits: .* at step .*limit: "
    ):
        run(unstable, lambda line: None)
    assert state(unstable).state == "failed"
    assert list(failed_checks(unstable)) == ["within_limits"]
    assert state(unstable).stopped_early
    assert not (unstable / "run.json").exists()


@pytest.mark.engine
def test_spheres_that_only_spin_rest(project: Project, made: Made) -> None:
    """Without friction about the normal of a contact, nothing ends a spin about the vertical."""
    case = made({"media.count": 9, "media.fill_height_m": None})
    folder = project.run_folder(case, FILLING)
    write_run(filling_scene(case), folder, environment(project.templates))
    particles = folder / "particles.data"
    falling, spinning = r"(?m)^(\d+) \S+ \S+ \S+ 0.0 0.0 0.0$", r"\1 0.0 0.0 0.0 0.0 0.0 100.0"
    rewrite(particles, re.sub(falling, spinning, particles.read_text()))
    run(folder, lambda line: None)
    last = thermo_samples((folder / "thermo.1.txt").read_text().splitlines()[1:], COLUMNS)[-1]
    deck = filling_scene(case).deck
    assert last.rotational_energy_j > 100 * deck.energy_ratio * deck.energy_unit_j

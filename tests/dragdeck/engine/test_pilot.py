"""The study of 100,000 particles: all that can be said of it without running it."""

import numpy as np
import pytest
from paths import ROOT
from scipy.spatial import cKDTree

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.outlook.process import bed_notes
from dragdeck.project import Project
from dragdeck.scenes.filling import expected_surface, filling_scene, first_particles
from dragdeck.scenes.process import process_scene

COUNT = 100_000


@pytest.fixture(scope="module")
def pilot() -> Case:
    (case,) = Project(ROOT).cases("pilot")
    return case


def test_the_bowl_is_flat_and_deep_enough_for_the_workpiece(pilot: Case) -> None:
    study = pilot.study
    surface = expected_surface(study)
    assert surface < study.bowl.radius_m
    assert study.motion.immersion_depth_m < surface - 2 * study.media.radius_mean_m
    assert surface < study.bowl.height_m


def test_every_particle_is_placed_and_touches_nothing(pilot: Case) -> None:
    particles = first_particles(pilot.study)
    x, y, z = particles.positions_m.T
    assert len(particles.radii_m) == COUNT
    assert (np.hypot(x, y) + particles.radii_m).max() < pilot.study.bowl.radius_m
    assert (z - particles.radii_m).min() > 0
    pairs = cKDTree(particles.positions_m).query_pairs(
        2 * particles.radii_m.max(), output_type="ndarray"
    )
    gaps = np.linalg.norm(np.diff(particles.positions_m[pairs], axis=1)[:, 0], axis=1)
    assert (gaps > particles.radii_m[pairs].sum(axis=1)).all()


def test_the_decks_are_written_without_a_warning(pilot: Case) -> None:
    templates = environment(Project(ROOT).templates)
    filling, process = filling_scene(pilot), process_scene(pilot)
    assert list(filling.warnings) == list(process.warnings) == []
    assert f"\n{COUNT} atoms\n" in filling.files["particles.data"]()
    assert "processors * * 1" in deck_text(filling, templates)
    assert "fix move_drag" in deck_text(process, templates)
    assert "within" in dict(bed_notes(pilot))["overlap"]


def test_what_is_assumed_is_marked(pilot: Case) -> None:
    marked = {entry.field for entry in pilot.study.assumptions}
    sizes = {"media.count", "bowl.radius_m", "bowl.height_m", "motion.path.radius_m"}
    assert sizes | {"workpiece.shape.radius_m", "motion.speed_m_s"} <= marked

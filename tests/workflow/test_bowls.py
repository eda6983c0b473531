"""Bowls on LIGGGHTS: particles rest between the walls; a run is resumed, on two ranks."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bowl_runs import accepted, process_of
from bowls import OWN_BOWL, SMALL_BOWLS
from made_study import put
from paths import SMALL_STUDY
from plate import engine

from dragchain import read_dump, write_tables
from dragchain.tables.by_step import read_table
from dragchain.tables.run_folder import Run

pytestmark = [pytest.mark.engine, pytest.mark.slow]

FAST = {"motion.plunge_speed_m_s": 0.5, "motion.approach_speed_m_s": 0.5, "motion.speed_m_s": 0.1}


EVERY_BOWL = {**SMALL_BOWLS, "mesh": OWN_BOWL}


@pytest.fixture(scope="module", params=EVERY_BOWL)
def finished(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The process of a bowl, beside its filling."""
    folder = tmp_path_factory.mktemp("project")
    study: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    put(study, {**deepcopy(EVERY_BOWL[request.param]), **FAST})
    study["motion"]["immersion_depth_m"] = 0.010
    process = process_of(folder, study)
    engine(process)  # which keeps the checkpoints
    write_tables(process)
    return process


def test_the_run_is_accepted(finished: Path) -> None:
    accepted(finished)


def test_particles_rest_between_the_walls(finished: Path) -> None:
    opened = Run.open(finished)
    filling = finished.parents[1] / "filling" / opened.case.upstream["filling"]
    for folder in (filling, finished):
        particles = read_table(
            folder / "tables/particles.parquet", ["x_m", "y_m", "z_m", "radius_m"]
        )
        centre, radius = particles[["x_m", "y_m", "z_m"]].to_numpy(), particles["radius_m"]
        for wall in opened.case.bowl.walls:
            least = 0.95 if folder == filling else 0.0  # in the drag, particles may jam
            assert (wall.contacts(centre)[0] > least * radius).all()
    packing = json.loads((filling / "tables/packing.json").read_text())
    assert 0.45 < packing["solid_fraction"] < 0.64
    assert packing["kinetic_energy_ratio"] < 1e-5


def test_every_wall_carries_its_part(finished: Path) -> None:
    """Floor and workpiece carry the weight; sides push inwards, each at its own contacts."""
    case = Run.open(finished).case
    contacts = read_table(finished / "tables/contacts.parquet")
    sides = contacts[contacts["kind"] == "particle-side"]
    point = sides[["point_x_m", "point_y_m", "point_z_m"]].to_numpy()
    gaps = np.abs([wall.contacts(point)[0] for wall in case.bowl.walls])
    assert gaps.min(axis=0).max() < 1e-4
    upright = [wall for wall in case.bowl.walls if wall.upright]
    touched = {case.bowl.walls[at].name for at in gaps.argmin(axis=0)}
    assert {wall.name for wall in upright} <= touched
    floor = contacts[contacts["kind"] == "particle-floor"]
    assert floor.size and (case.bowl.rim or floor["point_z_m"].abs().max() < 1e-4)
    assert (contacts["normal_force_n"] > 0).mean() > 0.99


def test_a_resumed_run_goes_on(finished: Path) -> None:
    """On two ranks; particles are where those of the whole run are, or near."""
    names = ["step", "particle_id", "x_m", "y_m", "z_m"]
    whole = read_table(finished / "tables/particles.parquet", names)
    last = whole[whole["step"] == whole["step"].max()].set_index("particle_id")
    kept = (int(file.name.split(".")[1]) for file in finished.glob("checkpoint.*.restart"))
    *_, before, _ = sorted(step for step in kept if step < whole["step"].max())
    columns = Run.open(finished).outputs["particles"].columns
    engine(finished, ranks=2, part=2, source=finished / f"checkpoint.{before}.restart")
    *_, frame = read_dump(finished / "particles.2.bin", columns)
    assert frame.step == last["step"].iloc[0] and frame.rows == len(last)
    centre = frame.by_particle().centres
    moved = np.linalg.norm(centre - last.sort_index()[["x_m", "y_m", "z_m"]].to_numpy(), axis=1)
    assert np.median(moved) < 1e-5
    for wall in Run.open(finished).case.bowl.walls:
        assert (wall.contacts(centre)[0] > 0.9 * frame.by_particle().radii).all()

"""Removal by one particle on LIGGGHTS is that of its law."""

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from made_run import line, with_motion
from plate import GRAVITY, MASS, RADIUS, engine, write_plate

from dragchain import write_tables
from dragchain.loading.wear import Wear
from dragchain.loading.write import compute_loading
from dragdeck.decks import outputs
from dragdeck.study.drive import Drive

pytestmark = pytest.mark.engine

STEPS, SPEED = 200, 0.1


def worn(folder: Path, timestep_s: float, law: dict[str, Any], **particle: Any) -> Wear:
    """What a law of removal reads of a particle on a plate that moves along +x."""
    drag = Drive(0, STEPS, timestep_s, length_m=SPEED * STEPS * timestep_s)
    written = [
        outputs.workpiece_force(1, STEPS, "workpiece"),
        outputs.workpiece_particles(1, 0, STEPS),
        outputs.workpiece_contacts(1, 0, STEPS, several=False),
        *outputs.first_touch(0, STEPS, several=False),
    ]
    made = write_plate(folder, None, drag, outputs.in_writing_order(written), **particle)
    made["study"]["removal"] = {"coefficient_m2_n": 1e-12, **law}
    made = with_motion(made, **line(SPEED))
    (folder / "case.json").write_text(json.dumps(made))
    engine(folder)
    write_tables(folder)
    particles = pd.DataFrame({"step": [0], "particle_id": [1], "radius_m": [RADIUS]})
    particles.to_parquet(folder / "tables/particles.parquet")
    found = compute_loading(folder).wear
    assert found is not None
    return found


def test_sliding_removes_force_times_distance(tmp_path: Path) -> None:
    """Its weight, at the speed of the plate: friction of 1e-5 hardly accelerates it."""
    found = worn(tmp_path, 1e-6, {"law": "archard"}, friction=1e-5)
    assert found.action_w.value == pytest.approx(MASS * GRAVITY * SPEED, rel=1e-6)


@pytest.mark.parametrize("degrees", [15.0, 60.0])
def test_an_impact_removes_what_the_law_says_of_its_angle_and_speed(
    tmp_path: Path, degrees: float
) -> None:
    """Elastic, and at so small a step that it is hardly slowed within that of first touch."""
    speed, angle, timestep, hardness = 0.4, math.radians(degrees), 1e-8, 2.0
    across, down = SPEED + speed * math.cos(angle), speed * math.sin(angle)
    found = worn(
        tmp_path, timestep, {"law": "oka", "hardness_pa": hardness * 1e9}, restitution=1.0,
        gravity=0.0, height_m=50.5 * timestep * down, velocity=(across, 0.0, -down),
    )  # fmt: skip
    sine = math.sin(angle)
    volume = MASS * speed**2 * (speed / 104) ** (2.3 * hardness**0.038 - 2)
    volume *= (2 * RADIUS / 326e-6) ** 0.19 * sine ** (0.71 * hardness**0.14)
    volume *= (1 + hardness * (1 - sine)) ** (2.4 * hardness**-0.94)
    assert found.touches is not None and found.touches.events == 1
    seconds = found.touches.time_s
    assert found.action_w.value * seconds == pytest.approx(volume, rel=1e-6)
    assert found.touches.quantities["impact_angle_rad"].p50 == pytest.approx(angle, rel=1e-6)

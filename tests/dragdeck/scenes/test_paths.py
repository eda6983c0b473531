"""Paths of the workpiece: a workpiece at rest in a rotating bowl."""

import math
from typing import Any

import pytest
from made_scenes import BED, script
from made_study import Made

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook.process import workpiece_notes
from dragdeck.project import Project
from dragdeck.scenes.fit import fastest_motion
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process import process_scene

REST = {"kind": "rest", "radius_m": 0.01, "bowl_rpm": -30, "revolutions": 0.5}
RATE = 30 * 2 * math.pi / 60


def test_the_bowl_rotates_and_the_workpiece_does_not_move(moved: Made, project: Project) -> None:
    case = moved(path=REST)
    scene, text = process_scene(case, BED), script(case, project)
    (bowl,) = [line for line in text.splitlines() if line.startswith("fix bowl ")]
    assert bowl.startswith("fix bowl all mesh/surface file bowl.stl type 2 surface_ang_vel origin")
    rate = float(bowl.split()[-1])
    assert rate == pytest.approx(-RATE, rel=1e-4)
    assert "move_plunge" in text and "move_drag" not in text
    assert "bowl.stl" in scene.files
    drag = scene.case.phases[-1]
    seconds = (drag.end_step - drag.start_step) * scene.case.timestep_s
    assert -rate * seconds == pytest.approx(math.pi, rel=1e-12)  # half a revolution
    made = scene.case.model_dump(mode="json")
    assert made["motion"]["bowl_rad_s"] == rate
    assert made["motion"]["start_direction_rad"] == pytest.approx(math.pi / 2)
    assert made["motion"]["axis_speed_m_s"] == pytest.approx(-0.01 * rate)
    assert made["bowl"]["meshed"]
    assert drag.start_step < made["steady"]["from_step"] < drag.end_step


def test_a_bowl_that_stands_still_leaves_no_trace(case: Case, project: Project) -> None:
    scene = process_scene(case, BED)
    assert "surface_ang_vel" not in script(case, project)
    assert "steady" not in scene.case.model_dump(mode="json")
    assert "bowl_froude_number" not in describe(case)


def test_speed_factor_and_pace_rotate_the_bowl_faster(moved: Made) -> None:
    case = moved({"speed_factor": 4}, path=REST)
    made = process_scene(case, BED).case.model_dump(mode="json")
    assert made["motion"]["bowl_rad_s"] == pytest.approx(-4 * RATE, rel=1e-3)
    assert fastest_motion(case) >= 4 * RATE * case.study.bowl.radius_m
    assert case.study.motion.at(2.0, 0.02).bowl_rad_s == pytest.approx(-2 * RATE)


def test_the_froude_number_is_that_of_the_wall(moved: Made) -> None:
    case = moved(path=REST)
    wall = RATE**2 * case.study.bowl.radius_m / case.study.gravity_m_s2
    assert describe(case)["bowl_froude_number"] == pytest.approx(wall)
    assert "30 1/min, clockwise" in dict(workpiece_notes(case))["rotation of the bowl"]


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"speed_m_s": 0.01}, "are both given: remove speed_m_s"),
        ({"path": REST | {"bowl_rpm": 0}}, "the bowl must rotate"),
        ({"path": {"kind": "circle", "radius_m": 0.01}, "speed_m_s": None}, "speed_m_s is missing"),
        ({"path": REST | {"radius_m": 0.2}}, "does not fit between its path and the bowl"),
    ],
)
def test_bad_input_is_named(moved: Made, changed: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        process_scene(moved(**{"path": REST, **changed}), BED)

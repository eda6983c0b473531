"""Where the workpiece goes: the motion in whole steps, which deck, checks and preview share."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_scenes import BED
from made_study import Made

from dragchain.run.kinematics import (
    axis_speed,
    counted_mask,
    drag_phase,
    headings,
    workpiece_rotation,
    workpiece_velocity,
)
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.outputs import ColumnsFile, load_outputs
from dragdeck.errors import InputError
from dragdeck.preview.layout import layout
from dragdeck.records.case import CaseOfRun as ReadCase
from dragdeck.records.case import load_case
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.motion import course
from dragdeck.scenes.process import process_scene
from dragdeck.study.check import warnings

CIRCLE = {"kind": "circle", "radius_m": 0.010, "revolutions": 0.1}
LINE = {"kind": "line", "start_m": [-0.008, 0.005], "direction_deg": 30, "length_m": 0.0123}
REST = {"kind": "rest", "radius_m": 0.010, "bowl_rpm": -30, "revolutions": 0.3}
POINTS = [[2, 0.001, 0], [2.2, 0.006, 0.002], [2.3, 0.006, 0.002], [2.7, 0.001, 0.003, -0.002]]
WAYPOINTS = {"kind": "waypoints", "points": POINTS}
SPIN = {"schedule": [{"until_s": 0.123, "rpm": 200}, {"until_s": 9, "rpm": -300}]}
OSCILLATION = {"amplitude_m": 1e-3, "frequency_hz": 7}


def last_place(case: Case) -> tuple[float, ...]:
    """Where the course has the workpiece after its last step; nothing is superposed."""
    way = course(case.study, BED)
    leg = way.legs[-1]
    assert way.drag.end == leg.end_step
    place, _ = way.poses(leg, np.array([leg.steps]))
    return tuple(place[0].tolist())


def path_end(path: dict[str, Any], tip_m: float) -> tuple[float, float, float]:
    """Where a path ends, from its fields alone."""
    if path["kind"] == "rest":
        return path["radius_m"], 0.0, tip_m
    if path["kind"] == "circle":
        sign = -1 if path.get("direction") == "cw" else 1
        angle = math.radians(path.get("start_deg", 0)) + sign * math.tau * path["revolutions"]
        return path["radius_m"] * math.cos(angle), path["radius_m"] * math.sin(angle), tip_m
    if path["kind"] == "line":
        (x, y), heading = path["start_m"], math.radians(path["direction_deg"])
        way = path["length_m"]
        return x + way * math.cos(heading), y + way * math.sin(heading), tip_m
    points = [[*point, 0.0][:4] for point in path["points"]]
    time = path.get("fraction", 1.0) * (points[-1][0] - points[0][0]) + points[0][0]
    x, y, z = (np.interp(time, *np.array(points)[:, [0, axis]].T) for axis in (1, 2, 3))
    return float(x), float(y), tip_m + float(z)


PATHS = [
    CIRCLE,
    CIRCLE | {"direction": "cw", "start_deg": 40, "revolutions": 0.513},
    LINE,
    REST,
    WAYPOINTS,
    WAYPOINTS | {"fraction": 0.83},
]


@pytest.mark.parametrize("factor", [1, 3.7])
@pytest.mark.parametrize("orientation", ["follow_path", "fixed"])
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_the_last_pose_is_the_end_of_the_path(
    moved: Made, path: dict[str, Any], orientation: str, factor: float
) -> None:
    """Of every path: after the last step, and in the preview."""
    case = moved({"speed_factor": factor}, path=path, orientation=orientation)
    end = path_end(path, BED.surface_m - 0.015)
    assert last_place(case) == pytest.approx(end, abs=1e-12)
    shown = layout(case).workpieces[0].drag.poses[[0, -1], :3, 3]
    assert shown[-1, :2] == pytest.approx(end[:2], abs=1e-12)
    drag = course(case.study, BED).drag
    assert drag.speed_m_s == pytest.approx(
        factor * case.study.motion.nominal_speed_m_s, rel=0.6 / (drag.end - drag.start)
    )


@pytest.mark.parametrize("superposed", [{}, {"spin": SPIN, "oscillation": OSCILLATION}])
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_no_row_lies_behind_the_end_of_the_path(
    moved: Made, tmp_path: Path, path: dict[str, Any], superposed: dict[str, Any]
) -> None:
    """No output has a step after the drag, and its last period is in it."""
    scene = process_scene(moved(path=path, **superposed), BED)
    case = read_back(scene, tmp_path)
    drag = drag_phase(case)
    for output in load_outputs(tmp_path).values():
        assert output.last_step is not None
        assert drag.end_step - output.period_steps < output.last_step <= drag.end_step
        assert (output.last_step - output.first_step) % output.period_steps == 0
    steps = np.array([drag.end_step, drag.end_step + 1])
    assert counted_mask(steps, case).tolist() == [True, False]
    length = axis_speed(case) * (drag.end_step - drag.start_step) * case.timestep_s
    assert length == pytest.approx(path_length(path), rel=1e-12)


@pytest.mark.parametrize("superposed", [{}, {"spin": SPIN, "oscillation": OSCILLATION}])
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_both_packages_describe_the_same_motion(
    moved: Made, tmp_path: Path, path: dict[str, Any], superposed: dict[str, Any]
) -> None:
    """What dragchain says of velocity and turn at each step is what the course does until then."""
    study = moved(path=path, **superposed)
    way, case = course(study.study, BED), read_back(process_scene(study, BED), tmp_path)
    steps = np.arange(way.drag.start, way.drag.end + 1)
    places, rotation = way.poses(way.legs[-1], steps - steps[0])
    velocity = workpiece_velocity(steps, places, places, case)
    if path["kind"] != "rest":
        speed = np.linalg.norm(velocity[1:], axis=1).max()
        went = places[:1] + np.cumsum(velocity[1:], axis=0) * case.timestep_s
        np.testing.assert_allclose(went, places[1:], atol=2 * speed * case.timestep_s)
    heading = headings(steps, places[:, :2], case)
    seen = (
        workpiece_rotation(steps, heading, case).front_rad - study.study.motion.path.direction_rad
    )
    np.testing.assert_allclose(np.exp(1j * seen), np.exp(1j * rotation.front_rad), atol=1e-9)


def read_back(scene: AnyScene, folder: Path) -> ReadCase:
    """The case of a scene as dragchain reads it."""
    scene.case.write(folder / "case.json")
    outputs = {one.name: one.as_part() for one in scene.deck.outputs}
    ColumnsFile(outputs=outputs).write(folder / "columns.json")
    return load_case(folder)


def path_length(path: dict[str, Any]) -> float:
    """Length of a path, from its fields alone, m."""
    if path["kind"] == "line":
        return float(path["length_m"])
    if path["kind"] == "waypoints":
        points = np.array([[*point, 0.0][1:4] for point in path["points"]])
        whole = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        return float(path.get("fraction", 1.0) * whole)
    return float(math.tau * path["radius_m"] * path["revolutions"])


def test_a_line_that_nearly_reaches_the_wall_is_where_the_check_has_it(moved: Made) -> None:
    """A fast drag and few frames: a whole period of the network would be far beyond the wall."""
    path = {"kind": "line", "start_m": [-0.008, 0], "direction_deg": 0, "length_m": 0.02}
    case = moved({"speed_factor": 10}, path=path)
    assert last_place(case)[0] == pytest.approx(0.012, abs=1e-12)
    gap = case.study.bowl.radius_m - 0.012 - clearances(case, BED.surface_m).wall_m
    assert gap == pytest.approx(0.004, rel=0.01)
    process_scene(case, BED)
    farther = moved({"speed_factor": 10}, path=path | {"length_m": 0.025})
    with pytest.raises(InputError, match="no particle fits"):
        process_scene(farther, BED)


@pytest.mark.parametrize(
    ("motion", "field"),
    [
        ({"transient_m": math.tau * 1e-3 - 25e-6}, "motion.transient_m"),
        ({"transient_m": 0.0054}, "motion.transient_m"),
        ({"path": REST | {"bowl_rpm": 1e-9}}, "motion.path.speed_m_s"),
        ({"path": LINE | {"direction_deg": 1e300}}, "motion.path.direction_deg"),
        ({"path": CIRCLE | {"start_deg": -1e300}}, "motion.path.start_deg"),
    ],
)
def test_motions_that_cannot_be_meant(moved: Made, motion: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as caught:
        moved(**motion)
    assert caught.value.field == field
    assert caught.value.limit is not None


def test_statistics_have_a_frame_after_the_longest_transient(moved: Made, tmp_path: Path) -> None:
    """The longest that is accepted leaves one frame of the network."""
    length, frame = math.tau * 1e-3, 0.02 / 20
    scene = process_scene(moved(transient_m=length - frame), BED)
    case, network = read_back(scene, tmp_path), load_outputs(tmp_path)["contacts"]
    assert network.last_step is not None
    steps = np.arange(network.first_step, network.last_step + 1, network.period_steps)
    assert counted_mask(steps, case).any()


def test_a_high_speed_factor_is_remarked(moved: Made) -> None:
    usual, high = (warnings(moved({"speed_factor": factor}).study) for factor in (10, 100))
    assert not [one for one in usual if "speed_factor" in str(one)]
    (remark,) = (one for one in high if "speed_factor" in str(one))
    assert "fidelities.quick.speed_factor 100 is not plausible" in str(remark)


def test_the_fraction_of_a_path_that_is_driven_has_to_fit(moved: Made) -> None:
    """Waypoints beyond it are never reached."""
    points = [[0, 0, 0], [0.5, 0.01, 0], [1, 0.03, 0, 0.03]]
    case = moved(path={"kind": "waypoints", "points": points, "fraction": 0.5})
    assert case.study.motion.farthest_m == pytest.approx(0.01)
    assert case.study.motion.path_heights_m == (0, 0)
    process_scene(case, BED)


def test_a_revolution_takes_its_length_over_the_speed(moved: Made) -> None:
    way = course(moved(path=CIRCLE).study, BED)
    plunge, approach, drag = way.legs
    assert [leg.name for leg in way.legs] == ["plunge", "approach", "drag"]
    assert drag.duration_s == pytest.approx(0.1 * math.tau * 0.01 / 0.02, abs=way.drag.timestep_s)
    _, rotation = way.poses(drag, np.array([drag.steps]))
    assert rotation.turn_rad[0] == pytest.approx(0.1 * math.tau)
    dive = way.start_m[2] - BED.surface_m + 0.015
    assert plunge.duration_s * plunge.velocity_m_s[2] == pytest.approx(-dive)
    assert approach.duration_s * approach.velocity_m_s[0] == pytest.approx(0.01)


def test_a_line_that_starts_where_it_plunges_has_no_approach(moved: Made) -> None:
    assert [leg.name for leg in course(moved(path=LINE).study, BED).legs] == ["plunge", "drag"]


def test_farthest_reach_counts_the_end_of_a_line_and_the_plunge(moved: Made) -> None:
    assert moved(path=LINE).study.motion.farthest_m == pytest.approx(math.hypot(*path_end(LINE, 0)))
    assert moved(path=CIRCLE, plunge_at_m=[0, 0.03]).study.motion.farthest_m == pytest.approx(0.03)

"""A workpiece whose axis is not upright."""

import math
from typing import Any

import numpy as np
import pytest
from made_scenes import BED
from made_study import Made

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.motion import course
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import (
    dip,
    reference_height,
    workpiece_length,
    workpiece_mesh,
    workpiece_reach,
)


@pytest.mark.parametrize("tilt", [15, -10])
def test_the_upper_end_leans_in_the_direction_of_motion(moved: Made, tilt: float) -> None:
    """In the frame of the mesh that is +x, which the input script turns to the path."""
    case = moved(tilt_deg=tilt)
    mesh = workpiece_mesh(case)
    top = mesh.vertices[mesh.vertices[:, 2] > 0.5 * mesh.bounds[1, 2]].mean(axis=0)
    bottom = mesh.vertices[mesh.vertices[:, 2] < 0.5 * mesh.bounds[1, 2]].mean(axis=0)
    x, y, z = top - bottom
    assert math.degrees(math.atan2(x, z)) == pytest.approx(tilt, abs=0.5)
    assert abs(y) < 1e-9
    assert mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-12)
    scene = process_scene(case, BED)
    assert scene.deck.workpieces[0].turn_deg == pytest.approx(90.0)
    assert scene.case.workpiece.kind == "mesh"


def test_the_generated_workpiece_still_stands_out_of_the_bed(moved: Made) -> None:
    """Its axis ends at the height of the upright one; the ends of a cylinder are inclined."""
    upright, case = workpiece_length(moved()), moved(tilt_deg=15)
    inclined = 2 * case.study.workpiece.shape.radius_m * math.sin(math.radians(15))
    assert workpiece_length(case) == pytest.approx(upright + inclined, abs=1e-4)


def test_the_gap_is_that_of_what_is_in_the_bed(moved: Made) -> None:
    """A rod of radius r leans by depth * tan(tilt) at the surface."""
    case = moved(tilt_deg=20)
    mesh, depth = workpiece_mesh(case), case.study.motion.immersion_depth_m
    highest = float(np.hypot(*mesh.vertices[:, :2].T).max())
    radius = case.study.workpiece.shape.radius_m
    reach = workpiece_reach(case)
    leaning = depth * math.tan(math.radians(20)) + radius / math.cos(math.radians(20))
    assert reach < highest
    assert reach == pytest.approx(leaning, rel=0.1)
    thickness = [describe(one)["workpiece_to_particle"] for one in (moved(tilt_deg=None), case)]
    assert thickness[0] == pytest.approx(thickness[1])


def outermost(case: Case) -> float:
    """Largest distance of the workpiece from the bowl's axis, m."""
    return case.study.bowl.container.reach_m - clearances(case, 1.0).wall_m


def test_a_workpiece_that_follows_a_circle_leans_along_it(moved: Made) -> None:
    """Its farthest point lies ahead of the axis, not outwards; with a fixed orientation it may."""
    case = moved(tilt_deg=20)
    depth, path = case.study.motion.immersion_depth_m, case.study.motion.path.radius_m
    radius, lean = case.study.workpiece.shape.radius_m, depth * math.tan(math.radians(20))
    farthest = outermost(case)
    assert math.hypot(path, lean) < farthest < math.hypot(path + radius, lean + 1.1 * radius)
    assert outermost(moved(orientation="fixed")) == pytest.approx(path + workpiece_reach(case))
    upright = outermost(moved(tilt_deg=None, orientation="follow_path"))
    assert upright == pytest.approx(path + radius, rel=0.01)
    assert upright < farthest


INCLINED = [[0, 0, 0], [0.5, 0.002, 0, 0, 40, 20], [1, 0.004, 0, 0, 90, 0, -25]]


def on_waypoints(points: Any, **more: Any) -> dict[str, Any]:
    return {"path": {"kind": "waypoints", "points": points}, **more}


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        ({"ramp_s": 0.6}, "motion.ramp_s: no path is left"),
        ({"tilt_deg": 60}, "at most 45"),
        (on_waypoints([[0, 0, 0, 0, 0, 10], [1, 0.01, 0]]),
         "the first waypoint has a pitch or a roll"),
        (on_waypoints([[0, 0, 0], [1, 0.01, 0, 0, 200, 10]]),
         "turns by 200 degrees from one waypoint"),
        (on_waypoints(INCLINED, ramp_s=0.1), "ramp_s cannot be used"),
        ({"path": {"kind": "rest", "radius_m": 0.01, "bowl_rpm": 10}, "ramp_s": 0.1},
         "ramp_s cannot be used"),
    ],
)  # fmt: skip
def test_bad_input_is_named(moved: Made, motion: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        moved(**motion)


def test_a_workpiece_that_leans_into_the_wall_is_refused(moved: Made) -> None:
    with pytest.raises(InputError, match=r"between its path and the bowl|fits between"):
        process_scene(moved(tilt_deg=45, immersion_depth_m=0.03, orientation="fixed"), BED)


# --- spin about an inclined axis, and waypoints that incline -----------------------------------


def test_a_tilted_workpiece_that_spins_has_its_reference_point_on_its_axis(moved: Made) -> None:
    """Its lowest point, at whatever angle, is at the immersion depth."""
    case = moved(tilt_deg=20, spin={"rpm": 60})
    mesh, radius = workpiece_mesh(case), case.study.workpiece.shape.radius_m
    assert -mesh.bounds[0, 2] == pytest.approx(radius * math.sin(math.radians(20)), rel=0.01)
    assert reference_height(case) >= -mesh.bounds[0, 2] - 1e-9
    scene = process_scene(case, BED)
    way, drag = course(case.study, BED, reference_height(case)), scene.case.phases[-1]
    places, _ = way.poses(way.legs[-1], np.array([drag.end_step - drag.start_step]))
    tip = BED.surface_m - case.study.motion.immersion_depth_m
    assert places[0, 2] - reference_height(case) == pytest.approx(tip, abs=1e-9)
    assert workpiece_reach(case) >= workpiece_reach(moved(spin=None)) - 1e-6


def test_waypoints_that_incline_take_the_lowest_point_down(moved: Made) -> None:
    case = moved(**on_waypoints(INCLINED))
    radius = case.study.workpiece.shape.radius_m
    assert dip(case) == pytest.approx(radius * math.sin(math.radians(25)), rel=0.02)
    upright = moved(**on_waypoints([point[:5] for point in INCLINED]))
    assert dip(upright) == 0
    assert workpiece_reach(case) > workpiece_reach(upright)
    assert process_scene(case, BED).case.workpiece.kind == "mesh"


def test_waypoints_without_inclination_name_no_run_anew(moved: Made) -> None:
    short, long = ([[*point[:5], *[0] * more] for point in INCLINED] for more in (0, 2))
    assert PROCESS.run_id(moved(**on_waypoints(short))) == PROCESS.run_id(
        moved(**on_waypoints(long))
    )


@pytest.mark.parametrize("orientation", ["follow_path", "fixed"])
def test_no_statistic_includes_the_start(moved: Made, orientation: str) -> None:
    """The drag takes half the ramp longer; statistics begin after it at the earliest."""
    slow, quick = (
        process_scene(moved(ramp_s=ramp, orientation=orientation), BED).case for ramp in (0.2, 0)
    )
    lasts = [one.phases[-1].end_step - one.phases[-1].start_step for one in (slow, quick)]
    assert (lasts[0] - lasts[1]) * slow.timestep_s == pytest.approx(0.1, rel=1e-3)
    assert slow.statistics.transient_s == pytest.approx(0.2, rel=1e-3)
    longer = process_scene(moved(transient_m=0.004), BED).case.statistics.transient_s
    assert longer == pytest.approx(0.004 / 0.02, rel=1e-3)
    assert slow.motion.axis_speed_m_s == pytest.approx(quick.motion.axis_speed_m_s, rel=1e-3)

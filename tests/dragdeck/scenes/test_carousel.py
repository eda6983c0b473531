"""Several workpieces on one carousel: their studies, their distances, the input script."""

import math
import re
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from made_scenes import BED, script

from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.errors import InputError
from dragdeck.project import Project, by_folder
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.sweep.cases import load_cases

THIN = {"kind": "cylinder", "radius_m": 0.002, "facet_size_m": 0.001}
LINE = {"kind": "line", "start_m": [0.005, 0.012], "direction_deg": 180, "length_m": 0.01}
WAYPOINTS = {"kind": "waypoints", "points": [[0, 0.012, 0], [1, 0.01, 0.004], [2, 0.009, 0.002]]}
SMALL_CIRCLE = {"kind": "circle", "radius_m": 0.005, "revolutions": 0.1}
Carousel = Callable[..., Case]


@pytest.fixture
def carousel(small: dict[str, Any], write_study: Callable[..., Path]) -> Carousel:
    """The small study with thin workpieces on a larger circle."""

    def make(workpieces: Any, **motion: Any) -> Case:
        small["workpiece"]["shape"] = dict(THIN)
        small["motion"]["path"]["radius_m"] = 0.012
        small["motion"] |= deepcopy(motion)
        if workpieces is not None:
            small["workpieces"] = deepcopy(workpieces)
        (only,) = load_cases(write_study(small))
        return only

    return make


def test_a_warning_says_which_workpiece_is_meant(carousel: Carousel) -> None:
    """Unless it holds for all of them."""
    thick = THIN | {"radius_m": 0.0035}
    each = [{"angle_deg": angle, "shape": shape} for angle, shape in ((0, thick), (180, THIN))]
    circle = {"kind": "circle", "radius_m": 0.0095, "revolutions": 0.1}

    def gaps(*workpieces: dict[str, Any]) -> list[str]:
        case = carousel({"each": list(workpieces)}, path=circle)
        return [str(one) for one in process_scene(case, BED).warnings if one.code == "gap"]

    (one,) = gaps(*each)
    assert one.startswith("workpiece 1: the gap between workpiece and bowl is 1.8")
    both = gaps(*({**station, "shape": dict(thick)} for station in each))
    assert len(both) == 1 and both[0].startswith("the gap between workpiece and bowl is 1.8")


def test_one_workpiece_is_as_none_were_asked_for(carousel: Carousel, project: Project) -> None:
    plain, one = carousel(None), carousel({"count": 1})
    assert PROCESS.run_id(one) == PROCESS.run_id(plain)
    assert script(one, project) == script(plain, project)
    assert of_each_workpiece(one) == [one]
    shown = process_scene(one, BED).case.model_dump(mode="json")
    assert not {"number", "count", "wake_from_m"} & set(shown["workpiece"])
    assert "output_of" not in shown


@pytest.mark.parametrize("path", [None, LINE, WAYPOINTS])
def test_the_paths_are_turned_about_the_bowls_axis(carousel: Carousel, path: Any) -> None:
    own = {} if path is None else {"path": path}
    own |= {"speed_m_s": None} if path is WAYPOINTS else {}
    whole = carousel({"count": 3}, **own)
    each = of_each_workpiece(whole)
    x, y = whole.study.motion.path.start_point
    for number, one in enumerate(each):
        angle = 2 * math.pi * number / 3
        motion = one.study.motion
        assert motion.path.start_point == pytest.approx(
            (x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle))
        )
        assert motion.plunge_at_m == motion.path.start_point
        off = motion.path.direction_rad - whole.study.motion.path.direction_rad - angle
        assert math.cos(off) == pytest.approx(1.0)
    runs = by_folder([whole], PROCESS)
    assert list(runs) == [PROCESS.run_id(whole) + ending for ending in ("", ".2", ".3")]
    assert [one.number for one in runs.values()] == [1, 2, 3]


def test_a_list_gives_each_an_angle_and_a_shape(carousel: Carousel, project: Project) -> None:
    thick = {**THIN, "radius_m": 0.0025}
    listed = [{"angle_deg": 10}, {"angle_deg": 130, "shape": thick}, {"angle_deg": 250}]
    case = carousel(listed, plunge_at_m=[0.011, 0.0])
    scene = process_scene(case, BED)
    first, second, third = scene.deck.workpieces
    assert (first.mesh, second.mesh, third.mesh) == (
        *("workpiece.stl", "workpiece_2.stl", "workpiece.stl"),
    )
    assert set(scene.files) == {"workpiece.stl", "workpiece_2.stl"}
    radii = [process_scene(one, BED).case.workpiece.radius_m for one in of_each_workpiece(case)]
    assert radii == pytest.approx([0.002, 0.0025, 0.002], rel=0.01)
    assert math.dist(first.start_m[:2], (0, 0)) == pytest.approx(0.011)
    assert math.atan2(first.start_m[1], first.start_m[0]) == pytest.approx(math.radians(10))
    text = script(case, project)
    assert "file workpiece_2.stl" in text
    assert "n_meshes 3 meshes workpiece workpiece_2 workpiece_3" in text


def test_workpieces_at_different_depths_reach_them_at_the_same_step(carousel: Carousel) -> None:
    """The shallower one starts higher, and plunges as far."""
    stations = [{"angle_deg": 0}, {"angle_deg": 180, "immersion_depth_m": 0.004}]
    case = carousel(stations)
    deeper = case.study.motion.immersion_depth_m - 0.004
    assert deeper > 0
    bodies = process_scene(case, BED).deck.workpieces
    starts = [body.start_m[2] for body in bodies]
    assert starts[1] - starts[0] == pytest.approx(deeper, abs=2e-6)
    plunges = [body.legs[0] for body in bodies]
    assert plunges[0].velocity_m_s == plunges[1].velocity_m_s
    assert [leg.end_step for leg in bodies[0].legs] == [leg.end_step for leg in bodies[1].legs]
    each = of_each_workpiece(case)
    depths = [process_scene(member, BED).case.workpiece.immersion_depth_m for member in each]
    assert depths == [case.study.motion.immersion_depth_m, 0.004]
    assert PROCESS.run_id(case) != PROCESS.run_id(carousel([{"angle_deg": 0}, {"angle_deg": 180}]))
    with pytest.raises(InputError, match=r"workpieces.each.0.immersion_depth_m"):
        process_scene(carousel([{"angle_deg": 0, "immersion_depth_m": 0.5}]), BED)
    with pytest.raises(InputError, match=r"workpieces.each.1.immersion_depth_m"):
        process_scene(carousel([stations[0], {"angle_deg": 180, "immersion_depth_m": 0.037}]), BED)


def test_no_two_workpieces_share_a_name(carousel: Carousel, project: Project) -> None:
    """Variables and fixes: LIGGGHTS would take the later one for both."""
    superposed = {
        "spin": {"schedule": [{"until_s": 0.1, "rpm": 100}, {"until_s": 9, "rpm": -100}]},
        "oscillation": {"amplitude_m": 0.001, "frequency_hz": 5},
    }
    case = carousel({"count": 3}, orientation="fixed", **superposed)
    text = script(case, project)
    drag = text[text.index("# drag:") :]
    defined = re.findall(r"^variable (\w+) ", drag, flags=re.MULTILINE)
    fixed = re.findall(r"^fix (\w+) ", drag, flags=re.MULTILINE)
    assert len(defined) == len(set(defined))
    assert len(fixed) == len(set(fixed))
    for workpiece in process_scene(case, BED).deck.workpieces:
        for motion in workpiece.superposed.values():
            assert all(name.endswith(workpiece.ending) for name in motion.variables)
            used = re.findall(
                r"\bv_(\w+)", " ".join([*motion.variables.values(), *motion.movers.values()])
            )
            assert set(used) <= set(motion.variables)
        assert f"${{reference_x{workpiece.ending}}}" in workpiece.superposed["spin"].movers[""]


@pytest.mark.parametrize(("direction", "gaps"), [("ccw", [60, 110, 190]), ("cw", [190, 60, 110])])
def test_the_wake_begins_where_the_next_one_ahead_began(
    carousel: Carousel, direction: str, gaps: list[float]
) -> None:
    path = {"kind": "circle", "radius_m": 0.014, "revolutions": 0.9, "direction": direction}
    case = carousel([{"angle_deg": angle} for angle in (0, 60, 170)], path=path)
    around, each = 2 * math.pi * 0.014, of_each_workpiece(case)
    seen = [process_scene(one, BED).case.workpiece.wake_from_m for one in each]
    assert seen == pytest.approx([around * gap / 360 for gap in gaps])


@pytest.mark.parametrize(
    ("count", "revolutions", "wake_m"),
    [(3, 0.1, None), (1, 1, None), (1, 1.5, 2 * math.pi * 0.012)],
)
def test_only_a_long_path_leads_through_a_wake(
    carousel: Carousel, count: int, revolutions: float, wake_m: float | None
) -> None:
    path = {"kind": "circle", "radius_m": 0.012, "revolutions": revolutions}
    (first, *_) = of_each_workpiece(carousel({"count": count}, path=path))
    assert process_scene(first, BED).case.workpiece.wake_from_m == pytest.approx(wake_m)


@pytest.mark.parametrize(
    ("workpieces", "motion", "words"),
    [
        ({"count": 3}, {"path": SMALL_CIRCLE}, "workpieces [0-9] and [0-9] come so close"),
        ([{"angle_deg": 0}, {"angle_deg": 9}], {}, "workpieces 1 and 2 collide"),
        ({"count": 2}, {"path": {**LINE, "start_m": [0.005, 0.001]}}, "workpieces 1 and 2 collide"),
        ({"count": 2}, {"plunge_at_m": [0.001, 0.0]}, "workpieces 1 and 2 collide"),
        ({"count": 0}, {}, r"workpieces.count: the value is out of range(?s:.*)at least 1"),
        ({"count": 13}, {}, r"workpieces.count: the value is out of range(?s:.*)at most 12"),
        ({"count": 2, "each": [{"angle_deg": 0}]}, {}, "workpieces: give either count, or a list"),
        ({}, {}, "workpieces: give either count, or a list"),
        ([{"shape": THIN}], {}, "workpieces.each.0.angle_deg: a required key is missing"),
        ([{"angle_deg": 0, "radius_m": 1}], {}, "workpieces.each.0.radius_m: unknown key"),
    ],
)  # fmt: skip
def test_workpieces_that_cannot_be(
    carousel: Carousel, workpieces: Any, motion: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        process_scene(carousel(workpieces, **motion), BED)

"""Every kind of path: what it says of itself follows from its poses, and the engine moves it."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from made_scenes import script

from dragdeck.project import Project
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.motion import AnyPath, Motion
from dragdeck.study.paths.figure_eight import FigureEightPath
from dragdeck.study.rotations import rotated
from dragdeck.sweep.cases import load_cases

POINTS = [[2, 0.001, 0, 0.002], [2.2, 0.006, 0.002], [2.3, 0.006, 0.002], [2.7, 0.001, 0.003]]
TURNS = [[0, 0, 0], [30, 10, 0], [30, 10, 0], [-20, -5, 15]]
EXAMPLES: dict[str, list[dict[str, Any]]] = {
    "circle": [
        {"radius_m": 0.01, "revolutions": 0.3},
        {"radius_m": 0.01, "revolutions": 1.2, "direction": "cw", "start_deg": 40},
    ],
    "figure_eight": [
        {"radius_m": 0.004, "loops": 0.7},
        {"radius_m": 0.003, "middle_m": [0.001, -0.002], "direction_deg": 110, "loops": 1.3},
    ],
    "line": [{"start_m": [-0.005, 0.002], "direction_deg": 30, "length_m": 0.0123}],
    "rest": [{"radius_m": 0.01, "bowl_rpm": -30, "revolutions": 0.3, "start_deg": 20}],
    "waypoints": [
        {"points": POINTS},
        {"points": POINTS, "fraction": 0.83},
        {"points": [[*[*p, 0.0][:4], *turn] for p, turn in zip(POINTS, TURNS, strict=True)]},
    ],
}
"""Of each kind in the registry."""

PATHS = [{"kind": kind, **fields} for kind, every in EXAMPLES.items() for fields in every]
STEP_S = 1e-5


def motion(path: dict[str, Any], **more: Any) -> Motion:
    own_speed = path["kind"] in ("rest", "waypoints")
    fields = {"immersion_depth_m": 0.015, "transient_m": 0.0, **more}
    return Motion.model_validate({"path": path, "speed_m_s": None if own_speed else 0.02, **fields})


def driven(path: dict[str, Any], **more: Any) -> DrivenMotion:
    return DrivenMotion.of(motion(path, **more), STEP_S, 1.0)


def poses(way: DrivenMotion) -> tuple[np.ndarray, np.ndarray]:
    """Steps, and the places seen from the bowl."""
    steps, path = np.arange(way.drive.steps + 1), way.motion.path
    places = way.places(steps, np.array([*path.start_point, path.start_height_m]))
    return steps, rotated(places, -way.bowl_rad_s * STEP_S * steps)


def test_every_kind_has_an_example() -> None:
    kinds = {get_args(kind.model_fields["kind"].annotation)[0] for kind in get_args(AnyPath)}
    assert kinds == set(EXAMPLES), "EXAMPLES of this file needs an example of each kind"


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_what_a_path_says_of_itself_follows_from_its_poses(path: dict[str, Any]) -> None:
    way = driven(path)
    _, places = poses(way)
    own, speeds = way.motion.path, np.linalg.norm(np.diff(places, axis=0), axis=1) / STEP_S
    if "fraction" not in path:  # of recorded paths, lengths are those at the mean speed
        assert speeds.sum() * STEP_S == pytest.approx(own.path_length_m, rel=1e-6)
        assert speeds.mean() == pytest.approx(way.motion.nominal_speed_m_s, rel=1e-4)
        assert speeds.max() / speeds.mean() == pytest.approx(own.peak_speed_ratio, rel=1e-4)
    assert speeds.max() == pytest.approx(way.fastest_m_s, rel=1e-6)
    assert places[0, :2] == pytest.approx(own.start_point, abs=1e-15)
    assert places[0, 2] == pytest.approx(own.start_height_m, abs=1e-15)
    if way.bowl_rad_s == 0:
        end = np.array(own.place(1.0)) - own.place(0.0)
        assert places[-1] - places[0] == pytest.approx(end, abs=1e-12)
    x, y, _ = places[1] - places[0]
    assert math.cos(math.atan2(y, x) - own.direction_rad) == pytest.approx(1.0, abs=1e-6)
    reach = np.hypot(*own.corners[:, :2].T).max()
    assert reach == pytest.approx(np.hypot(*places[:, :2].T).max(), rel=1e-6)
    assert own.corners[:, 2].min() == pytest.approx(places[:, 2].min(), abs=1e-12)
    assert own.corners[:, 2].max() == pytest.approx(places[:, 2].max(), abs=1e-12)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_a_path_may_be_turned_and_have_another_length(path: dict[str, Any]) -> None:
    way = driven(path)
    own = way.motion.path
    assert own.with_length(0.7 * own.path_length_m).path_length_m == pytest.approx(
        0.7 * own.path_length_m
    )
    turned = way.motion.model_copy(update={"path": own.turned(35)})
    _, places = poses(way)
    _, elsewhere = poses(DrivenMotion.of(turned, STEP_S, 1.0))
    np.testing.assert_allclose(elsewhere, rotated(places, math.radians(35)), atol=1e-11)


class Parabola(FigureEightPath):
    """``y = x^2`` from x = 0 to `loops`: its length is not proportional to that."""

    def place(self, share: Any) -> tuple[Any, Any, Any]:
        return self.loops * share, (self.loops * share) ** 2, 0.0

    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        return self.loops, 2 * self.loops**2 * share, 0.0


def test_a_path_whose_length_is_not_proportional_gets_another_length() -> None:
    path = Parabola(kind="figure_eight", radius_m=1.0, loops=1.0)
    x = path.with_length(4.0).loops
    assert x / 2 * math.hypot(1, 2 * x) + math.asinh(2 * x) / 4 == pytest.approx(4.0, rel=1e-8)


MORE: list[dict[str, Any]] = [
    {},
    {"orientation": "fixed"},
    {"ramp_s": 0.1},
    {"spin": {"rpm": 60}, "tilt_deg": 20},
    {"spin": {"rpm": -60}, "oscillation": {"amplitude_m": 1e-3, "frequency_hz": 5}},
]


def possible(path: dict[str, Any], more: dict[str, Any]) -> bool:
    """Not a start of a path with a speed of its own, and no spin with waypoints that turn."""
    turns = any(len(point) > 4 for point in path.get("points", ()))
    own_speed = path["kind"] in ("rest", "waypoints")
    return not (own_speed and "ramp_s" in more) and not (turns and "spin" in more)


BOTH = [(path, more) for path in PATHS for more in MORE if possible(path, more)]


@pytest.mark.parametrize(("path", "more"), BOTH, ids=str)
def test_velocities_are_changes_of_poses(path: dict[str, Any], more: dict[str, Any]) -> None:
    """Of a point beside and above the reference point; within the stages of waypoints."""
    way = driven(path, **more)
    own, begun = way.motion.path, np.array([*way.motion.path.start_point, 0.0])
    steps = np.linspace(50, way.drive.steps - 50, 37).astype(int)
    arm = np.tile([0.004, -0.003, 0.01], (len(steps), 1))

    def point(since: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place, turn = way.places(since, begun), way.rotation(since, own.direction_rad)
        return place, place + turn.out_of(arm)

    reference, here = point(steps)
    (_, after), (_, before) = point(steps + 1), point(steps - 1)
    found = way.velocity(steps, here, reference)
    np.testing.assert_allclose(found, (after - before) / 2 / STEP_S, atol=2e-5)
    heading = way.directions(steps, reference[:, :2])
    seen = way.rotation_along(steps, heading).matrices
    np.testing.assert_allclose(seen, way.rotation(steps, own.direction_rad).matrices, atol=1e-9)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path["kind"])
def test_the_drag_moves_the_workpiece_or_the_bowl(
    path: dict[str, Any], small: dict[str, Any], write_study: Callable[..., Path], project: Project
) -> None:
    small["motion"] |= {"path": path}
    if path["kind"] in ("rest", "waypoints"):
        del small["motion"]["speed_m_s"]
    (case,) = load_cases(write_study(small))
    text = script(case, project)
    moved = "fix move_drag all move/mesh mesh workpiece" in text
    assert moved != ("surface_ang_vel" in text)
    assert max(map(len, text.splitlines())) < 1000

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changed import changed
from hypothesis import given
from hypothesis import strategies as st
from made_run import with_motion

from dragchain import TableError, load_case
from dragchain.run.kinematics import (
    bowl_velocity,
    counted_mask,
    headings,
    motion_of,
    phase_codes,
    spins,
    workpiece_frame,
    workpiece_rotation,
    workpiece_velocity,
)
from dragdeck.records.case import CaseOfRun, StatisticsOfRun
from dragdeck.records.run import Phase
from dragdeck.study.rotations import wrap_angle

DT = 1e-3
CIRCLE = {"kind": "circle", "radius_m": 0.02}
PHASES = (
    Phase(name="plunge", start_step=0, end_step=10),
    Phase(name="approach", start_step=10, end_step=20),
    Phase(name="drag", start_step=20, end_step=40),
)


@pytest.fixture
def case(tiny_run: Path) -> CaseOfRun:
    return changed(
        load_case(tiny_run), phases=PHASES, statistics=StatisticsOfRun(transient_s=0.005)
    )


def moving(
    case: CaseOfRun, path: Any = CIRCLE, speed_m_s: float | None = 0.01, **motion: Any
) -> CaseOfRun:
    """The case with a workpiece on a path, which it follows."""
    data = with_motion(
        case.model_dump(), path, speed_m_s, **{"orientation": "follow_path", **motion}
    )
    return CaseOfRun.model_validate(data)


@pytest.fixture
def circling(case: CaseOfRun) -> CaseOfRun:
    return moving(case)


def test_a_step_belongs_to_the_phase_that_computed_it() -> None:
    steps = np.array([0, 1, 10, 11, 20, 21, 40])
    assert phase_codes(steps, PHASES).tolist() == [0, 0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize(("steps", "phases"), [([41], PHASES), ([-1], PHASES), ([0], ())])
def test_a_step_without_a_phase_is_an_error(steps, phases) -> None:
    with pytest.raises(TableError, match="phases"):
        phase_codes(np.array(steps), phases)


def test_samples_count_from_the_end_of_the_run_in(case: CaseOfRun) -> None:
    steps = np.array([20, 21, 24, 25, 26, 40, 41])
    assert counted_mask(steps, case).tolist() == [False] * 3 + [True] * 3 + [False]
    whole = changed(case, statistics=StatisticsOfRun(transient_s=0.0))
    assert counted_mask(steps, whole).tolist() == [False] + [True] * 5 + [False]


def test_a_case_without_drag_is_an_error(case: CaseOfRun) -> None:
    with pytest.raises(TableError, match="no phase named drag"):
        counted_mask(np.array([1]), changed(case, phases=PHASES[:2]))


@pytest.mark.parametrize(
    ("sense", "place", "heading"),
    [
        (1, (0.02, 0), pi / 2),
        (1, (0, 0.02), pi),
        (1, (0, -0.02), 0),
        (-1, (0.02, 0), -pi / 2),
        (-1, (0, 0.02), 0),
    ],
)
def test_on_a_circle_the_workpiece_heads_along_the_tangent(circling, sense, place, heading) -> None:
    turned = moving(circling, CIRCLE | {"direction": "ccw" if sense > 0 else "cw"})
    assert headings(np.array([30]), np.array([place]), turned) == pytest.approx(heading)


def test_before_the_drag_the_heading_is_the_one_it_starts_with(circling: CaseOfRun) -> None:
    places = np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.02]])
    np.testing.assert_allclose(headings(np.array([5, 15, 20]), places, circling), [pi / 2] * 3)


def test_on_a_line_the_heading_is_the_lines(case: CaseOfRun) -> None:
    case = moving(case, {"kind": "line", "start_m": [0.0, 0.0], "direction_deg": 270})
    np.testing.assert_allclose(headings(np.array([0, 30]), np.ones((2, 2)), case), [-pi / 2] * 2)


def test_the_workpiece_frame_of_a_workpiece_that_moves_along_y() -> None:
    """Along y; the left of that is -x."""
    turned = workpiece_frame(np.array([[1.0, 2.0, 3.0]]), np.array([pi / 2]))
    np.testing.assert_allclose(turned, [[2, -1, 3]], atol=1e-15)


@given(st.floats(-100, 100))
def test_wrapped_angles_point_the_same_way(angle) -> None:
    wrapped = float(wrap_angle(angle))
    assert -pi < wrapped <= pi
    assert np.cos(wrapped - angle) == pytest.approx(1.0)


def test_half_a_turn_wraps_to_plus_pi() -> None:
    np.testing.assert_array_equal(wrap_angle([pi, -pi]), [pi, pi])


def test_a_workpiece_at_rest_has_no_velocity_and_one_direction(case: CaseOfRun) -> None:
    """Relative to a bowl that rotates counter-clockwise it moves along -y."""
    rpm = 2.0 * 30 / pi
    rest = {"kind": "rest", "radius_m": 0.01, "bowl_rpm": rpm, "revolutions": 20 * DT / pi}
    case = moving(case, rest, None)
    steps, place = np.array([20, 30]), np.array([[0.01, 0.0, 0.0]] * 2)
    np.testing.assert_allclose(headings(steps, place[:, :2], case), [-pi / 2] * 2)
    turn = workpiece_rotation(steps, np.full(2, -pi / 2), case).turn_rad
    np.testing.assert_allclose(turn, [-pi / 2] * 2)
    velocity = workpiece_velocity(steps, place + 0.001, place, case)
    assert not velocity[np.isfinite(velocity)].any() and np.isfinite(velocity).any()
    np.testing.assert_allclose(bowl_velocity(place, case), [[0.0, 0.02, 0.0]] * 2)


# --- waypoints -----------------------------------------------------------------------------------

STAGES = (
    (3, (0.0, 0.0, 0.01)),
    (4, (0.0, -0.02, 0.0)),
    (2, (0.0, 0.0, 0.0)),
    (2, (0.0, 0.0, -0.03)),
    (9, (-0.03, 0.0, 0.01)),
)
"""Up, along -y, a pause, down, along -x and up."""


@pytest.fixture
def on_waypoints(case: CaseOfRun) -> CaseOfRun:
    times = np.cumsum([0, *(steps for steps, _ in STAGES)]) * DT
    moved = [np.array(velocity) * steps * DT for steps, velocity in STAGES]
    places = np.vstack([np.zeros(3), np.cumsum(moved, axis=0)])
    points = np.column_stack([times, places]).tolist()
    return moving(case, {"kind": "waypoints", "points": points}, None)


def test_a_stretch_without_a_direction_keeps_the_last_one(on_waypoints: CaseOfRun) -> None:
    """The first one has that of the next; a stage owns its last step."""
    steps = np.array([0, 20, 21, 23, 24, 27, 28, 29, 30, 31, 32, 40])
    found = headings(steps, np.zeros((12, 2)), on_waypoints)
    np.testing.assert_allclose(found, [-pi / 2] * 10 + [pi] * 2)


def test_the_workpiece_does_not_turn_on_waypoints(on_waypoints: CaseOfRun) -> None:
    steps = np.array([0, 21, 40])
    heading = headings(steps, np.zeros((3, 2)), on_waypoints)
    turn = workpiece_rotation(steps, heading, on_waypoints).turn_rad
    np.testing.assert_allclose(turn, -pi / 2)
    assert not motion_of(on_waypoints).keeps_direction


# --- superposed on the path ----------------------------------------------------------------------

SPIN = {
    "schedule": [
        {"until_s": 8 * DT, "rpm": 30.0 * 30 / pi},
        {"until_s": 9, "rpm": -60.0 * 30 / pi},
    ],
    "ramp_s": 0,
}
OSCILLATION = {"amplitude_m": 1e-3, "frequency_hz": 20.0 / pi, "ramp_s": 0}


def with_all(case: CaseOfRun, **motion: Any) -> CaseOfRun:
    return moving(case, spin=SPIN, oscillation=OSCILLATION, **motion)


def test_the_turn_adds_up_the_stages(circling: CaseOfRun) -> None:
    """In the drag, from step 20 to 40; the path's own turn beside it."""
    steps = np.array([0, 20, 24, 28, 30, 40, 50])
    turn = workpiece_rotation(steps, np.zeros(7), with_all(circling)).turn_rad / DT
    np.testing.assert_allclose(turn, [0, 0, 120, 240, 120, -480, -480], atol=1e-9)
    assert spins(with_all(circling))
    assert not spins(circling)

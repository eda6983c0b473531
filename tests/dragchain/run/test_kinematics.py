from math import pi
from pathlib import Path

import numpy as np
import pytest
from changed import changed
from hypothesis import given
from hypothesis import strategies as st

from dragchain import TableError, load_case
from dragchain.run.case import Case, Circle, Phase, Statistics
from dragchain.run.kinematics import (
    counted_mask,
    directions,
    phase_codes,
    workpiece_frame,
    wrap_angle,
)

PHASES = (
    Phase(name="plunge", start_step=0, end_step=10),
    Phase(name="approach", start_step=10, end_step=20),
    Phase(name="drag", start_step=20, end_step=40),
)


@pytest.fixture
def case(tiny_run: Path) -> Case:
    return changed(load_case(tiny_run), phases=PHASES, statistics=Statistics(transient_s=0.005))


@pytest.fixture
def circling(case: Case) -> Case:
    return changed(
        case,
        motion=Circle(
            kind="circle",
            axis_speed_m_s=0.01,
            radius_m=0.02,
            direction="ccw",
            start_direction_rad=pi / 2,
            orientation="follow_path",
        ),
    )


def test_a_step_belongs_to_the_phase_that_computed_it() -> None:
    steps = np.array([0, 1, 10, 11, 20, 21, 40])
    assert phase_codes(steps, PHASES).tolist() == [0, 0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize(("steps", "phases"), [([41], PHASES), ([-1], PHASES), ([0], ())])
def test_a_step_without_a_phase_is_an_error(steps, phases) -> None:
    with pytest.raises(TableError, match="phases"):
        phase_codes(np.array(steps), phases)


def test_samples_count_from_the_end_of_the_run_in(case: Case) -> None:
    steps = np.array([20, 24, 25, 26, 40])
    assert counted_mask(steps, case).tolist() == [False, False, True, True, True]


def test_without_run_in_the_step_that_starts_the_drag_does_not_count(case: Case) -> None:
    steps = np.array([19, 20, 21])
    assert counted_mask(steps, changed(case, statistics=Statistics(transient_s=0.0))).tolist() == [
        False,
        False,
        True,
    ]


def test_a_case_without_drag_is_an_error(case: Case) -> None:
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
    turned = changed(
        circling, motion=changed(circling.motion, direction="ccw" if sense > 0 else "cw")
    )
    assert directions(np.array([30]), np.array([place]), turned) == pytest.approx(heading)


def test_before_the_drag_the_heading_is_the_one_it_starts_with(circling: Case) -> None:
    places = np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.02]])
    np.testing.assert_allclose(directions(np.array([5, 15, 20]), places, circling), [pi / 2] * 3)


def test_on_a_line_the_heading_is_the_lines(case: Case) -> None:
    case = changed(case, motion=changed(case.motion, direction_rad=1.5 * pi))
    np.testing.assert_allclose(directions(np.array([0, 30]), np.ones((2, 2)), case), [-pi / 2] * 2)


def test_the_workpiece_frame_of_a_workpiece_that_moves_along_y() -> None:
    """Along y; the left of that is -x."""
    turned = workpiece_frame(np.array([[1.0, 2.0, 3.0]]), np.array([pi / 2]))
    np.testing.assert_allclose(turned, [[2, -1, 3]], atol=1e-15)


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-10, 10))
def test_the_workpiece_frame_keeps_lengths(x, y, heading) -> None:
    turned = workpiece_frame(np.array([[x, y, 1.0]]), np.array([heading]))[0]
    assert np.hypot(turned[0], turned[1]) == pytest.approx(np.hypot(x, y), abs=1e-12)


@given(st.floats(-100, 100))
def test_wrapped_angles_point_the_same_way(angle) -> None:
    wrapped = float(wrap_angle(angle))
    assert -pi < wrapped <= pi
    assert np.cos(wrapped - angle) == pytest.approx(1.0)


def test_half_a_turn_wraps_to_plus_pi() -> None:
    np.testing.assert_array_equal(wrap_angle([pi, -pi]), [pi, pi])

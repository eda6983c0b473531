"""Where the workpiece goes."""

import math

import pytest

from dragdeck.scenes.motion import farthest_reach, legs
from dragdeck.study.model import Motion

CIRCLE = {"kind": "circle", "radius_m": 0.02}
LINE = {"kind": "line", "start_m": [-0.01, 0.005], "direction_deg": 30, "length_m": 0.02}


def motion(path: dict, **more) -> Motion:
    given = {"speed_m_s": 0.01, "immersion_depth_m": 0.05, "transient_m": 0.0, **more}
    return Motion.model_validate({"path": path, **given})


def test_a_revolution_takes_its_length_over_the_speed() -> None:
    plunge, approach, drag = legs(motion(CIRCLE), dive_m=0.06, speed_factor=1)
    assert [leg.name for leg in (plunge, approach, drag)] == ["plunge", "approach", "drag"]
    assert drag.duration_s == pytest.approx(2 * math.pi * 0.02 / 0.01)
    assert drag.angular_speed_rad_s == pytest.approx(0.5)
    assert plunge.duration_s * plunge.velocity_m_s[2] == pytest.approx(-0.06)
    assert approach.duration_s * approach.velocity_m_s[0] == pytest.approx(0.02)


def test_clockwise_turns_the_heading_and_the_spin() -> None:
    clockwise = motion(
        {
            **CIRCLE,
            "direction": "cw",
        }
    )
    assert clockwise.path.direction_rad == pytest.approx(-math.pi / 2)
    assert legs(clockwise, 0.06, 1)[-1].angular_speed_rad_s == pytest.approx(-0.5)


def test_a_workpiece_that_keeps_its_orientation() -> None:
    assert legs(motion(CIRCLE, orientation="fixed"), 0.06, 1)[-1].kind == "circle"
    assert legs(motion(CIRCLE), 0.06, 1)[-1].kind == "rotate"


def test_a_line_that_starts_where_it_plunges_has_no_approach() -> None:
    plan = legs(motion(LINE), 0.06, 1)
    assert [leg.name for leg in plan] == ["plunge", "drag"]
    x, y, z = (v * plan[-1].duration_s for v in plan[-1].velocity_m_s)
    assert (x, y, z) == pytest.approx((0.02 * math.cos(math.pi / 6), 0.01, 0.0))


def test_the_speed_factor_shortens_every_leg() -> None:
    slow, fast = legs(motion(CIRCLE), 0.06, 1), legs(motion(CIRCLE), 0.06, 4)
    for one, other in zip(slow, fast, strict=True):
        assert one.duration_s == pytest.approx(4 * other.duration_s)


def test_farthest_reach_counts_the_end_of_a_line_and_the_plunge() -> None:
    end = math.hypot(-0.01 + 0.02 * math.cos(math.pi / 6), 0.005 + 0.01)
    assert farthest_reach(motion(LINE)) == pytest.approx(end)
    assert farthest_reach(motion(CIRCLE, plunge_at_m=[0, 0.03])) == pytest.approx(0.03)

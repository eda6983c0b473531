"""A bowl that moves: LIGGGHTS' formulas, the surface of a bed that turns, and what is refused."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_scenes import BED, script
from made_study import Made

from dragdeck.errors import InputError
from dragdeck.outlook.process import dimensionless, workpiece_notes
from dragdeck.physics.turning_bed import surface_rise, surface_tilt
from dragdeck.project import Project
from dragdeck.scenes.fit import clearances, fastest_motion
from dragdeck.scenes.moving_bowl import bed_in_motion, bowl_cautions
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.workpiece import fastest_surface
from dragdeck.script.formula import value_of
from dragdeck.study.bowl_motions.vibration import Vibration
from dragdeck.study.fidelity import Tolerance

RATE = 30 * math.tau / 60
TURNING = {"kind": "rotation", "rpm": 30}
ELLIPSE = {
    "kind": "vibration", "amplitude_m": [0.001, 0.0, 0.0008], "phase_deg": [0, 0, 90],
    "frequency_hz": 40, "ramp_s": 0.02,
}  # fmt: skip
REST = {"kind": "rest", "radius_m": 0.01, "bowl_rpm": 30}


# --- the surface of a bed that turns -------------------------------------------------------------


def test_a_bed_without_friction_is_a_liquid() -> None:
    """A parabola about the axis, of the same volume."""
    radius, rise = surface_rise(RATE, 9.81, 0.0, 0.0, 0.3)
    parabola = RATE**2 / (2 * 9.81) * (radius**2 - 0.3**2 / 2)
    np.testing.assert_allclose(rise, parabola, atol=1e-6)
    radius, rise = surface_rise(RATE, 9.81, 0.0, 0.1, 0.3)
    assert np.trapezoid(rise * radius, radius) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(rise) == pytest.approx(RATE**2 / (2 * 9.81) * (0.09 - 0.01), rel=1e-4)


def test_friction_keeps_a_bed_level_up_to_its_angle() -> None:
    """8 degrees at 10.9 rad/s and 55 mm, as measured; nothing below w^2 r / g = tan 26."""
    friction = math.radians(26)
    tilt = np.degrees(surface_tilt(10.9, 9.81, friction, np.array([0.04, 0.055])))
    assert tilt[0] == 0.0 and tilt[1] == pytest.approx(7.67, abs=0.01)
    _, rise = surface_rise(5.0, 9.81, friction, 0.0, 0.085)
    assert not rise.any()


def test_the_depth_is_measured_from_the_inclined_surface(moved: Made, project: Project) -> None:
    """For a path in a bowl that rotates, and for a workpiece at rest in it."""
    fast = {"kind": "rotation", "rpm": 150}
    for motion in ({"bowl": fast}, {"path": REST | {"bowl_rpm": 150}, "bowl": None}):
        case = moved(bed_friction_deg=10, **motion)
        bed = bed_in_motion(case.study, BED)
        assert BED.surface_m - 0.005 < bed.surface_m < BED.surface_m - 1e-4
        assert bed.top_m > BED.top_m + 1e-3
        scene = process_scene(case, BED)
        assert scene.case.surface_m == bed.surface_m
        (told,) = [caution for caution in scene.warnings if caution.code == "tilt"]
        tilt = math.degrees(math.atan((5 * RATE) ** 2 * 0.01 / 9.81)) - 10
        assert f"{tilt:.3g} degrees" in told.text
        assert scene.case.numbers["surface_tilt_deg"] == pytest.approx(tilt, rel=1e-6)
        assert any("surface below the path" in name for name, _ in dimensionless(case))
        flat = process_scene(moved(bed_friction_deg=89, **motion), BED)
        assert flat.case.surface_m == BED.surface_m
        assert not [caution for caution in flat.warnings if caution.code == "tilt"]


def test_a_bed_that_would_leave_the_bowl_is_refused(moved: Made) -> None:
    fast = {"kind": "rotation", "rpm": 900}
    with pytest.raises(InputError, match=r"the rim, 0.1 m[\s\S]*no particles are left"):
        process_scene(moved(bowl=fast, bed_friction_deg=0), BED)


# --- a bowl that rotates while the workpiece moves -----------------------------------------------


def test_the_bowl_rotates_below_a_moving_workpiece(moved: Made, project: Project) -> None:
    case = moved(bowl=TURNING)
    text, scene = script(case, project), process_scene(case, BED)
    (bowl,) = [line for line in text.splitlines() if line.startswith("fix bowl ")]
    assert float(bowl.split()[-1]) == pytest.approx(RATE)
    assert "move_drag" in text and "move/mesh mesh bowl" not in text
    assert scene.case.steady is not None and scene.case.bowl.meshed
    assert "30 1/min, counter-clockwise" in dict(workpiece_notes(case))["motion of the bowl"]
    assert fastest_motion(case) >= RATE * 0.025


@pytest.mark.parametrize(("rpm", "speed"), [(30, 0.02 - 0.01 * RATE), (-30, 0.02 + 0.01 * RATE)])
def test_speeds_are_relative_to_the_bowl(rpm: float, speed: float, moved: Made) -> None:
    """Of inertial number, forecast and impacts; the mesh moves in the frame of the machine."""
    case = moved(bowl={"kind": "rotation", "rpm": rpm})
    assert case.axis_speed_m_s == pytest.approx(abs(speed), rel=1e-6)
    assert fastest_surface(case) == pytest.approx(max(0.02, abs(speed)), rel=1e-6)


@pytest.mark.parametrize(
    ("share", "revolutions"), [(0.0, 1.0), (0.5, 2.0), (-1.0, 0.5), (3.0, 0.5), (1.0, None)]
)
def test_a_workpiece_meets_its_wake_later_in_a_bowl_that_follows(
    share: float, revolutions: float | None, moved: Made
) -> None:
    """The workpiece goes round at 2 rad/s, the bowl at so many times that."""
    rpm = share * 2 * 60 / math.tau
    bowl = {"bowl": {"kind": "rotation", "rpm": rpm}} if share else {}
    case = moved(path={"kind": "circle", "radius_m": 0.01, "revolutions": 2.5}, **bowl)
    wake = process_scene(case, BED).case.workpiece.wake_from_m
    if revolutions is None:
        assert wake is None
    else:
        assert wake == pytest.approx(revolutions * 0.02 * math.pi)


# --- a bowl that vibrates ------------------------------------------------------------------------


def vibration(**more: Any) -> Vibration:
    return Vibration.model_validate({**ELLIPSE, **more})


def test_the_formulas_add_up_to_the_sines() -> None:
    """From step to step, while the amplitudes rise and after."""
    bowl, step_s = vibration(phase_deg=[-30, 0, 90]), 5e-5
    motion = bowl.on_engine(step_s)

    def value(name: str, step: int) -> float:
        def known(word: str) -> float | None:
            given = {"step": float(step), "dt": step_s}
            return given[word] if word in given else value(word.removeprefix("v_"), step)

        found = value_of(motion.variables[name], known)
        assert found is not None
        return found

    steps = np.arange(1, 601)
    moved = [[value(f"bowl_v{axis}", step) * step_s for axis in "xyz"] for step in steps.tolist()]
    np.testing.assert_allclose(np.cumsum(moved, axis=0), bowl.shift(steps, step_s), atol=1e-14)


def test_a_vibration_rises_and_is_an_ellipse() -> None:
    bowl, step_s = vibration(), 1e-4
    assert not bowl.shift(np.zeros(1), step_s).any()
    steps = np.arange(200, 2000)
    x, y, z = bowl.shift(steps, step_s).T
    np.testing.assert_allclose((x / 0.001) ** 2 + (z / 0.0008) ** 2, 1.0, atol=1e-12)
    assert not y.any()
    whole = bowl.shift(np.arange(2000), step_s)
    fastest = np.linalg.norm(np.diff(whole, axis=0), axis=1).max() / step_s
    assert fastest <= bowl.displacement_speed_m_s
    assert bowl.faster(2).shift(steps, step_s / 2) == pytest.approx(bowl.shift(steps, step_s))


def test_a_bowl_that_vibrates_is_a_mesh_that_moves(moved: Made, project: Project) -> None:
    rest, case = moved(), moved(bowl=ELLIPSE)
    text, scene = script(case, project), process_scene(case, BED)
    move = "fix move_bowl all move/mesh mesh bowl linear/variable v_bowl_vx v_bowl_vy v_bowl_vz"
    assert text.count(move) == 1 and "surface_ang_vel" not in text
    assert text.index("variable bowl_vz equal") < text.index(move) < text.index("fix move_plunge")
    assert scene.case.bowl.meshed and scene.case.bowl.motion == case.study.motion.bowl
    assert "40 Hz" in dict(workpiece_notes(case))["motion of the bowl"]
    gaps, before = (clearances(one, BED.surface_m) for one in (case, rest))
    assert before.wall_m - gaps.wall_m == pytest.approx(0.001)
    assert before.floor_m - gaps.floor_m == pytest.approx(0.0008)


# --- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        ({"path": REST, "speed_m_s": None, "bowl": TURNING}, "rotates the bowl itself"),
        ({"path": REST, "speed_m_s": None, "bowl": ELLIPSE}, "rotates the bowl itself"),
        ({"bowl": TURNING | {"rpm": 0}}, "must rotate"),
        ({"bowl": ELLIPSE | {"amplitude_m": [0, 0, 0]}}, "all amplitudes are zero"),
        ({"bowl": {"kind": "shaking"}}, "rotation.*vibration"),
        ({"bowl": ELLIPSE | {"amplitude_m": [0, 0, 0.0033]}}, "leave the simulation box"),
    ],
)
def test_impossible_motions_are_refused(motion: dict[str, Any], says: str, moved: Made) -> None:
    with pytest.raises(InputError, match=f"(?s){says}"):
        process_scene(moved(**motion), BED)


def test_only_a_round_bowl_rotates_below_a_path(made: Made) -> None:
    trough = {"kind": "trough", "length_m": 0.08, "width_m": 0.05, "height_m": 0.1}
    with pytest.raises(InputError, match=r"motion.bowl: a bowl of kind trough cannot rotate"):
        made({"bowl": {"material": "steel", **trough}, "motion.bowl": TURNING})
    made({"bowl": {"material": "steel", **trough}, "motion.bowl": ELLIPSE})


@pytest.mark.parametrize("part", ["windows", "soft_start"])
def test_a_displaced_bowl_does_not_go_on_with_other_steps(part: str, moved: Made) -> None:
    blocks = {"windows": {"tolerance": 0.1}, "soft_start": {"youngs_modulus_scale": 1e-4}}
    settings = {"youngs_modulus_scale": 1e-3, part: blocks[part]}
    process_scene(moved(settings, path={"kind": "circle", "radius_m": 0.01, "revolutions": 4}), BED)
    with pytest.raises(InputError, match=rf"fidelity.{part}"):
        process_scene(moved(settings, bowl=ELLIPSE), BED)


def test_a_bed_in_a_bowl_at_rest_is_what_it_was(moved: Made) -> None:
    bed = replace(BED, margin_m=0.001)
    for motion in ({}, {"bowl": ELLIPSE}, {"bowl": TURNING}):
        assert bed_in_motion(moved(**motion).study, bed) is bed


@pytest.mark.parametrize("block", ["fidelity.soft_start", "fidelity.tolerance"])
def test_a_remedy_names_what_the_study_has(block: str, moved: Made) -> None:
    case = moved(
        {"youngs_modulus_scale": 1e-3, "soft_start": {"youngs_modulus_scale": 1e-4}}, bowl=ELLIPSE
    )
    if block.endswith("tolerance"):
        case = replace(case, requested=Tolerance(tolerance=0.1))
    with pytest.raises(InputError) as caught:
        process_scene(case, BED)
    assert caught.value.field == block


# --- what is warned of ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("motion", "code"),
    [
        ({"amplitude_m": [0, 0, 0.003], "frequency_hz": 80}, "thrown"),
        ({"amplitude_m": [0.003, 0, 0], "frequency_hz": 80}, None),
        ({"amplitude_m": [0, 0, 0.0005], "frequency_hz": 25}, None),
        ({"kind": "rotation", "rpm": 0.02 / 0.01 * 30 / math.pi}, "with_bowl"),
        ({"kind": "rotation", "rpm": -0.02 / 0.01 * 30 / math.pi}, None),
    ],
)
def test_a_motion_that_does_little_or_too_much_is_warned_of(
    motion: dict[str, Any], code: str | None, moved: Made
) -> None:
    bowl = motion if "kind" in motion else {**ELLIPSE, **motion}
    codes = {caution.code for caution in bowl_cautions(moved(bowl=bowl))}
    assert codes & {"thrown", "with_bowl"} == ({code} if code else set())


def test_amplitudes_that_rise_are_not_counted(moved: Made) -> None:
    """They begin to rise before the plunge."""
    motion = moved(bowl=ELLIPSE).study.motion
    entry_s = motion.immersion_depth_m / motion.plunge_speed_m_s
    entry_s += math.dist(motion.plunge_point, motion.path.start_point) / motion.approach_speed_m_s
    assert motion.uncounted_m == moved().study.motion.uncounted_m
    later = 1.5 * motion.transient_m / motion.nominal_speed_m_s
    slow = moved(bowl=ELLIPSE | {"ramp_s": entry_s + later}).study.motion
    assert slow.uncounted_m == pytest.approx(1.5 * motion.transient_m)
    with pytest.raises(InputError, match=r"motion.bowl.ramp_s: no path is left"):
        moved(bowl=ELLIPSE | {"ramp_s": 1e3})

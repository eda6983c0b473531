"""Motions that are superposed on the path: study fields, speeds, checks, input scripts."""

import math
import re
from typing import Any

import numpy as np
import pytest
from made_scenes import BED
from made_study import Made
from pydantic import ValidationError

from dragdeck.cases.bed import bed_timestep, widest_skin
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.scenes.fit import fastest_motion
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import workpiece_length
from dragdeck.study.drive import Drive
from dragdeck.study.motion import Motion
from dragdeck.study.superposed.oscillation import Oscillation
from dragdeck.study.superposed.spin import Spin

RATE = 300 * 2 * math.pi / 60
SCHEDULE = [{"until_s": 0.1, "rpm": 300}, {"until_s": 0.15, "rpm": -300}]


def superposed(case: Case) -> Any:
    return process_scene(case, BED).case.model_dump(mode="json").get("superposed")


def test_every_speed_grows_by_the_speed_factor(moved: Made) -> None:
    """Stages are as much shorter, so that the workpiece turns as far per metre of path."""
    motion = {
        "spin": {"schedule": SCHEDULE},
        "oscillation": {"amplitude_m": 1e-3, "frequency_hz": 5},
    }
    slow = moved(**motion)
    one, both = superposed(slow), []
    assert [each["kind"] for each in one] == ["oscillation", "spin"]
    fast = moved({"speed_factor": 2}, **motion)
    for before, after in zip(one[1]["stages"], superposed(fast)[1]["stages"], strict=True):
        assert after["rate_rad_s"] == pytest.approx(2 * before["rate_rad_s"])
        both.append(after["steps"] / before["steps"])
    assert both[0] == pytest.approx(0.5, rel=1e-3)
    assert superposed(fast)[0]["rate_rad_s"] == pytest.approx(2 * one[0]["rate_rad_s"])
    assert superposed(fast)[0]["amplitude_m"] == 1e-3
    assert fastest_motion(fast) == pytest.approx(2 * fastest_motion(slow))
    assert describe(fast) == describe(slow)


def drag(steps: int, timestep_s: float) -> Drive:
    """A drag from step 50."""
    return Drive(50, 50 + steps, timestep_s, length_m=1.0)


@pytest.mark.parametrize("timestep", [1e-5, 3.3e-4, 7e-3])
def test_stages_of_a_spin_end_where_they_should(timestep: float) -> None:
    """Their lengths are rounded to steps, not the angles at their ends."""
    spin = Spin.model_validate({"schedule": [*SCHEDULE, {"until_s": 5, "rpm": 100}], "ramp_s": 0})
    whole = round(0.4 / timestep)
    stages = spin.stages(drag(whole, timestep))
    turns = [steps * timestep * rate for steps, rate in stages]
    last = (whole * timestep - 0.15) * RATE / 3
    assert turns == pytest.approx([0.1 * RATE, -0.05 * RATE, last], rel=1e-12)


def test_a_motion_starts_smoothly_from_rest() -> None:
    """Speed and acceleration have no jump at either end of the ramp, and are never above it."""
    ramp, dt = 100, 1e-3
    spin = Spin(rpm=60, ramp_s=ramp * dt)
    oscillation = Oscillation(amplitude_m=1e-3, frequency_hz=9, ramp_s=ramp * dt)
    drive, steps = drag(400, dt), np.arange(401)
    assert [one.begin(drive).steps for one in (spin, oscillation)] == [ramp, ramp]
    angle = spin.turn(drive, steps)
    assert angle[ramp] == pytest.approx(math.tau * dt * ramp / 2)
    assert angle[-1] == pytest.approx(math.tau * dt * (400 - ramp / 2))
    speed = np.diff(angle) / dt / math.tau
    assert speed[0] < 1e-4 and speed.max() < 1 + 1e-12 and (np.diff(speed) > -1e-12).all()
    assert np.abs(np.diff(speed)).max() < 1.51 / ramp
    assert np.abs(np.diff(speed, 2)).max() < 6.1 / ramp**2
    lift = oscillation.shift(drive, steps)[:, 2]
    most = math.tau * 9 * 1e-3
    assert abs(lift[1]) / dt < 1e-4 * most
    assert np.abs(np.diff(lift)).max() / dt <= most
    assert np.abs(np.diff(lift, 2)).max() / dt**2 <= most * math.tau * 9


def test_no_statistic_includes_the_start(moved: Made) -> None:
    """The transient lasts at least as long, whatever the speed; a ramp to the end is refused."""
    ramp = {"spin": {"rpm": 60, "ramp_s": 0.2}}
    for factor in (1, 3):
        made = process_scene(moved({"speed_factor": factor}, **ramp), BED).case
        (spin,) = made.model_dump()["superposed"]
        assert spin["ramp_steps"] * made.timestep_s == pytest.approx(0.2 / factor, rel=1e-3)
        assert made.statistics.transient_s == pytest.approx(0.2 / factor, rel=1e-3)
    with pytest.raises(InputError, match=r"motion\.spin\.ramp_s") as caught:
        moved(spin={"rpm": 60, "ramp_s": 0.31})
    assert "at most" in str(caught.value)


def test_the_highest_surface_speed_counts_all_that_moves(moved: Made) -> None:
    motion = {"spin": {"rpm": 300}, "oscillation": {"amplitude_m": 2e-3, "frequency_hz": 5}}
    case = moved(**motion)
    radius = 0.004
    whole = 0.02 + RATE * radius + 2e-3 * 2 * math.pi * 5
    assert case.study.motion.surface_speed_m_s(radius) == pytest.approx(whole)
    assert fastest_motion(case) == pytest.approx(whole, rel=0.01)
    assert describe(case)["superposed_speed"] == pytest.approx(whole / 0.02 - 1, rel=0.01)
    plain = case.study.motion.model_copy(update={"spin": None, "oscillation": None})
    assert plain.surface_speed_m_s(radius) == 0.02


def test_a_drag_at_another_pace_spins_as_much_faster(moved: Made) -> None:
    motion = moved(spin={"rpm": 300}, counted_from_revolution=1).study.motion.at(2.0, 0.05)
    assert motion.spin is not None and motion.spin.rpm == 600


def test_a_workpiece_that_oscillates_is_as_much_longer(moved: Made) -> None:
    length = workpiece_length(moved())
    moving = moved(oscillation={"amplitude_m": 1e-3, "frequency_hz": 5})
    assert workpiece_length(moving) == pytest.approx(length + 1e-3)


@pytest.mark.parametrize(
    ("motion", "field", "words"),
    [
        ({"oscillation": {"amplitude_m": 0.012, "frequency_hz": 1}, "immersion_depth_m": 0.025},
         "motion.oscillation", "too deep"),
        ({"oscillation": {"amplitude_m": 0.005, "frequency_hz": 1}, "immersion_depth_m": 0.005},
         "motion.oscillation", "out of the packing"),
        ({"spin": {"rpm": 60000}}, "motion.spin", "neighbour skin per step"),
        ({"spin": {"schedule": [{"until_s": 1, "rpm": 1}, {"until_s": 2, "rpm": -60000}]}},
         "motion.spin", "neighbour skin per step"),
        ({"oscillation": {"amplitude_m": 1e-3, "frequency_hz": 3000}},
         "motion.oscillation", "neighbour skin per step"),
    ],
)  # fmt: skip
def test_motions_that_cannot_be(
    moved: Made, motion: dict[str, Any], field: str, words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        process_scene(moved(**motion), BED)
    text = str(caught.value)
    assert field in text
    assert "limit:" in text
    assert "remedy:" in text


def test_the_limit_of_a_drag_is_the_skin_and_the_remedy_names_one_that_does(
    small: dict[str, Any], made: Made
) -> None:
    small["fidelities"]["quick"]["speed_factor"] = 100
    case = made({"motion.plunge_speed_m_s": 0.1})
    has, step = widest_skin(case.study), bed_timestep(case.study, "timestep_fraction")
    limit = has / step / 100
    process_scene(made({"motion.plunge_speed_m_s": 0.999 * limit}), BED)
    with pytest.raises(InputError, match="neighbour skin per step") as caught:
        process_scene(made({"motion.plunge_speed_m_s": 1.5 * limit}), BED)
    (wide,) = re.findall(r"fidelity.skin_m of at least (\S+)", caught.value.remedy)
    small["fidelities"]["quick"]["skin_m"] = float(wide)
    process_scene(made({"motion.plunge_speed_m_s": 1.5 * limit}), BED)


def test_the_limit_of_a_spin_is_the_skin(moved: Made) -> None:
    case = moved()
    step, radius = bed_timestep(case.study, "timestep_fraction"), 0.004
    most = (widest_skin(case.study) / step - 0.02) / radius * 60 / (2 * math.pi)
    process_scene(moved(spin={"rpm": 0.99 * most}), BED)
    with pytest.raises(InputError, match="skin"):
        process_scene(moved(spin={"rpm": 1.01 * most}), BED)


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ({"spin": {}}, "either rpm or schedule"),
        ({"spin": {"rpm": 1, "schedule": SCHEDULE}}, "either rpm or schedule"),
        ({"spin": {"schedule": SCHEDULE[::-1]}}, r"schedule.1.until_s is 0.1, not above the 0.15"),
        ({"spin": {"schedule": [SCHEDULE[0]] * 2}}, "sort the entries by time"),
        ({"spin": {"schedule": []}}, "at least 1 item"),
        ({"oscillation": {"amplitude_m": 0, "frequency_hz": 1}}, "greater than 0"),
        ({"path": {"kind": "line", "start_m": [0, 0], "length_m": 0.1},
          "counted_from_revolution": 1}, "to circles only"),
    ],
)  # fmt: skip
def test_blocks_that_cannot_be(block: dict[str, Any], words: str) -> None:
    path = {"kind": "circle", "radius_m": 0.02}
    given = {"path": path, "speed_m_s": 0.01, "immersion_depth_m": 0.05, "transient_m": 0.0}
    with pytest.raises(ValidationError, match=words):
        Motion.model_validate(given | block)


def test_a_slip_of_the_unit_in_a_schedule_is_named(moved: Made) -> None:
    with pytest.raises(InputError, match=r"motion\.spin\.schedule\.0\.rpm: is not plausible"):
        moved(spin={"schedule": [{"until_s": 1, "rpm": 1e6}]})


def test_a_spin_of_zero_is_a_level_of_a_sweep(moved: Made) -> None:
    still = moved(spin={"rpm": 0})
    assert superposed(still) == [
        {"kind": "spin", "ramp_steps": 1724, "stages": [{"steps": 5416, "rate_rad_s": 0.0}]}
    ]
    assert PROCESS.run_id(still) != PROCESS.run_id(moved(spin={"rpm": 1}))


def test_statistics_from_a_revolution_on(moved: Made) -> None:
    """The later of the two counts: the end of the transient, or the start of the revolution."""
    path = {"kind": "circle", "radius_m": 0.01, "revolutions": 2.5}

    def transient(**more: Any) -> float:
        return process_scene(moved(path=path, **more), BED).case.statistics.transient_s

    assert transient() == pytest.approx(0.001 / 0.02, rel=1e-4)
    assert transient(counted_from_revolution=1) == pytest.approx(0.001 / 0.02, rel=1e-4)
    wanted = 4 * math.pi * 0.01 / 0.02
    assert transient(counted_from_revolution=3) == pytest.approx(wanted, rel=1e-4)
    with pytest.raises(InputError, match="counted_from_revolution: no path is left"):
        moved(path=path, counted_from_revolution=4)

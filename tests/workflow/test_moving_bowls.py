"""Bowls that move below a moving workpiece on LIGGGHTS: one that vibrates, one that rotates."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bowl_runs import accepted, process_of
from paths import SMALL_STUDY
from plate import engine

from dragchain import load_case, read_dump, write_tables
from dragchain.run.kinematics import drag_phase, motion_of
from dragchain.tables.by_step import read_table
from dragchain.tables.run_folder import Run
from dragdeck.decks.deck import Body, data_file

pytestmark = [pytest.mark.engine, pytest.mark.slow]

WATCHED = """{% extends "base/process.in.j2" %}
{% block extra %}
variable bowl_x equal f_bowl[7]
variable bowl_y equal f_bowl[8]
variable bowl_z equal f_bowl[9]
fix watch all print 1 "$(step) ${bowl_x} ${bowl_y} ${bowl_z}" file bowl.${part}.txt screen no
{% endblock %}
"""
"""Writes where the bowl is at each step, of a mesh that has a reference point."""

ELLIPSE = {
    "kind": "vibration", "amplitude_m": [0.0008, 0.0003, 0.001], "phase_deg": [0, 40, 90],
    "frequency_hz": 30, "ramp_s": 0.05,
}  # fmt: skip
LINE = {"kind": "line", "start_m": [-0.005, 0.001], "direction_deg": 30, "length_m": 0.006}
CIRCLE = {"kind": "circle", "radius_m": 0.01, "revolutions": 0.1}
RPM = 60.0


def moving(folder: Path, **motion: Any) -> Path:
    """The folder of a process of the small study, beside its finished filling."""
    study: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    study["media"]["count"] = 150
    study["motion"] |= {"immersion_depth_m": 0.006, "transient_m": 0.0, "speed_m_s": 0.04, **motion}
    study["motion"] |= {"plunge_speed_m_s": 0.5, "approach_speed_m_s": 0.5}
    study["outputs"] = {"n_checkpoints": 3}
    return process_of(folder, study, WATCHED if motion.get("bowl") == ELLIPSE else "")


def with_reference(process: Path, *, alone: bool = False) -> None:
    """Give the bowl a reference point, which LIGGGHTS moves with it; or leave one particle."""
    file = process / "in.liggghts"
    text = file.read_text()
    text = re.sub(
        r"fix bowl all mesh/surface (.*)", r"fix bowl all mesh/surface/stress \1 "
        "reference_point 0.0 0.0 0.0", text
    )  # fmt: skip
    if alone:
        box = ((-0.032, 0.032), (-0.032, 0.032), (-0.0033, 0.25))
        body = [Body(1, 3e-3, 2656.0, (0.0, 0.0, 0.01), (0.0, 0.0, 0.0))]
        (process / "alone.data").write_text(data_file("one particle", 2, box, body))
        text = text.replace("read_restart ${from}", "read_data alone.data")
    file.write_text(text)


def off_motion(process: Path, part: int = 1) -> float:
    """How far the bowl is from where the study has it, at most, m."""
    case = load_case(process)
    rows = np.loadtxt(process / f"bowl.{part}.txt", comments="#")
    steps, place = rows[:, 0].astype(int), rows[:, 1:]
    assert steps[-1] == case.phases[-1].end_step
    assert len(steps) > 1000 and np.ptp(place, axis=0).min() > 0.0005
    bowl = motion_of(case).bowl
    assert bowl is not None
    return float(np.abs(place - bowl.shift(steps, case.timestep_s)).max())


def off_path(process: Path) -> float:
    """How far the workpiece is from its path, which is that in the machine, at most, m."""
    case = load_case(process)
    moved, start = motion_of(case), drag_phase(case).start_step
    rows = np.loadtxt(process / "workpiece_force.1.txt", skiprows=1)
    steps, place = rows[:, 0].astype(int) - start, rows[:, 8:11]
    begun = np.array([*moved.motion.path.start_point, place[-1, 2]])
    dragged = steps > 0
    assert dragged.sum() > 50 and np.ptp(place[dragged, :2], axis=0).max() > 0.002
    return float(np.abs(place - moved.places(steps, begun))[dragged].max())


def resumed(process: Path) -> int:
    """Go on from the last checkpoint but one, on two ranks; the step of the checkpoint."""
    written = sorted(int(file.name.split(".")[1]) for file in process.glob("checkpoint.*.restart"))
    engine(process, ranks=2, part=2, source=process / f"checkpoint.{written[-2]}.restart")
    return written[-2]


# --- a bowl that vibrates ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shaken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    process = moving(tmp_path_factory.mktemp("shaken"), bowl=ELLIPSE, path=LINE)
    with_reference(process)
    engine(process)
    write_tables(process)
    return process


def test_a_filled_bowl_vibrates_exactly(shaken: Path) -> None:
    assert off_motion(shaken) < 1e-8
    accepted(shaken)


def test_the_bed_vibrates_with_the_bowl(shaken: Path) -> None:
    """Relative to the bowl, particles at the floor stay above it; at rest they would be below."""
    opened = Run.open(shaken)
    particles = read_table(shaken / "tables/particles.parquet", ["step", "z_m", "radius_m"])
    bowl = motion_of(opened.case).bowl
    assert bowl is not None
    shift = bowl.shift(particles["step"].to_numpy(), opened.case.timestep_s)[:, 2]
    gap = particles["z_m"] - particles["radius_m"]
    assert (gap - shift).min() > -2e-5
    assert gap.min() < -2e-4
    contacts = read_table(shaken / "tables/contacts.parquet")
    floor = contacts[contacts["kind"] == "particle-floor"]
    moved = bowl.shift(floor["step"].to_numpy(), opened.case.timestep_s)[:, 2]
    np.testing.assert_allclose(floor["point_z_m"], moved, atol=2e-5)


def test_the_workpiece_keeps_its_path(shaken: Path) -> None:
    assert off_path(shaken) < 1e-9


def test_a_resumed_bowl_vibrates_on(shaken: Path) -> None:
    resumed(shaken)
    assert off_motion(shaken, part=2) < 1e-8


def test_an_empty_bowl_vibrates_exactly(tmp_path: Path) -> None:
    process = moving(tmp_path, bowl=ELLIPSE, path=LINE)
    with_reference(process, alone=True)
    engine(process)
    assert off_motion(process) < 1e-8


# --- a bowl that rotates -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bowl = {"kind": "rotation", "rpm": RPM}
    process = moving(tmp_path_factory.mktemp("turning"), bowl=bowl, path=CIRCLE)
    engine(process)
    write_tables(process)
    return process


def bed_rate(x: np.ndarray, y: np.ndarray, vx: np.ndarray, vy: np.ndarray) -> float:
    """Mean angular speed of particles over that of the bowl."""
    momentum = x * vy - y * vx
    return float(momentum.sum() / (x**2 + y**2).sum() / (RPM * 2 * np.pi / 60))


def test_the_bed_turns_below_a_moving_workpiece(turning: Path) -> None:
    """The workpiece goes round in the frame of the machine and slows the bed down a little."""
    names = ["step", "x_m", "y_m", "vx_m_s", "vy_m_s"]
    particles = read_table(turning / "tables/particles.parquet", names)
    last = particles[particles["step"] == particles["step"].max()]
    assert 0.5 < bed_rate(*(last[name].to_numpy() for name in names[1:])) < 1.02
    assert off_path(turning) < 1e-9


def test_a_resumed_bed_turns_on(turning: Path) -> None:
    begun = resumed(turning)
    columns = Run.open(turning).outputs["particles"].columns
    *_, frame = read_dump(turning / "particles.2.bin", columns)
    assert frame.step > begun and frame.rows == 150
    vectors = (frame.vectors(*axes) for axes in (("x_m", "y_m"), ("vx_m_s", "vy_m_s")))
    assert 0.5 < bed_rate(*np.hstack([*vectors]).T) < 1.02

"""Heaps and drums of a calibration: which are refused, and what LIGGGHTS makes of them."""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_study import Made

from dragchain.calibration.angle_runs import angle_runs, run_angles
from dragchain.calibration.angles import read_angle
from dragchain.run.run_parts import iter_frames
from dragdeck.cases.case import Case
from dragdeck.decks.outputs import load_outputs
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.angles import AngleRun, angle_scene
from dragdeck.scenes.process import SCENES

REPOSE = {"angle_deg": 25, "angle_std_deg": 1, "cylinder_radius_m": 0.02, "count": 300}
DRUM = {"angle_deg": 30, "angle_std_deg": 1, "radius_m": 0.035, "width_m": 0.03}
DRUM |= {"fill_fraction": 0.4, "rpm": 30}
ANGLES: dict[str, Any] = {"repose": REPOSE, "drum": DRUM}


@pytest.fixture
def measured_case(made: Made) -> Case:
    return made({"calibration": {"angles": deepcopy(ANGLES)}})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"repose.angle_deg": 0}, "repose.angle_deg.*out of range"),
        ({"repose.angle_deg": 90}, "repose.angle_deg.*out of range"),
        ({"drum.angle_std_deg": 0}, "drum.angle_std_deg.*out of range"),
        ({"repose.cylinder_radius_m": 0.016}, "cylinder_radius_m.*less room than 5.*0.01635"),
        ({"repose.count": 200}, "repose.count.*out of range"),
        ({"drum.fill_fraction": 0.6}, "drum.fill_fraction.*out of range"),
        ({"drum.radius_m": 0.02}, "drum.radius_m.*less room than 5 particle diameters"),
        ({"drum.width_m": 0.01}, "drum.width_m.*less room than 5 particle diameters"),
        ({"drum.rpm": 90}, "drum.rpm.*too fast.*at most 50.6"),
        ({"friction": [0.5, 0.4]}, "a range must increase"),
        ({"repose": None, "drum": None}, "give repose, drum or both"),
    ],
)
def test_what_cannot_be_simulated_is_refused(
    changes: dict[str, object], said: str, made: Made
) -> None:
    fields = {f"calibration.angles.{name}": value for name, value in changes.items()}
    with pytest.raises(InputError, match=f"(?s){said}"):
        made({"calibration.angles": deepcopy(ANGLES), **fields})


def test_a_calibration_measures_something(made: Made) -> None:
    with pytest.raises(InputError, match="give record, angles or both"):
        made({"calibration": {"height_std_m": 1e-4}})


def test_an_overfull_drum_is_refused_before_any_run(
    measured_case: Case, project: Project, tmp_path: Path, made: Made
) -> None:
    narrow = made({"calibration": {"angles": {"drum": {**DRUM, "radius_m": 0.0231}}}})
    batch = Batch(tmp_path / "angles", environment(project.templates))
    with pytest.raises(InputError, match="does not hold its particles"):
        run_angles(narrow, batch, silent)
    assert not (tmp_path / "angles").exists()


def test_the_coefficients_fill_their_ranges(measured_case: Case, case: Case) -> None:
    assert measured_case.study.calibration and measured_case.study.calibration.angles
    angles = measured_case.study.calibration.angles
    runs = angle_runs(angles)
    assert len(runs) == 2 * 25 and {one.rig for one in runs.values()} == {"repose", "drum"}
    for name in ("friction", "rolling_friction"):
        low, high = getattr(angles, name)
        values = sorted({getattr(one, name) for one in runs.values()})
        parts = [((value - low) / (high - low)) ** 0.5 for value in values]
        assert len(values) == 20 and np.diff([0, *parts, 1]).max() < 0.2
    assert all(SCENES[name].run_id(case) == SCENES[name].run_id(measured_case) for name in SCENES)


def test_another_measured_angle_needs_no_other_runs(measured_case: Case, made: Made) -> None:
    one = AngleRun(rig="drum", friction=0.3, rolling_friction=0.1, seed=1)
    other = made({"calibration": {"angles": {"drum": {**DRUM, "angle_deg": 35}}}})
    assert angle_scene(measured_case, one).case == angle_scene(other, one).case


@pytest.mark.engine
@pytest.mark.parametrize("rig", ["repose", "drum"])
def test_the_angle_grows_with_the_coefficients(
    rig: Any, measured_case: Case, project: Project, tmp_path: Path
) -> None:
    """The glued layer stays where it is, or turns with the drum."""
    found = []
    for friction, rolling in ((0.05, 0.005), (0.8, 0.3)):
        one = AngleRun(rig=rig, friction=friction, rolling_friction=rolling, seed=1)
        scene, folder = angle_scene(measured_case, one), tmp_path / f"{friction}"
        write_run(scene, folder, environment(project.templates))
        assert run(folder, silent).state == "complete"
        found.append(float(read_angle(folder)["angle_deg"]))
    assert found[1] > found[0] + 5
    first, *_, last = iter_frames(folder, load_outputs(folder)["particles"])
    turned = []
    for frame in (first, last):
        glued = frame.take(np.argsort(frame.ids("particle_id"))[: scene.deck.glued])  # type: ignore[attr-defined]
        turned.append(glued.vectors("x_m", "y_m", "z_m"))
    angle = np.pi * last.step * scene.case.timestep_s if rig == "drum" else 0.0
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    assert turned[1][:, 2] == pytest.approx(turned[0][:, 2], abs=1e-9)
    assert turned[1][:, :2] == pytest.approx(turned[0][:, :2] @ turn, abs=1e-7)

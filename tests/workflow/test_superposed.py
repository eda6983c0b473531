"""Superposed motions on LIGGGHTS: where both packages and the engine say that the workpiece is."""

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pandas as pd
import pytest
import yaml
from loading_files import STEP_S
from made_run import line, with_motion
from paths import ROOT, SMALL_STUDY
from plate import FRICTION, GRAVITY, MASS, engine, write_plate

from dragchain import load_case, write_tables
from dragchain.loading.samples import TOUCHED, sample
from dragchain.loading.wear import first_touches
from dragchain.loading.write import compute_loading
from dragchain.run.kinematics import axis_speed, drag_phase, headings, motion_of, workpiece_rotation
from dragchain.run.workpiece import read_surface
from dragdeck.decks import outputs
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run_to_outcome
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.scene import read_bed
from dragdeck.study.drive import Drive
from dragdeck.study.rotations import rotated
from dragdeck.study.superposed.spin import Spin
from dragdeck.sweep.cases import load_cases

pytestmark = [pytest.mark.engine, pytest.mark.slow]

CORNERS = """{% extends "base/process.in.j2" %}
{% block extra %}
dump corners all mesh/stl {{ deck.thermo_steps // 5 }} corners.*.stl workpiece
{% endblock %}
"""
"""Writes the corners of the workpiece's facets, more often than network frames."""

LINE = {"kind": "line", "start_m": [-0.005, 0.001], "direction_deg": 30, "length_m": 0.004}
CIRCLE = {"kind": "circle", "radius_m": 0.01, "revolutions": 0.06}
WAYPOINTS = {
    "path": {
        "kind": "waypoints",
        "points": [
            [7, -0.004, 0.001], [7.05, -0.003, 0.002, 0.001], [7.07, -0.003, 0.002, 0.001],
            [7.11, -0.003, 0.002, -0.0007], [7.18, -0.0022, 0.0005],
        ],
    },
    "speed_m_s": None,
}  # fmt: skip
"""Obliquely up, a pause, straight down, and on."""
TURNS = [0, 90, 90, -30, 20]
TURNING = {
    "path": {
        "kind": "waypoints",
        "points": [
            [*[*point, 0.0][:4], turn]
            for point, turn in zip(WAYPOINTS["path"]["points"], TURNS, strict=True)  # type: ignore[index]
        ],
    },
    "speed_m_s": None,
}
REVERSING = {"schedule": [{"until_s": 0.06, "rpm": 300}, {"until_s": 0.12, "rpm": -600}]}
UP_AND_DOWN = {"amplitude_m": 0.001, "frequency_hz": 6}


EIGHT = {"kind": "figure_eight", "radius_m": 0.001, "direction_deg": 40, "loops": 0.6}
LEANING = [[0, 0, 0], [15, -10, 20], [15, -10, 20], [-60, 20, -15], [-80, 0, 10]]
INCLINED = {
    "path": {
        "kind": "waypoints",
        "points": [
            [*point[:4], *turns]
            for point, turns in zip(TURNING["path"]["points"], LEANING, strict=True)  # type: ignore[index]
        ],
    },
    "speed_m_s": None,
}
"""Waypoints with turn, pitch and roll."""

MOTIONS: dict[str, dict[str, Any]] = {
    "planetary": {"path": CIRCLE, "spin": {"rpm": -400}},
    "clockwise": {
        "path": CIRCLE | {"direction": "cw"}, "spin": REVERSING, "oscillation": UP_AND_DOWN,
    },
    "fixed": {
        "path": CIRCLE, "orientation": "fixed", "spin": REVERSING, "oscillation": UP_AND_DOWN,
    },
    "line": {"path": LINE, "spin": REVERSING, "oscillation": UP_AND_DOWN},
    "tilted": {"path": CIRCLE, "tilt_deg": 20},
    "waypoints": WAYPOINTS,
    "waypoints-spin": {**WAYPOINTS, "spin": REVERSING, "oscillation": UP_AND_DOWN},
    "waypoints-turn": {**TURNING, "oscillation": UP_AND_DOWN},
    "tilt-spin-fixed": {
        "path": CIRCLE | {"direction": "cw"}, "tilt_deg": -15, "orientation": "fixed",
        "spin": REVERSING, "oscillation": UP_AND_DOWN,
    },
    "tilt-spin-line": {"path": LINE, "tilt_deg": 30, "spin": REVERSING},
    "eight": {"path": EIGHT, "oscillation": UP_AND_DOWN},
    "eight-fixed": {"path": EIGHT, "orientation": "fixed", "ramp_s": 0.05},
    "eight-tilt-spin": {"path": EIGHT, "tilt_deg": 20, "spin": {"rpm": -300}, "ramp_s": 0.1},
    "start": {"path": CIRCLE, "ramp_s": 0.08, "spin": {"rpm": 200}},
    "start-line": {"path": LINE, "ramp_s": 0.05},
    "inclined": INCLINED,
    "inclined-tilt": {**INCLINED, "tilt_deg": 10},
}  # fmt: skip


class Runs:
    """Process runs of the small study with few particles; they share a filling."""

    def __init__(self, folder: Path) -> None:
        for name in ("templates", "meshes"):
            (folder / name).symlink_to(ROOT / name)
        self.study = folder / "studies/small"
        (self.study / "templates").mkdir(parents=True)
        (self.study / "templates/process.in.j2").write_text(CORNERS)
        self.project = Project(folder)
        self.templates = environment(self.project.templates, self.study / "templates")
        self.beds: dict[int, Bed] = {}
        self.done: dict[str, Path] = {}

    def rendered(
        self, count: int, force_hz: float = 1000, touches: float = 0.0, **motion: Any
    ) -> Path:
        """The folder of a process run, not yet run, with a filling that is."""
        data = yaml.safe_load(SMALL_STUDY.read_text())
        data["media"]["count"] = count
        data["motion"] |= {"plunge_speed_m_s": 0.5, "approach_speed_m_s": 0.5, **motion}
        data["outputs"] = {
            "n_checkpoints": 3, "workpiece_force_hz": force_hz, "first_touch_fraction": touches,
        }  # fmt: skip
        (self.study / "study.yaml").write_text(yaml.safe_dump(data))
        (case,) = load_cases(self.study / "study.yaml")
        if count not in self.beds:
            filling = self.project.run_folder(case, FILLING)
            write_run(FILLING.build(case, None), filling, self.templates)
            run_to_outcome(filling, filling / "outcome.json", silent)
            write_tables(filling)
            self.beds[count] = read_bed(filling / "tables/packing.json")
        process = self.project.run_folder(case, PROCESS)
        write_run(PROCESS.build(case, self.beds[count]), process, self.templates)
        return process

    def shallow(self, **motion: Any) -> Path:
        """The same in a shallow bed, with the reference point at each step."""
        return self.rendered(120, 1e5, immersion_depth_m=0.004, transient_m=0.0, **motion)

    def driven(self, name: str) -> Path:
        """A finished run with one of the motions."""
        if name not in self.done:
            self.done[name] = self.shallow(**MOTIONS[name])
            engine(self.done[name])
        return self.done[name]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    return Runs(tmp_path_factory.mktemp("project"))


def reference(folder: Path, part: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Steps of the drag, and where the engine has the reference point then."""
    rows = np.loadtxt(folder / f"workpiece_force.{part}.txt", skiprows=1)
    steps = rows[:, 0].astype(int)
    dragged = steps > drag_phase(load_case(folder)).start_step
    return steps[dragged], rows[dragged, 8:11]


def farthest_corner(folder: Path, steps: np.ndarray, ref_m: np.ndarray) -> float:
    """How far the engine's facets lie from where dragchain has them, at most, m."""
    case, surface, off, frames = load_case(folder), read_surface(folder, load_case(folder)), 0.0, 0
    for step, place in zip(steps, ref_m, strict=True):
        file = folder / f"corners.{step}.stl"
        if file.is_file():
            mesh, frames = meshio.stl.read(file), frames + 1
            at = np.array([step])
            heading = headings(at, place[None, :2], case)
            turn = workpiece_rotation(at, heading, case).matrices[0]
            corners = mesh.points[mesh.cells_dict["triangle"]]
            off = max(off, float(np.abs(corners - surface.corners @ turn.T - place).max()))
    assert frames > 1
    return off


SHORT = ("clockwise", "fixed", "waypoints-spin", "tilt-spin-fixed", "eight", "start", "inclined")
"""Motions with all that a script can contain; the others take minutes more."""


def motions(*names: str) -> pytest.MarkDecorator:
    """One test for each; all of them when all tests are wanted."""
    long = pytest.mark.long
    return pytest.mark.parametrize(
        "name", [pytest.param(name, marks=[long] * (name not in SHORT)) for name in names]
    )


@motions(*MOTIONS)
def test_the_engine_moves_the_workpiece_as_both_packages_say(runs: Runs, name: str) -> None:
    """The reference point to 1e-9 m at each step, the facets to the digits of an STL file."""
    folder = runs.driven(name)
    steps, place = reference(folder)
    assert off_pose(folder, steps, place) < 1e-9
    assert farthest_corner(folder, steps, place) < 1e-7


def off_pose(folder: Path, steps: np.ndarray, place: np.ndarray) -> float:
    """How far the engine's reference point is from where its motion has it, at most, m."""
    case = load_case(folder)
    start, moved = drag_phase(case).start_step, motion_of(case)
    rows = np.loadtxt(folder / "workpiece_force.1.txt", skiprows=1)
    begun = np.array([*moved.motion.path.start_point, rows[rows[:, 0] == start, 10][0]])
    return float(np.abs(place - moved.places(steps - start, begun)).max())


@pytest.mark.parametrize("rpm", [pytest.param(30, marks=pytest.mark.long), -30])
def test_the_bed_rotates_with_the_bowl_about_a_workpiece_at_rest(runs: Runs, rpm: float) -> None:
    """The same way and no faster, slowed by the workpiece; the drag is along the bed's motion."""
    path = {"kind": "rest", "radius_m": 0.01, "bowl_rpm": rpm, "revolutions": 0.15}
    folder = runs.shallow(path=path, speed_m_s=None)
    engine(folder)
    write_tables(folder)
    _, place = reference(folder)
    assert np.ptp(place, axis=0).max() < 1e-12
    beds = pd.read_parquet(folder / "tables/particles.parquet")
    x, y = beds["x_m"].to_numpy(), beds["y_m"].to_numpy()
    momentum = x * beds["vy_m_s"].to_numpy() - y * beds["vx_m_s"].to_numpy()
    rate = momentum.sum() / (x**2 + y**2).sum() / (rpm * 2 * np.pi / 60)
    assert 0.3 < rate < 1.02
    force = pd.read_parquet(folder / "tables/workpiece_force.parquet").query("in_statistics")
    assert np.sign(force["force_y_n"].mean()) == np.sign(rpm)
    assert force["drag_n"].mean() < 0


@motions("planetary", "waypoints-spin", "tilt-spin-fixed", "eight-tilt-spin", "inclined-tilt")
def test_a_resumed_run_continues_the_motion(runs: Runs, name: str) -> None:
    """A restart file keeps neither axis nor moved centre. Of stages, from within the second."""
    folder = runs.driven(name)
    case, whole = load_case(folder), reference(folder)
    drag = drag_phase(case)
    several = [one.model_dump().get("stages", []) for one in case.superposed]
    begun = drag.start_step + max((one[0]["steps"] for one in several if len(one) > 1), default=0)
    written = [int(file.name.split(".")[1]) for file in folder.glob("checkpoint.*.restart")]
    step = min(step for step in written if step > begun + 100)
    for file in folder.glob("corners.*"):
        file.unlink()
    engine(folder, part=2, source=folder / f"checkpoint.{step}.restart")
    steps, place = reference(folder, part=2)
    assert drag.end_step == steps[-1]
    np.testing.assert_allclose(place, whole[1][np.isin(whole[0], steps)], atol=1e-11)
    assert off_pose(folder, steps, place) < 1e-9
    assert farthest_corner(folder, steps, place) < 1e-7


def test_a_resumed_run_sees_the_same_first_touches(runs: Runs) -> None:
    """Up to where it goes on they are the same to the bit, and no contact is seen to begin anew."""
    folder = runs.rendered(
        120, 1e4, 0.6, immersion_depth_m=0.004, transient_m=0.0, path=LINE
    )  # fmt: skip
    engine(folder)
    write_tables(folder)
    whole = pd.read_parquet(folder / "tables/touches.parquet")
    written = [int(file.name.split(".")[1]) for file in folder.glob("checkpoint.*.restart")]
    step = min(step for step in written if step > whole["step"].min() + 100)
    engine(folder, part=2, source=folder / f"checkpoint.{step}.restart")
    write_tables(folder)
    found = pd.read_parquet(folder / "tables/touches.parquet")
    before = found["step"] <= step
    pd.testing.assert_frame_equal(found[before], whole[whole["step"] <= step])
    assert found["step"].max() == pytest.approx(whole["step"].max(), abs=100)
    assert not found.duplicated(["step", "particle_id", "facet_id"]).any()
    touching = set(found.loc[found["step"] == step, "particle_id"])
    case = load_case(folder)
    events = first_touches(folder, sample(folder, case, TOUCHED), case)
    since = events["start_s"] / case.timestep_s - step
    assert touching
    assert not touching & set(events.loc[(since > 0) & (since < 3), "particle_id"])


def test_a_reversal_reverses_the_torque(runs: Runs) -> None:
    """Facets gather in the body frame, whose sums are those of the workpiece; work is power."""
    schedule = [{"until_s": 0.12, "rpm": 300}, {"until_s": 1, "rpm": -300}]
    path = {"kind": "circle", "radius_m": 0.01, "revolutions": 0.07}
    spin = {"schedule": schedule, "ramp_s": 0.02}
    deep = {"immersion_depth_m": 0.025, "plunge_speed_m_s": 0.15}
    folder = runs.rendered(300, path=path, spin=spin, transient_m=1e-4, **deep)
    engine(folder)
    write_tables(folder)
    case = load_case(folder)
    force = pd.read_parquet(folder / "tables/workpiece_force.parquet")
    force = force[force["in_statistics"]]
    stages = case.superposed[0].model_dump()["stages"]
    middle = drag_phase(case).start_step + stages[0]["steps"]
    first = force["step"].to_numpy() <= middle
    torque = force["torque_z_n_m"].to_numpy()
    assert torque[first].mean() < 0 < torque[~first].mean()
    assert (torque[first] < 0).mean() > 0.9
    assert (torque[~first] > 0).mean() > 0.9

    world, body = (force[[f"{name}_{axis}_n" for axis in "xyz"]] for name in ("force", "body"))
    turn = force["turn_rad"].to_numpy()
    np.testing.assert_allclose(rotated(body.to_numpy(), turn), world, atol=1e-12)

    found = compute_loading(folder)
    contacts = pd.read_parquet(folder / "tables/workpiece_contacts.parquet", columns=["step"])
    sampled = force[force["step"].isin(contacts["step"])]
    interval = found.summary.sample_interval_s
    impulse = found.facets[[f"body_{axis}_impulse_n_s" for axis in "xyz"]].to_numpy().sum(axis=0)
    whole = sampled[[f"body_{axis}_n" for axis in "xyz"]].to_numpy().sum(axis=0) * interval
    np.testing.assert_allclose(impulse, whole, atol=0.02 * np.linalg.norm(whole))
    assert found.summary.closure.point_off_facet_max_m < 1e-6

    rate = np.where(sampled["step"] <= middle, 1, -1) * 300 * 2 * np.pi / 60
    rate += axis_speed(case) / path["radius_m"]
    power = -(sampled["drag_n"] * axis_speed(case) + sampled["torque_z_n_m"] * rate)
    work = found.summary.totals["workpiece_work_j"]
    assert work == pytest.approx(power.sum() * interval, rel=0.05)


def test_contacts_lie_on_an_inclined_workpiece_that_spins(runs: Runs) -> None:
    """In its own frame contacts are on their facets, and their work is the power of the motion."""
    path, tilt, rpm = {"kind": "circle", "radius_m": 0.01, "revolutions": 0.07}, 15, 200
    deep = {"immersion_depth_m": 0.02, "plunge_speed_m_s": 0.15, "transient_m": 1e-4}
    folder = runs.rendered(300, path=path, tilt_deg=tilt, spin={"rpm": rpm, "ramp_s": 0.02}, **deep)
    engine(folder)
    write_tables(folder)
    case, found = load_case(folder), compute_loading(folder)
    assert found.summary.closure.point_off_facet_max_m < 1e-6
    force = pd.read_parquet(folder / "tables/workpiece_force.parquet").query("in_statistics")
    world, body = (force[[f"{name}_{axis}_n" for axis in "xyz"]] for name in ("force", "body"))
    np.testing.assert_allclose(
        np.linalg.norm(body, axis=1), np.linalg.norm(world, axis=1), atol=1e-12
    )
    contacts = pd.read_parquet(folder / "tables/workpiece_contacts.parquet", columns=["step"])
    sampled = force[force["step"].isin(contacts["step"])]
    lean, heading = np.radians(tilt), sampled["direction_rad"].to_numpy()
    across, up = np.sin(lean) * np.ones_like(heading), np.cos(lean) * np.ones_like(heading)
    axis = np.column_stack([across * np.cos(heading), across * np.sin(heading), up])
    turning = rpm * 2 * np.pi / 60 * axis
    turning[:, 2] += axis_speed(case) / path["radius_m"]
    torque = sampled[[f"torque_{axis}_n_m" for axis in "xyz"]].to_numpy()
    power = -(sampled["drag_n"] * axis_speed(case) + (torque * turning).sum(axis=1))
    work = found.summary.totals["workpiece_work_j"]
    assert work == pytest.approx(power.sum() * found.summary.sample_interval_s, rel=0.05)


# --- a particle on a spinning plate --------------------------------------------------------------

STEPS, SPEED, RPM = 200, 0.1, 200.0


def test_a_particle_on_a_moving_and_spinning_plate_slips_as_it_should(tmp_path: Path) -> None:
    """At first it rests: the plate's velocity v + w x r is the slip, and friction mu m g along it.

    Friction then accelerates its centre by mu g, and its surface by another 5/2 mu g.
    """
    drag = Drive(0, STEPS, STEP_S / 10, length_m=SPEED * STEPS * STEP_S / 10)
    written = outputs.in_writing_order(
        [
            outputs.workpiece_force(20, STEPS, "workpiece"),
            outputs.workpiece_particles(20, 0, STEPS),
            outputs.workpiece_contacts(20, 0, STEPS, several=False),
        ]
    )
    spin = Spin(rpm=RPM, ramp_s=0.0)
    made = write_plate(tmp_path, spin, drag, written)
    made = with_motion(made, **line(SPEED), spin={"rpm": RPM, "ramp_s": 0})
    (tmp_path / "case.json").write_text(json.dumps(made))
    engine(tmp_path)
    write_tables(tmp_path)
    rows = pd.read_parquet(tmp_path / "tables/workpiece_contacts.parquet").iloc[1:]
    time = rows["step"].to_numpy() * drag.timestep_s
    point = rows[["point_x_m", "point_y_m"]].to_numpy()
    rate = RPM * 2 * np.pi / 60
    arm = point - np.column_stack([SPEED * time, np.zeros(len(time))])
    plate = np.column_stack([SPEED - rate * arm[:, 1], rate * arm[:, 0]])
    along = plate / np.linalg.norm(plate, axis=1)[:, None]
    slip = -(np.linalg.norm(plate, axis=1) - 3.5 * FRICTION * GRAVITY * time)[:, None] * along
    np.testing.assert_allclose(rows[["slip_x_m_s", "slip_y_m_s"]], slip, atol=0.005 * 0.2)
    force = -rows[["force_x_n", "force_y_n"]].to_numpy()
    np.testing.assert_allclose(force, FRICTION * MASS * GRAVITY * along, rtol=0.02, atol=2e-6)

"""A recorded path: its file, the speeds that follow from it, checks, input script."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from made_scenes import BED, script

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.preview.layout import layout
from dragdeck.project import Project
from dragdeck.scenes.fit import clearances, fastest_motion
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import workpiece_length
from dragdeck.study.check import warnings
from dragdeck.study.stages import in_steps
from dragdeck.sweep.cases import load_cases

POINTS = [[2, -0.01, 0], [2.2, -0.006, 0], [2.3, -0.006, 0, 0.001], [2.5, -0.006, 0, 0.001],
          [2.7, -0.006, 0.008]]  # fmt: skip
"""Along x at 0.02 m/s, up, a pause, and along y and down at about 0.04 m/s."""
TURNING = [[*[*point, 0.0][:4], 45 * number] for number, point in enumerate(POINTS)]
LENGTH = 0.004 + 0.001 + math.hypot(0.008, 0.001)
CSV = "time_s,x_m,y_m,z_m\n" + "".join(
    f"{','.join(map(str, point))}{',0' * (4 - len(point))}\n" for point in POINTS
)
Made = Callable[..., Case]


@pytest.fixture
def made(small: dict[str, Any], write_study: Callable[..., Path]) -> Made:
    """The small study on a recorded path: these fields of it, or its file with this text."""

    def make(text: str | None = None, motion: Any = None, factor: float = 1, **path: Any) -> Case:
        given = {"points": POINTS} if text is None and "points" not in path else {}
        given = {"file": "path.csv"} if text is not None else given
        small["motion"] |= {"path": {"kind": "waypoints", **given, **path}, "speed_m_s": None}
        small["motion"] |= motion or {}
        small["fidelities"]["quick"]["speed_factor"] = factor
        file = write_study(small)
        if text is not None:
            (file.parent / "path.csv").write_bytes(text.encode())
        (only,) = load_cases(file)
        return only

    return make


def motion_of_run(case: Case) -> Any:
    return process_scene(case, BED).case.model_dump(mode="json")["motion"]


# --- the file ------------------------------------------------------------------------------------


def test_a_file_is_what_stands_in_it(made: Made) -> None:
    """Run ids and case.json know points only, however they are written."""
    inline = made()
    for text in (
        CSV,
        CSV.replace(",", ", ").replace("\n", "\r\n") + "\r\n\r\n",
        "\ufeff" + CSV,
        "# recorded\n" + CSV.replace(",", ";").replace(".", ","),
        "x_m,time_s,z_m,y_m\n" + "".join(f"{x},{t},{(*z, 0)[0]},{y}\n" for t, x, y, *z in POINTS),
    ):
        case = made(text)
        assert case.study == inline.study
        assert PROCESS.run_id(case) == PROCESS.run_id(inline)
    assert "file" not in case.study.motion.path.plain()


def test_a_study_finds_the_file_of_the_one_it_extends(made: Made, project: Project) -> None:
    base = made(CSV)
    folder = project.studies / "next"
    folder.mkdir()
    file = folder / "study.yaml"
    file.write_text("extends: small\ntitle: next\n")
    (case,) = load_cases(file)
    assert case.study.motion == base.study.motion
    (folder / "path.csv").write_text("time_s,x_m,y_m\n0,0,0\n1,0.01,0\n")
    (case,) = load_cases(file)
    assert len(case.study.motion.path.plain()["points"]) == 2  # type: ignore[arg-type]


def test_a_sweep_may_name_files(made: Made) -> None:
    case = made(CSV)
    data = yaml.safe_load(case.file.read_text())
    data["sweep"] = {"motion.path.file": ["path.csv", "other.csv"]}
    case.file.write_text(yaml.safe_dump(data))
    (case.file.parent / "other.csv").write_text("time_s,x_m,y_m\n0,0,0\n1,0.01,0\n")
    one, other = load_cases(case.file)
    assert one.study == case.study
    assert other.name == "quick_file-other.csv"
    assert PROCESS.run_id(one) != PROCESS.run_id(other)


HEADER = "time_s,x_m,y_m\n"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("", None, "the file is empty"),
        ("time_s,x_m\n0,0\n", ":1", "the columns are not those"),
        ("time_s,x_m,y_m,speed\n0,0,0,0\n", ":1", "the columns are not those"),
        ("time_s,x_m,y_m,y_m\n0,0,0,0\n", ":1", "the columns are not those"),
        ("0,0,0\n1,0.01,0\n", ":1", "the columns are not those"),
        (HEADER + "0,0,0\n\n1,abc,0\n", ":4: x_m", "'abc' is text, not a number"),
        (HEADER + "0,0,0\n", None, "at least 2"),
        (HEADER + "".join(f"{n},{n / 1e4},0\n" for n in range(150)), None, "at most 100"),
        (HEADER + "0,0,0\n1,0.01,0\n1,0.02,0\n", ":4: time_s", "the time does not increase"),
        (HEADER + "0,0,0\n1,0.01,0\n0.5,0.02,0\n", ":4: time_s", "the time does not increase"),
        (HEADER + "0,0,0\n1,0.01,0\n1.0001,0.02,0\n", ":4: speed_m_s", "is not plausible"),
        (HEADER + "0,0,0\n1,15,0\n", ":3: x_m", "did you mean 15 mm"),
    ],
)  # fmt: skip
def test_a_bad_file_is_named_with_its_line(
    made: Made, text: str, place: str | None, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        made(text)
    where = "path.csv" if place is None else f"path.csv{place}"
    assert f"small/{where}: " in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["missing.csv", "", "x" * 290, "."])
def test_a_missing_file_is_named(made: Made, name: str) -> None:
    with pytest.raises(InputError, match="no such file") as caught:
        made(CSV, file=name)
    assert caught.value.field == "motion.path.file"
    assert caught.value.line is not None


# --- fields --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ({"points": None}, "motion.path.points: a list is required"),
        ({"points": []}, "motion.path.points: the list has 0 entries"),
        ({"points": [[0, 0, 0], [1, 0]]}, "motion.path.points.1.2: a required"),
        ({"points": [[0, 0, 0], [1, *[0] * 7]]}, "points.1: the list has 8 entries"),
        ({"points": [[0, 0, 0], [1, True, 0]]}, "motion.path.points.1.1: a number is required"),
        ({"points": [[0, 0, 0], [0, 0.01, 0]]}, "motion.path.points.1.0: the time does not"),
        ({"points": [[0, 0, 0], [1, 0, 0, 0.01]]}, "does not move horizontally"),
        ({"points": [[0, 0, 0], [1, 0, 0]]}, "does not move horizontally"),
        ({"points": [[0, 0, 0], [1e-3, 0.1, 0]]}, "motion.path.points.1.speed_m_s: is not plaus"),
        ({"points": [[0, 0, 0], [1e8, 0.1, 0]]}, "motion.path.speed_m_s: is not plausible"),
        ({"points": [[0, 0, 0], [1e308, 0.1, 0], [1.7e308, 1e308, 0]]}, "is not plausible"),
        ({"points": [[-1e308, 0, 0], [1e308, 0.1, 0]]}, "is not plausible"),
        ({"points": [[0, 0, 0], [5e-324, 0.1, 0]]}, "is not plausible"),
        ({"fraction": 1.1}, "motion.path.fraction: the value is out of range"),
        ({"fraction": 0}, "motion.path.fraction: the value is out of range"),
        ({"file": "path.csv"}, "motion.path: give either file or points, and not both"),
        ({"speed_m_s": 1}, "motion.path.speed_m_s: unknown key"),
    ],
)  # fmt: skip
def test_fields_that_cannot_be(made: Made, path: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        made(**path)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../../../secret.csv", "more/../../secret.csv", "../small"]
)
def test_a_file_outside_the_study_is_refused_and_not_shown(
    made: Made, project: Project, name: str
) -> None:
    (project.studies / "secret.csv").write_text("root:x:0:0\n")
    (project.root.parent / "secret.csv").write_text("root:x:0:0\n")
    with pytest.raises(InputError, match="the path leaves the folder of the study") as caught:
        made(CSV, file=name)
    assert caught.value.field == "motion.path.file"
    assert "root:x" not in str(caught.value)


def test_a_file_that_is_no_table_of_waypoints_is_not_quoted(made: Made) -> None:
    with pytest.raises(InputError, match="the columns are not those of waypoints") as caught:
        made("root:x:0:0:root:/root:/bin/sh\n")
    assert "root:x" not in str(caught.value)
    with pytest.raises(InputError, match="value:  time_s,x_m,y_in"):
        made("time_s,x_m,y_in\n0,0,0\n1,1,0\n")


def test_neither_file_nor_points(small: dict[str, Any], write_study: Any) -> None:
    small["motion"] |= {"path": {"kind": "waypoints"}, "speed_m_s": None}
    with pytest.raises(InputError, match="give either file or points"):
        load_cases(write_study(small))


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ({"speed_m_s": 0.01}, "are both given: remove speed_m_s"),
        ({"counted_from_revolution": 1}, "to circles only: this path has no revolutions"),
        ({"transient_m": 1.01 * LENGTH}, "no path is left for the statistics"),
        (
            {"path": {"kind": "waypoints", "points": TURNING}, "spin": {"rpm": 9}},
            "spin and waypoints that turn cannot be combined",
        ),
        (
            {"path": {"kind": "waypoints", "points": [[0, 0, 0], [1, 0.01, 0, 0, 0, 360, 0]]}},
            "turns by 360 degrees from one waypoint to the next",
        ),
    ],
)
def test_fields_beside_it_that_cannot_be(made: Made, motion: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        made(motion=motion)


def test_a_stretch_that_is_hardly_meant_gives_a_warning(made: Made) -> None:
    case = made(points=[[0, 0, 0], [1, 0.01, 0], [1.002, 0.02, 0]])
    (warning,) = warnings(case.study)
    assert "motion.path.points.2.speed_m_s 5 is not plausible" in warning.text
    assert not warnings(made().study)


# --- speeds and checks ---------------------------------------------------------------------------


def test_speeds_follow_from_the_times(made: Made) -> None:
    case = made()
    motion, peak = case.study.motion, math.hypot(0.008, 0.001) / 0.2
    assert motion.nominal_speed_m_s == pytest.approx(LENGTH / 0.7)
    assert motion.path_length_m == pytest.approx(LENGTH)
    assert motion.surface_speed_m_s(0.004) == pytest.approx(peak)
    assert fastest_motion(case) == pytest.approx(0.1)  # the plunge
    assert describe(case)["superposed_speed"] == pytest.approx(peak * 0.7 / LENGTH - 1)
    steady = made(points=[[0, 0, 0], [0.1, 0.003, 0], [0.3, 0.003, 0.006]])
    assert "superposed_speed" not in describe(steady)


def test_the_fastest_stretch_widens_the_speed_limit(made: Made) -> None:
    """Plunge and approach are slower than the path."""
    slow = {"plunge_speed_m_s": 0.01, "approach_speed_m_s": 0.01}
    limits = [
        process_scene(made(points=[[0, 0, 0], [at, 0.005, 0], [1, 0.01, 0]], motion=slow), BED)
        for at in (0.5, 0.01)
    ]
    one, other = (scene.case.limits.speed_m_s for scene in limits)
    assert other > one


def test_no_stage_is_without_a_step() -> None:
    """A stage shorter than a step takes one, and those beyond the end of the drag are left out."""
    stages = list(in_steps([1e-6, 2e-6, 0.5, 1.0], 40, 0.01))
    assert stages == [(1, 0.0, 1e-6), (1, 1e-6, 2e-6), (38, 2e-6, 0.4)]
    assert list(in_steps([0.399, 0.3999, math.inf], 40, 0.01)) == [
        (38, 0.0, 0.399), (1, 0.399, 0.3999), (1, 0.3999, 0.4)
    ]  # fmt: skip
    assert [steps for steps, _, _ in in_steps([0.01, 0.02, 0.03, 9], 2, 0.02)] == [1, 1]
    assert list(in_steps([], 40, 0.01)) == [(40, 0.0, 0.4)]


@pytest.mark.parametrize(
    ("points", "depth", "words"),
    [
        ([[0, 0, 0], [1, 0.021, 0]], 0.015, "does not fit between its path and the bowl"),
        ([[0, 0.017, 0], [1, 0, 0]], 0.015, "no particle fits"),
        ([[0, 0, 0], [1, 0.01, 0, -0.017]], 0.015, "takes the workpiece too deep"),
        ([[0, 0, 0, -0.017], [1, 0.01, 0]], 0.015, "takes the workpiece too deep"),
        ([[0, 0, 0], [1, 0.01, 0, 0.015]], 0.015, "takes the workpiece out of the packing"),
    ],
)
def test_a_path_that_does_not_fit(made: Made, points: Any, depth: float, words: str) -> None:
    case = made(points=points, motion={"immersion_depth_m": depth})
    with pytest.raises(InputError, match=words) as caught:
        process_scene(case, BED)
    assert caught.value.field == "motion.path"


def test_path_and_oscillation_add_up(made: Made) -> None:
    points = [[0, 0, 0], [1, 0.01, 0, -0.008]]
    process_scene(made(points=points), BED)
    both = made(points=points, motion={"oscillation": {"amplitude_m": 0.009, "frequency_hz": 1}})
    with pytest.raises(InputError, match=r"motion\.path and motion\.oscillation: takes"):
        process_scene(both, BED)
    assert clearances(both, 0.038).floor_m == pytest.approx(0.038 - 0.015 - 0.017)


def test_a_path_that_dips_has_a_longer_workpiece(made: Made) -> None:
    length = workpiece_length(made())
    deeper = workpiece_length(made(points=[[0, 0, 0], [1, 0.01, 0, -0.002]]))
    assert deeper == pytest.approx(length + 0.002)


def test_a_path_that_crosses_particles_in_a_step_is_refused(made: Made) -> None:
    case = made(points=[[0, 0, 0], [1, 0.01, 0], [1.0004, 0.014, 0]], factor=60)
    with pytest.raises(InputError, match="moves by more than a particle radius") as caught:
        process_scene(case, BED)
    assert caught.value.field == "motion.path"


# --- input script and preview --------------------------------------------------------------------


def test_long_paths_take_several_formulas(made: Made, project: Project) -> None:
    """Each has the steps and values of its stages, and no line is too long for the engine."""
    points = [[n / 100, 0.01 * math.sin(n), 0.01 * math.cos(n)] for n in range(100)]
    case = made(points=points)
    scene, text = process_scene(case, BED), script(case, project)
    assert "v_stage_vx_10 v_stage_vy_10 v_stage_vz_10\n" in text
    assert max(map(len, text.splitlines())) < 1000
    rows = dict(re.findall(r"^variable (stage_v[xyz]_\d+) equal (.*)$", text, re.MULTILINE))
    assert len(rows) == 30
    stages = scene.case.model_dump(mode="json")["motion"]["stages"]
    for name, axis in (("x", 0), ("z", 2)):
        begun = scene.case.phases[-1].start_step
        for stage in stages:
            for step in (begun + 1, begun + stage["steps"]):
                known: dict[str, Any] = {"step": step}
                for number in range(1, 11):
                    row = f"stage_v{name}_{number}"
                    known[f"v_{row}"] = eval(rows[row], {}, known)
                assert known[f"v_stage_v{name}_10"] == stage["velocity_m_s"][axis]
            begun += stage["steps"]


def test_case_json_says_that_the_workpiece_does_not_turn(made: Made) -> None:
    found = motion_of_run(made())
    assert (found["kind"], found["orientation"]) == ("waypoints", "fixed")
    assert found["start_direction_rad"] == 0
    late = made(points=[[0, 0, 0], [1, 0, 0], [2, 0, 0, 0.001], [3, 0, -0.01]])
    assert motion_of_run(late)["start_direction_rad"] == pytest.approx(-math.pi / 2)


def test_the_drag_starts_at_the_height_of_the_first_waypoint(made: Made) -> None:
    def lowest(case: Case) -> float:
        return float(layout(case).workpieces[0].stages[0].poses[-1, 2, 3])

    higher = made(points=[[0, 0, 0, 0.002], [1, 0.01, 0]])
    assert lowest(higher) == pytest.approx(lowest(made()) + 0.002)


def test_a_drag_at_another_pace_and_length(made: Made) -> None:
    own = made(points=[[0, 0, 0], [100, 0, 0], [101, 0.01, 0]], motion={"transient_m": 0.0})
    motion = own.study.motion.at(2.0, 0.004)
    assert motion.path_length_m == pytest.approx(0.004)
    assert motion.nominal_speed_m_s == pytest.approx(2 * own.study.motion.nominal_speed_m_s)

"""The preview: what it draws before anything is run."""

import re
import subprocess
import sys

import numpy as np
import pytest
from made_study import Load, Made
from matplotlib.colors import to_rgb
from PIL import Image

from dragdeck.cases.case import Case
from dragdeck.cli import main
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import cylinder, prism
from dragdeck.outlook.process import workpiece_notes
from dragdeck.preview.layout import COLOURS, CaseLayout, layout
from dragdeck.preview.picture import swept
from dragdeck.project import Project
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.process_cautions import process_cautions

BAR = {"workpiece.shape": {"kind": "mesh", "file": "bar.stl", "unit": "m"}}
"""The small study drags a hexagonal bar from a file."""


@pytest.fixture(autouse=True)
def bar(inside: Project) -> None:
    file = inside.studies / "small/bar.stl"
    file.parent.mkdir()
    file.write_text(stl_text(prism(6, 0.004, 0.05, 0.004, 0.01)))


def picture(project: Project) -> np.ndarray:
    """Pixels of the picture, (H, W, 3) from 0 to 1."""
    with Image.open(project.results("small") / "preview.png") as image:
        return np.asarray(image.convert("RGB")) / 255


def pixels(image: np.ndarray, name: str) -> int:
    """How many pixels above the legend have the hue of a colour, in whatever light."""
    image = image[:-60]
    hue = np.array(to_rgb(COLOURS[name]))
    norms = np.linalg.norm(image, axis=2) * np.linalg.norm(hue)
    return int((image @ hue > 0.995 * norms).sum())


def test_the_picture_shows_the_workpiece(
    case: Case, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["preview", "small"]) == 0
    said = capsys.readouterr().out
    assert str(project.results("small") / "preview.png") in said
    assert not (project.results("small") / "set_up.png").exists()
    assert main(["step", "set-up", "small"]) == 0
    assert (project.results("small") / "set_up.png").is_file()
    image = picture(project)
    assert pixels(image, "workpiece") > 5000
    for name in ("drag", "approach", "plunge"):
        assert pixels(image, name) > 80, name


def test_the_gaps_are_stated_by_check(case: Case, capsys: pytest.CaptureFixture[str]) -> None:
    main(["check", "small", "--verbose"])
    shown = capsys.readouterr().out
    for name in ("gap between workpiece and floor", "highest surface speed", "bed height",
                 "diameter of the workpiece / mean particle diameter: 1.2"):  # fmt: skip
        assert name in shown
    wall = (0.025 - 0.010 - 0.004) / 2 / 3.27e-3
    stated = re.search(r"workpiece and wall: (\S+) particle diameters", shown)
    assert stated and float(stated[1]) == pytest.approx(wall, rel=0.01)


def test_notes_and_warnings_have_one_particle_diameter(made: Made) -> None:
    """Of clumps, too: that of the sphere around them."""
    shape = {"kind": "cylinder", "aspect": 1.2, "spheres": 2}
    case = made({"media.shape": shape, "media.radius_std_m": 0, "motion.path.radius_m": 0.011})
    stated = dict(workpiece_notes(case))["gap between workpiece and wall"]
    (warned,) = (one.text for one in process_cautions(case) if one.code == "gap")
    diameters = [float(re.search(r"(\S+) particle diam", text)[1]) for text in (stated, warned)]
    assert diameters[0] == pytest.approx(diameters[1], rel=0.05)
    assert diameters[0] < 0.9 * 1e3 * clearances(case, 0.03).wall_m / (2 * 3.27)


def test_the_floor_gap_counts_an_oscillation(made: Made) -> None:
    case = made({"motion.oscillation": {"amplitude_m": 0.003, "frequency_hz": 5}})
    gaps = clearances(case, 0.05)
    assert gaps.tip_m == pytest.approx(0.035)
    assert gaps.floor_m == pytest.approx(0.032)


def test_a_workpiece_through_the_wall_is_drawn(made: Made, project: Project) -> None:
    made({"motion.path": {"kind": "circle", "radius_m": 0.023, "revolutions": 0.1}})
    assert main(["preview", "small"]) == 0
    assert pixels(picture(project), "workpiece") > 5000


def test_a_workpiece_that_cannot_be_read_is_refused_as_by_check(
    made: Made, project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    made({"workpiece.shape": {"kind": "mesh", "file": "none.stl", "unit": "m"}})
    assert main(["preview", "small"]) == 1
    said = capsys.readouterr().err
    assert said.count("no such mesh file") == 1 and "study.yaml:" in said
    assert not project.results("small").exists()


def test_the_named_case_is_drawn_and_the_first_by_default(
    load: Load, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []

    def draw(scene: CaseLayout, title: str) -> bytes:
        drawn.append(title)
        return b""

    monkeypatch.setattr("dragdeck.commands.picture", draw)
    load({"sweep": {"motion.immersion_depth_m": [0.010, 0.016]}})
    assert main(["preview", "small"]) == 0
    assert "case quick_immersion_depth_m-0.01, one of 2 (--case)" in capsys.readouterr().out
    assert main(["preview", "small", "--case", "quick_immersion_depth_m-0.016"]) == 0
    assert main(["preview", "small", "--case", "quick"]) == 1
    assert "one of: quick_immersion_depth_m-0.01" in capsys.readouterr().err
    assert [title.rpartition("-")[2] for title in drawn] == ["0.01", "0.016"]


def test_a_mesh_is_turned_to_the_direction_of_motion(made: Made) -> None:
    """A bar with a corner along +x has one along the direction of motion, and turns with it."""
    line = {"kind": "line", "start_m": [-0.005, 0], "direction_deg": 70, "length_m": 0.01}
    (body,) = layout(made({**BAR, "motion.path": line})).workpieces
    across = body.at_start.vertices[:, :2] - body.drag.poses[0, :2, 3]
    corner = across[np.hypot(*across.T) > 0.00399]
    angles = np.degrees(np.arctan2(*corner.T[::-1])) % 60
    assert angles == pytest.approx(10)
    circle = {"kind": "circle", "radius_m": 0.01, "revolutions": 0.1}
    first, last = layout(made({"motion.path": circle})).workpieces[0].drag.poses[[0, -1]]
    angles = [np.degrees(np.arctan2(pose[1, 0], pose[0, 0])) for pose in (first, last)]
    assert angles == pytest.approx([90, 126])


def test_a_workpiece_sweeps_where_it_goes(made: Made) -> None:
    """A bar on a circle of 10 mm, a corner of 4 mm ahead; it is lifted by an oscillation."""
    still = swept(layout(made({**BAR, "motion.path.revolutions": 1})).workpieces[0])
    out, inside = (np.hypot(0.010 + side * 0.004 * np.cos(np.pi / 6), 0.002) for side in (1, -1))
    away = np.hypot(*still.vertices[:, :2].T)
    assert (away.min(), away.max()) == pytest.approx((inside, out), abs=2e-4)
    oscillation = {"amplitude_m": 0.003, "frequency_hz": 20}
    lifted = swept(layout(made({"motion.oscillation": oscillation})).workpieces[0])
    assert lifted.bounds[:, 2] - still.bounds[:, 2] == pytest.approx([-0.003, 0.003], abs=3e-4)


def test_a_fine_mesh_is_drawn_with_fewer_triangles(made: Made, project: Project) -> None:
    fine = cylinder(0.004, 0.05, 0.0004)
    assert len(fine.faces) > 10_000
    (project.studies / "small/bar.stl").write_text(stl_text(fine))
    sheet = swept(layout(made(BAR)).workpieces[0])
    assert len(sheet.faces) < 60_000
    assert np.ptp(sheet.bounds[:, 2]) == pytest.approx(0.05, abs=5e-4)


def test_other_commands_load_no_graphics(case: Case) -> None:
    script = (
        "import sys; from dragdeck.cli import main; main(['check', 'small']); "
        "print([name for name in ('pyvista', 'matplotlib', 'trimesh') if name in sys.modules])"
    )
    call = [sys.executable, "-c", script]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"

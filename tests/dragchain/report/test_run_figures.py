import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from changed import changed
from figure_files import LAST, R, case_json, write_process_run
from made_run import line, with_motion, write_documents
from networks import make_frame
from PIL import Image

from dragchain.errors import TableError
from dragchain.figures import network_picture as scene
from dragchain.figures.narrow import NARROW
from dragchain.figures.rendering import RenderError, check_rendering
from dragchain.network.frame import SIDE, NetworkFrame
from dragchain.report.findings import FINDINGS_FILE, FillingFindings, ProcessFindings
from dragchain.report.run_data import RunData, dominant_bottlenecks, of_classes, process_findings
from dragchain.report.run_figures import energy_ratio, write_figures
from dragchain.run.reference import reference_drags
from dragchain.statistics.estimate import Estimate
from dragdeck.physics.walls import round_container
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.figures import figures_of
from dragdeck.study.reference import Drag, Reference
from dragdeck.study.rotations import Orientations

pytestmark = pytest.mark.slow  # its data take seconds to make


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a made process run with tables and chains."""
    return write_process_run(tmp_path_factory.mktemp("process"))


@pytest.fixture(scope="module")
def drawn(process: Path) -> list[Path]:
    """The pictures of the process run, drawn once."""
    return write_figures(process)


@pytest.fixture
def found(process: Path, drawn: list[Path]) -> ProcessFindings:
    return ProcessFindings.read(process / FINDINGS_FILE)


def test_findings_of_a_process_are_those_of_its_tables(found: ProcessFindings) -> None:
    assert found.process_time_zero_s == pytest.approx(0.1)
    assert found.peaks.count == 1
    assert found.peaks.process_time_s == pytest.approx([0.23])
    assert found.peaks.largest_n == pytest.approx(-5.0)
    assert found.workpiece_frames == 31
    assert found.ahead_behind.ahead_n.value == pytest.approx(3.0)
    assert found.ahead_behind.behind_n.value == pytest.approx(1.0)
    assert found.depth.slope_n_per_m.value == pytest.approx(200.0)
    assert found.network_frames == 16
    assert found.chains.widest_paths_per_frame == 1.0
    assert found.chains.widest_paths_to_side_fraction == 1.0
    assert found.chains.dominant_azimuth_mean_rad == pytest.approx(0.0)


def test_classes_share_contacts_and_load() -> None:
    """In each of 40 frames, three contacts of the coarse class, 2 N each, one of the fine, 1 N.

    Another of the fine class overlaps without a force.
    """
    frame = np.repeat(np.arange(40), 5)
    classes = ["coarse", "coarse", "fine", "coarse", "fine"]
    kinds = pd.Categorical(classes * 40, ["coarse", "fine", "none"])
    contacts = pd.DataFrame({"class": kinds, "normal_force_n": [2.0, 2.0, 1.0, 2.0, 0.0] * 40})
    found = of_classes(["coarse", "fine", "absent"], frame, 40, contacts)
    assert [value.value for value in found["coarse"]] == pytest.approx([3, 2, 6 / 7])
    assert [value.value for value in found["fine"]] == pytest.approx([1, 1, 1 / 7])
    assert [value.known for value in found["absent"]] == [True, False, True]


def test_segregation_starts_with_the_drag_and_not_with_the_statistics(
    process: Path, tmp_path: Path
) -> None:
    """Of two classes of equal volumes, one lies on top in the first frame, and is mixed later."""
    folder = shutil.copytree(process, tmp_path / "run")
    case = json.loads((folder / "case.json").read_text())
    of_class = {"material": "ceramic", "volume_m3": 1e-6, "radius_mean_m": R, "radius_std_m": 0.0,
                "density_kg_m3": 2656.0, "contact_moduli": {}}  # fmt: skip
    case["classes"] = [
        {"name": name, "first_id": first, "count": 10} | of_class
        for name, first in (("upper", 1), ("lower", 11))
    ]
    (folder / "case.json").write_text(json.dumps(case))
    frame = {"particle_id": [1, 11], "radius_m": R, "class": ["upper", "lower"]}
    steps = sorted(pd.read_parquet(folder / "tables/particles.parquet")["step"].unique())
    rows = [
        pd.DataFrame(frame | {"step": step, "z_m": [0.03, 0.01] if step == steps[0] else 0.02})
        for step in steps
    ]
    pd.concat(rows).to_parquet(folder / "tables/particles.parquet")
    file = folder / "tables/workpiece_contacts.parquet"
    pd.read_parquet(file).assign(**{"class": "upper"}).to_parquet(file)
    found = process_findings(RunData(folder, load_case(folder))).segregation
    assert found["upper"] == pytest.approx((0.5, 0.0))


def test_a_frame_without_a_path_has_no_bottleneck() -> None:
    network = pd.DataFrame({"step": [1, 2, 3]})
    chains = pd.DataFrame(
        {"step": [1, 1, 3], "dominant": [False, True, True], "bottleneck_n": [9.0, 2.0, 4.0]}
    )
    assert dominant_bottlenecks(network, chains).tolist() == [2.0, 0.0, 4.0]


def reference(**drag: float) -> Reference:
    return Reference(source="x", experiment=Drag(**drag))


def test_comparison_is_relative_to_the_reference() -> None:
    ours = Estimate(-1.99, -2.01, -1.97)
    (drag,) = reference_drags(reference(drag_mean_n=-2.59, drag_std_n=0.66))
    difference = drag.difference(ours)
    assert drag.label == "experiment"
    assert difference.value == pytest.approx(1.99 / 2.59 - 1)
    assert difference.ci95_low < difference.value < difference.ci95_high
    assert drag.std_n == 0.66
    assert reference_drags(None) == []


def test_a_reference_of_zero_is_refused() -> None:
    with pytest.raises(TableError, match=r"experiment\.drag_mean_n is 0"):
        reference_drags(reference(drag_mean_n=0.0))


def test_process_figures_are_whole_pictures(process: Path, drawn: list[Path]) -> None:
    names = list(figures_of("process"))
    assert [path.stem for path in drawn] == names
    assert sorted(path.name for path in (process / "figures").iterdir()) == sorted(
        f"{name}{end}.png" for name in names for end in ("", NARROW)
    )
    for path in drawn:
        with Image.open(path) as picture:
            picture.load()
            assert min(picture.size) > 400
            assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 20


# --- the network's pictures ------------------------------------------------------------------


UPRIGHT = Orientations(np.zeros(1))


def network_frame(between_n: float, on_side_n: float) -> NetworkFrame:
    """Two particles on the x axis in contact with each other and with the side."""
    centres = {4: (-R, 0.0, 0.015), 7: (R, 0.0, 0.015)}
    return make_frame(centres, [(4, 7, between_n), (7, SIDE, on_side_n)])


def test_the_largest_force_has_the_mean_particle_radius() -> None:
    radii = scene.cylinder_radii(np.array([0.0, 1.0, 4.0]), R)
    assert radii == pytest.approx([0.0, R / 4, R])
    assert scene.cylinder_radii(np.zeros(2), R).tolist() == [0.0, 0.0]
    assert scene.cylinder_radii(np.array([]), R).size == 0


def test_times_of_a_faster_run_are_those_of_the_process(process: Path) -> None:
    """A workpiece 5 times as fast takes a fifth of the time; its own speed is that of the run."""
    case = load_case(process)
    fidelity = case.fidelity.model_copy(update={"speed_factor": 5.0})
    data = case.model_copy(update={"fidelity": fidelity}).model_dump()
    fast = CaseOfRun.model_validate(with_motion(data, **line(0.1, start_m=[-0.01, 0.0])))
    slow, quick = (process_findings(RunData(process, one)) for one in (case, fast))
    for name in ("process_time_s", "separation_s"):
        ours, theirs = (np.array(getattr(found.peaks, name)) for found in (quick, slow))
        np.testing.assert_allclose(ours, 5 * theirs)
    trace, own = RunData(process, fast).drag, RunData(process, case).drag
    np.testing.assert_allclose(trace.process_time_s, 5 * own.process_time_s)
    assert scene.load_scene(process, fast).process_time_s == pytest.approx(5 * 0.4)


def pixel(image: Any, extent: Any, across_mm: float, up_mm: float) -> Any:
    """Return the colour at a place of the picture."""
    rows, columns = image.shape[:2]
    column = int((across_mm - extent[0]) / (extent[1] - extent[0]) * columns)
    row = int((extent[3] - up_mm) / (extent[3] - extent[2]) * rows)
    return image[row, column].astype(int)


def is_strongest(colour: Any) -> bool:
    """Whether it is the dark end of the colour map."""
    return bool(colour[0] < 90 and colour[1] < 40 and colour[2] < 130)


@pytest.mark.parametrize(("view", "level_mm"), [("xy", 0.0), ("xz", 15.0)])
def test_a_rendered_contact_is_where_its_axes_say(
    process: Path, view: scene.View, level_mm: float
) -> None:
    case = load_case(process)
    far = np.array([0.015, 0.012, 0.01])
    shown = scene.NetworkScene(network_frame(2.0, 0.5), far, UPRIGHT, None, 0.2)
    image, extent = scene.render_view(process, case, shown, view)
    assert is_strongest(pixel(image, extent, 0.0, level_mm))
    assert is_strongest(pixel(image, extent, -2.5, level_mm + 2.0))
    assert not is_strongest(pixel(image, extent, 0.0, level_mm + 3.5))
    assert not is_strongest(pixel(image, extent, -4.0, level_mm))
    # the weaker contact, a quarter as thick, goes on to the side
    weak = pixel(image, extent, 5.0, level_mm)
    assert weak[0] > weak[2] + 60 and not is_strongest(weak)
    assert min(pixel(image, extent, 5.0, level_mm + 1.5)) > 200


def widened(case: CaseOfRun, radius_m: float) -> CaseOfRun:
    return changed(case, bowl=round_container(radius_m))


def test_a_wide_bowl_is_cut_to_the_surroundings_of_the_workpiece(process: Path) -> None:
    case = widened(load_case(process), 0.5)
    reach = 2 * R * scene.WINDOW_DIAMETERS
    depth = 2 * R * scene.DEPTH_DIAMETERS
    workpiece = np.array([0.5 + 0.004 - reach / 2, 0.1, 0.01])
    frame = network_frame(1.0, 1.0)
    places = np.array([[0.0, 1.1 * depth, 0.0], [-1.1 * reach, 0.0, 0.0]]) + workpiece
    shown = scene.NetworkScene(replace(frame, point=places), workpiece, UPRIGHT, None, 0.2)
    above, side = (scene.window(case, shown, view) for view in ("xy", "xz"))
    assert above.low.tolist() == pytest.approx((workpiece[:2] - reach).tolist())
    assert above.high.tolist() == pytest.approx([0.504, 0.1 + reach])  # no farther than the bowl
    assert above.contacts is not None and above.contacts.tolist() == [True, False]
    assert side.contacts is not None and side.contacts.tolist() == [False, False]
    assert f"{scene.WINDOW_DIAMETERS:g} particle diameters" in scene.cut_words(case, "xy")


def test_a_machine_that_cannot_render_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json")
    with pytest.raises(RenderError, match="libgl1-mesa-dri"):
        check_rendering()


# --- fill and drop ---------------------------------------------------------------------------


@pytest.fixture
def filling(tmp_path: Path) -> Path:
    settle = [{"name": "settle", "start_step": 0, "end_step": LAST}]
    case = case_json("filling", phases=settle, settled={"energy_ratio": 1e-5, "highest_m": 0.1})
    write_documents(tmp_path, case)
    lengths = {"bed_height_m": 0.07, "top_m": 0.075, "radius_mean_m": R, "radius_std_m": 0.0}
    numbers = {"solid_fraction": 0.59, "n_particles": 3, "kinetic_energy_ratio": 1e-7}
    bed = {"schema": 2, **lengths, **numbers}
    (tmp_path / "tables" / "packing.json").write_text(json.dumps(bed))
    return tmp_path


def test_a_filling_without_thermo_has_no_figure(filling: Path) -> None:
    assert write_figures(filling) == []
    found = FillingFindings.read(filling / FINDINGS_FILE)
    assert found.bed["solid_fraction"] == 0.59
    assert found.rest_energy_ratio == 1e-5


def test_energy_ratio_of_particles_that_fell_their_diameter_is_one(filling: Path) -> None:
    case: CaseOfRun = load_case(filling)
    mass = 2500.0 * 4 / 3 * math.pi * R**3
    ratio = energy_ratio(np.array([2 * mass * 10.0 * 2 * R]), np.array([2.0]), case)
    assert ratio == pytest.approx([1.0])


@pytest.mark.slow
@pytest.mark.parametrize("window", ["vtkNoSuchWindow", "vtkWin32OpenGLRenderWindow"])
def test_a_window_in_the_environment_of_a_user_is_not_used(
    window: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", window)
    check_rendering()
